"""Exact sums, orientations and axes: the sign is that of rational arithmetic, whatever cancels."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.processes import kernels_in_python

from cdcore.triangles.exact_pairs import cross_sign, orientation_filtered, orientation_sign
from cdcore.triangles.sums import (
    add_double,
    add_product,
    exponents_are_moderate,
    new_digits,
    sign_of_digits,
    two_product,
    two_sum,
)


@pytest.fixture(autouse=True, scope="module")
def sums_in_python():
    """Sums are Python: the compiler takes longer than these tests, and tests of triangles call what it makes."""
    with kernels_in_python():
        yield


moderate = st.floats(-(2.0**60), 2.0**60, allow_nan=False).filter(lambda x: x == 0 or abs(x) > 2.0**-60)


def sign(value):
    """-1, 0 or 1."""
    return (value > 0) - (value < 0)


@given(moderate, moderate)
def test_two_sum_and_two_product_keep_every_bit(a, b):
    """Each returns a rounded result and its error: together, in rationals, they are the sum and the product."""
    assert sum(map(Fraction, two_sum(a, b))) == Fraction(a) + Fraction(b)
    assert sum(map(Fraction, two_product(a, b))) == Fraction(a) * Fraction(b)


@given(st.lists(moderate, min_size=1, max_size=8))
def test_the_sign_of_a_sum_is_exact(values):
    """Up to eight doubles from 2^-60 to 2^60, whose sum is computed in rationals."""
    digits = new_digits()
    for value in values:
        add_double(digits, value)
    assert sign_of_digits(digits) == sign(sum(map(Fraction, values)))


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
    """192 terms of one sign and size: the sum has that sign."""
    for direction in (1.0, -1.0):
        digits = new_digits()
        for _ in range(192):
            add_double(digits, direction * size)
        assert sign_of_digits(digits) == direction


def test_only_zero_and_moderate_sizes_count_as_moderate():
    """Moderate is from 2**-200 to 2**200."""
    assert exponents_are_moderate(np.array([0.0, 1.0, -(2.0**-199)]), 3)
    assert not exponents_are_moderate(np.array([0.0, 1.0, 2.0**-201]), 3)
    assert not exponents_are_moderate(np.array([0.0, 1.0, -(2.0**201)]), 3)


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
    """The points 0 to 3 are corners of a tetrahedron; the sign of its volume in rationals is the truth.

    Rounded to doubles it may be wrong; the filter may answer 2, undecided.
    """
    rng, w = np.random.default_rng(3), new_digits()
    for _ in range(200):
        p = nearly_flat(rng, step)
        want = exact_volume(p)
        assert orientation_sign(p.ravel(), 0, 1, 2, 3, w) == want
        assert orientation_filtered(p.ravel(), 0, 1, 2, 3) in (want, 2)


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
        assert cross_sign(p.ravel(), 0, 1, 2, 3, axis, w) == (exact > 0) - (exact < 0)
