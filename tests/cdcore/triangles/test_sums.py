"""Exact sums, orientations and axes: the sign is that of rational arithmetic, whatever cancels."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdcore.kernels.compiling import kernel
from cdcore.triangles import exact_pairs
from cdcore.triangles import sums as exact_sums
from cdcore.triangles.sums import new_digits


@kernel
def add_double(digits, value):
    exact_sums.add_double(digits, value)


@kernel
def add_product(digits, a, b):
    exact_sums.add_product(digits, a, b)


@kernel
def sign_of_digits(digits):
    return exact_sums.sign_of_digits(digits)


@kernel
def two_sum(a, b):
    return exact_sums.two_sum(a, b)


@kernel
def two_product(a, b):
    return exact_sums.two_product(a, b)


@kernel
def exponents_are_moderate(points):
    return exact_sums.exponents_are_moderate(points, len(points))


moderate = st.floats(-(2.0**60), 2.0**60, allow_nan=False).filter(lambda x: x == 0 or abs(x) > 2.0**-60)


def sign(value):
    return (value > 0) - (value < 0)


@settings(deadline=None)  # the first call compiles
@given(moderate, moderate)
def test_two_sum_and_two_product_keep_every_bit(a, b):
    assert sum(map(Fraction, two_sum(a, b))) == Fraction(a) + Fraction(b)
    assert sum(map(Fraction, two_product(a, b))) == Fraction(a) * Fraction(b)


@settings(deadline=None)  # the first call compiles
@given(st.lists(moderate, min_size=1, max_size=8))
def test_the_sign_of_a_sum_is_exact(values):
    digits = new_digits()
    for value in values:
        add_double(digits, value)
    assert sign_of_digits(digits) == sign(sum(map(Fraction, values)))


@settings(deadline=None)  # the first call compiles
@given(moderate, moderate, moderate)
def test_exact_sum_of_a_product_and_its_parts_is_zero(a, b, c):
    """``two_product`` splits a b into two doubles without error; c times 2^-200 then decides the sign of the rest."""
    digits = new_digits()
    add_product(digits, a, b)
    for component in two_product(a, b):
        add_double(digits, -component)
    assert sign_of_digits(digits) == 0
    digits = new_digits()
    add_product(digits, a, b)
    add_product(digits, -b, a)
    add_double(digits, c * 2.0**-200)
    assert sign_of_digits(digits) == sign(c)


@pytest.mark.parametrize("size", [2.0**-756, 2.0**-252, 1.0, 2.0**604])
def test_exact_sum_holds_192_terms_of_extreme_size(size):
    for direction in (1.0, -1.0):
        digits = new_digits()
        for _ in range(192):
            add_double(digits, direction * size)
        assert sign_of_digits(digits) == direction


def test_only_zero_and_moderate_sizes_count_as_moderate():
    """Moderate is from 2**-200 to 2**200."""
    assert exponents_are_moderate(np.array([0.0, 1.0, -(2.0**-199)]))
    assert not exponents_are_moderate(np.array([0.0, 1.0, 2.0**-201]))
    assert not exponents_are_moderate(np.array([0.0, 1.0, -(2.0**201)]))


@kernel
def orientation_sign(p, a, b, c, d, w):
    return exact_pairs.orientation_sign(p.ravel(), a, b, c, d, w)


@kernel
def orientation_filtered(p, a, b, c, d):
    return exact_pairs.orientation_filtered(p.ravel(), a, b, c, d)


@kernel
def cross_sign(p, a, b, c, d, axis, w):
    return exact_pairs.cross_sign(p.ravel(), a, b, c, d, axis, w)


def exact_volume(p):
    """Sign of the volume of a tetrahedron, in rationals."""
    a, b, c = ([Fraction(float(p[k, i])) - Fraction(float(p[3, i])) for i in range(3)] for k in range(3))
    cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    volume = sum(x * y for x, y in zip(cross, c, strict=True))
    return (volume > 0) - (volume < 0)


def nearly_flat(rng, step):
    """Four points of which the last is within two steps of the plane of the others."""
    p = rng.random((4, 3))
    weights = rng.dirichlet([1, 1, 1])
    p[3] = weights @ p[:3]
    p[3] += rng.integers(-2, 3, 3) * step
    return p


@pytest.mark.sampled(2)
@pytest.mark.parametrize("step", [0.0, 2.0**-53, 2.0**-45, 1e-3])
def test_sign_of_four_nearly_coplanar_points_is_exact(step):
    rng, w = np.random.default_rng(3), new_digits()
    for _ in range(200):
        p = nearly_flat(rng, step)
        want = exact_volume(p)
        assert orientation_sign(p, 0, 1, 2, 3, w) == want
        assert orientation_filtered(p, 0, 1, 2, 3) in (want, 2)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_cross_sign_is_exact_for_nearly_parallel_segments(axis):
    """Points 2 and 3 repeat half of the way from 0 to 1, but for at most a rounding; the sign is that of rationals."""
    rng, w = np.random.default_rng(5), new_digits()
    i, j = (axis + 1) % 3, (axis + 2) % 3
    for _ in range(200):
        p = rng.random((4, 3))
        p[3] = p[2] + (p[1] - p[0]) * 0.5 + rng.integers(-1, 2, 3) * 2.0**-53
        u, v = ([Fraction(float(p[k + 1, m])) - Fraction(float(p[k, m])) for m in (i, j)] for k in (0, 2))
        exact = u[0] * v[1] - u[1] * v[0]
        assert cross_sign(p, 0, 1, 2, 3, axis, w) == (exact > 0) - (exact < 0)
