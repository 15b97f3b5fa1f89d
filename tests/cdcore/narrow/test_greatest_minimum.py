"""Linear programmes of a greatest minimum: the kernel against SciPy and against its slow reference.

``greatest_minimum(slopes, values, limits, bounds)`` is the x at which the least of the linear functions
``values + slopes @ x`` is largest, where ``limits @ x <= bounds``; ``None`` where there is no such x.
"""

import numpy as np
import pytest

from cdcore.narrow import greatest_minimum as module
from cdcore.narrow.greatest_minimum import greatest_minimum

CUBE = np.concatenate([np.eye(3), -np.eye(3)])
"""Limits of three variables: with bounds of 0.3 a cube with edges of 0.6 about the origin."""
TRIANGLE = np.array([[-1.0, 0.0], [0.0, -1.0], [1.0, 1.0]])
"""Limits of two variables."""
BOUND = 0.3


def least_at(x, slopes, values):
    """The least of the linear functions at a point."""
    return (values + slopes @ x).min()


def functions_of(seed, count, dimensions):
    """Linear functions; of odd seeds those of distances, of every fifth seed many with one value and one slope."""
    rng = np.random.default_rng(seed)
    slopes, values = rng.normal(size=(count, dimensions)), rng.uniform(1.0, 1.0 + seed / 10, size=count)
    if seed % 2:
        slopes /= np.linalg.norm(slopes, axis=1, keepdims=True)
    if seed % 5 == 0:
        slopes[::2], values[::2] = slopes[0], values[0]
    return slopes, values


@pytest.mark.parametrize("seed", range(10))
def test_greatest_minimum_of_linear_functions_agrees_with_scipy(seed):
    """60 random functions of three variables, in a cube with edges of 0.6; SciPy maximises t <= each function."""
    from scipy.optimize import linprog

    slopes, values = functions_of(seed, count=60, dimensions=3)
    x = greatest_minimum(slopes, values, CUBE, np.full(6, BOUND))
    rows = np.column_stack([-slopes, np.ones(60)])
    bounds = [(-BOUND, BOUND)] * 3 + [(None, None)]
    programme = linprog([0, 0, 0, -1], A_ub=rows, b_ub=values, bounds=bounds)
    greatest = -programme.fun
    assert least_at(x, slopes, values) == pytest.approx(greatest, rel=1e-9, abs=0)


@pytest.mark.parametrize(
    ("limits", "count"),
    [
        pytest.param(TRIANGLE, 48, id="48 functions in a triangle"),
        pytest.param(CUBE, 48, id="48 functions in a cube"),
        pytest.param(TRIANGLE, 1, id="a function in a triangle"),
        pytest.param(CUBE, 2, id="two functions in a cube"),
    ],
)
@pytest.mark.parametrize("seed", range(5))
def test_compiled_greatest_minimum_equals_its_interpreted_reference(seed, limits, count, monkeypatch):
    """Random functions in a triangle or a cube: the kernel and its reference in Python, chosen by INTERPRETED, reach
    the same greatest minimum, or neither has an answer.
    """
    slopes, values = functions_of(seed, count, limits.shape[1])
    bounds = np.full(len(limits), BOUND)
    compiled = greatest_minimum(slopes, values, limits, bounds)
    monkeypatch.setattr(module, "INTERPRETED", True)
    reference = greatest_minimum(slopes, values, limits, bounds)
    assert (compiled is None) == (reference is None)
    if reference is not None:
        assert least_at(compiled, slopes, values) == pytest.approx(
            least_at(reference, slopes, values), rel=1e-12, abs=0
        )


def test_few_exchanges_reach_the_greatest_minimum(monkeypatch):
    """60 functions of three variables in six limits, 66 rows: a search begins with the limits and four functions.

    It computes their best corner, takes in the row that this breaks most, leaves out functions that are not tight
    there, and so on. Of ten seeds none needs more than seven corners, or 14 rows at a time (numbers by trial).
    """
    compute_corner = module.highest_corner
    for seed in range(10):
        row_counts = []

        def noted_corner(rows, bounds, slack, row_counts=row_counts):
            row_counts.append(len(rows))
            return compute_corner(rows, bounds, slack)

        monkeypatch.setattr(module, "highest_corner", noted_corner)
        slopes, values = functions_of(seed, count=60, dimensions=3)
        greatest_minimum(slopes, values, CUBE, np.full(6, BOUND))
        assert 1 <= len(row_counts) <= 7, seed
        assert max(row_counts) <= 14, seed


def test_rows_that_meet_in_no_corner_have_no_answer():
    """A constant function in the strip -1 <= x <= 1: nothing bounds the second variable."""
    strip, bounds = np.array([[1.0, 0.0], [-1.0, 0.0]]), np.ones(2)
    assert greatest_minimum(np.zeros((1, 2)), np.ones(1), strip, bounds) is None
