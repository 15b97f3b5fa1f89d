"""The compiled exact decision equals integers on small lattices, where nearly every pair is degenerate somehow."""

import numpy as np
import pytest

from cdcore.kernels.compiling import kernel
from cdcore.narrow.triangles import exact as triangle_exact
from cdcore.narrow.triangles.integers import pair_intersects_integers
from cdcore.narrow.triangles.sums import new_digits


@kernel
def pair_intersects_exact(p, w):
    return triangle_exact.pair_intersects_exact(p.ravel(), w)


@kernel
def projection_axis(p, a, b, c, d, w):
    return triangle_exact.projection_axis(p.ravel(), a, b, c, d, w)


@kernel
def lexicographic_ends(p, t):
    return triangle_exact.lexicographic_ends(p.ravel(), t)


@pytest.mark.parametrize("high", [2, 3, 4])
def test_exact_decision_equals_integers_on_a_lattice(high):
    rng, w = np.random.default_rng(high), new_digits()
    pairs = rng.integers(0, high, (3_000, 6, 3)).astype(float)
    wrong = [
        k
        for k, pair in enumerate(pairs)
        if pair_intersects_exact(pair, w) != pair_intersects_integers(pair.reshape(2, 3, 3).tolist())
    ]
    assert wrong == []


def test_projection_axis_is_one_the_product_does_not_vanish_along():
    w = new_digits()
    p = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1], [2, 0, 0.0]])
    assert projection_axis(p, 0, 1, 0, 2, w) == 1
    assert projection_axis(p, 0, 1, 0, 3, w) == -1


def test_ends_of_a_flat_triangle_are_its_extreme_corners():
    p = np.array([[1, 0, 0], [0, 5, 0], [3, 0, 0], [2, 2, 2], [2, 2, 2], [2, 2, 2.0]])
    assert lexicographic_ends(p, 0) == (1, 2)
    first, last = lexicographic_ends(p, 3)
    assert p[first].tolist() == p[last].tolist()
