"""Orientation signs are those of exact rational arithmetic, also where all points lie within an ulp of one plane."""

from fractions import Fraction

import numpy as np
import pytest

from cdcore.kernels.compiling import kernel
from cdcore.narrow.triangles import orientation
from cdcore.narrow.triangles.sums import new_digits


@kernel
def orientation_sign(p, a, b, c, d, w):
    return orientation.orientation_sign(p.ravel(), a, b, c, d, w)


@kernel
def orientation_filtered(p, a, b, c, d):
    return orientation.orientation_filtered(p.ravel(), a, b, c, d)


@kernel
def cross_sign(p, a, b, c, d, axis, w):
    return orientation.cross_sign(p.ravel(), a, b, c, d, axis, w)


def exact_volume(p):
    a, b, c = ([Fraction(float(p[k, i])) - Fraction(float(p[3, i])) for i in range(3)] for k in range(3))
    cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    volume = sum(x * y for x, y in zip(cross, c, strict=True))
    return (volume > 0) - (volume < 0)


def nearly_flat(rng, step):
    p = rng.random((4, 3))
    weights = rng.dirichlet([1, 1, 1])
    p[3] = weights @ p[:3]
    p[3] += rng.integers(-2, 3, 3) * step
    return p


@pytest.mark.parametrize("step", [0.0, 2.0**-53, 2.0**-45, 1e-3])
def test_sign_of_four_nearly_coplanar_points_is_exact(step):
    rng, w = np.random.default_rng(3), new_digits()
    for _ in range(400):
        p = nearly_flat(rng, step)
        want = exact_volume(p)
        assert orientation_sign(p, 0, 1, 2, 3, w) == want
        assert orientation_filtered(p, 0, 1, 2, 3) in (want, 2)


def test_filter_leaves_nearly_coplanar_points_open_and_decides_others():
    rng = np.random.default_rng(4)
    flat = [orientation_filtered(nearly_flat(rng, 2.0**-53), 0, 1, 2, 3) for _ in range(200)]
    wide = [orientation_filtered(rng.random((4, 3)), 0, 1, 2, 3) for _ in range(200)]
    assert flat.count(2) > 40
    assert wide.count(2) == 0


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_cross_sign_is_exact_for_nearly_parallel_segments(axis):
    rng, w = np.random.default_rng(5), new_digits()
    i, j = (axis + 1) % 3, (axis + 2) % 3
    for _ in range(400):
        p = rng.random((4, 3))
        p[3] = p[2] + (p[1] - p[0]) * 0.5 + rng.integers(-1, 2, 3) * 2.0**-53
        u, v = ([Fraction(float(p[k + 1, m])) - Fraction(float(p[k, m])) for m in (i, j)] for k in (0, 2))
        exact = u[0] * v[1] - u[1] * v[0]
        assert cross_sign(p, 0, 1, 2, 3, axis, w) == (exact > 0) - (exact < 0)
