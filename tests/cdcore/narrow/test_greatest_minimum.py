"""Linear programmes of a greatest minimum: the kernel against SciPy and against its slow reference."""

import numpy as np
import pytest

from cdcore.narrow import greatest_minimum as module
from cdcore.narrow.greatest_minimum import greatest_minimum

AROUND = np.concatenate([np.eye(3), -np.eye(3)])
TRIANGLE = np.array([[-1.0, 0.0], [0.0, -1.0], [1.0, 1.0]])


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
    """The highest point of the lower envelope of 60 random functions within 0.3 of a place."""
    from scipy.optimize import linprog

    slopes, values = functions_of(seed, count=60, dimensions=3)
    result = greatest_minimum(slopes, values, AROUND, np.full(6, 0.3))
    rows = np.column_stack([-slopes, np.ones(60)])
    least = linprog([0, 0, 0, -1], A_ub=rows, b_ub=values, bounds=[(-0.3, 0.3)] * 3 + [(None, None)])
    assert (values + slopes @ result).min() == pytest.approx(-least.fun, rel=1e-9)


@pytest.mark.parametrize(("limits", "count"), [(TRIANGLE, 48), (AROUND, 48), (TRIANGLE, 1), (AROUND, 2)])
@pytest.mark.parametrize("seed", range(5))
def test_compiled_greatest_minimum_equals_its_interpreted_reference(seed, limits, count, monkeypatch):
    """The largest value of the least of ``count`` linear functions where ``limits @ x <= 0.3``."""
    slopes, values = functions_of(seed, count, limits.shape[1])
    right = np.full(len(limits), 0.3)
    quick = greatest_minimum(slopes, values, limits, right)
    monkeypatch.setattr(module, "INTERPRETED", True)
    slow = greatest_minimum(slopes, values, limits, right)
    assert (quick is None) == (slow is None)
    if slow is not None:
        assert (values + slopes @ quick).min() == pytest.approx((values + slopes @ slow).min(), rel=1e-12)


def test_few_exchanges_reach_the_greatest_minimum(monkeypatch):
    """Rows are taken in one by one, and those that are loose leave: of 60 rows at most 14 are worked with at a time.

    At most seven corners are computed.
    """
    sizes, highest_corner = [], module.highest_corner

    def noted_corner(rows, bounds, slack):
        sizes[-1].append(len(rows))
        return highest_corner(rows, bounds, slack)

    monkeypatch.setattr(module, "highest_corner", noted_corner)
    for seed in range(10):
        sizes.append([])
        greatest_minimum(*functions_of(seed, count=60, dimensions=3), AROUND, np.full(6, 0.3))
    assert max(len(steps) for steps in sizes) <= 7
    assert max(size for steps in sizes for size in steps) <= 14


def test_rows_that_meet_in_no_corner_have_no_answer():
    """A strip: nothing bounds the second variable."""
    assert greatest_minimum(np.zeros((1, 2)), np.ones(1), np.array([[1.0, 0.0], [-1.0, 0.0]]), np.ones(2)) is None
