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
    """Up to eight doubles of sizes from 2^-60 to 2^60, whose sum is computed in rationals."""
    digits = new_digits()
    for value in values:
        add_double(digits, value)
    assert sign_of_digits(digits) == sign(sum(map(Fraction, values)))


@given(moderate, moderate)
def test_exact_sum_of_a_product_and_its_halves_is_zero(a, b):
    """``two_product`` splits a b into a rounded result and its error, which are taken off a b again."""
    digits = new_digits()
    add_product(digits, a, b)
    for component in two_product(a, b):
        add_double(digits, -component)
    assert sign_of_digits(digits) == 0


@given(moderate, moderate, moderate)
def test_the_least_term_decides_where_products_cancel(a, b, c):
    """a b - b a + c 2^-200 has the sign of c."""
    digits = new_digits()
    add_product(digits, a, b)
    add_product(digits, -b, a)
    add_double(digits, c * 2.0**-200)
    assert sign_of_digits(digits) == sign(c)


@pytest.mark.parametrize("size", [2.0**-756, 2.0**-252, 1.0, 2.0**604], ids=["2^-756", "2^-252", "1", "2^604"])
@pytest.mark.parametrize("sign_of_terms", [1, -1])
def test_exact_sum_holds_192_terms_of_extreme_size(size, sign_of_terms):
    """The sum of 192 equal terms has their sign: no digit overflows."""
    digits = new_digits()
    for _ in range(192):
        add_double(digits, sign_of_terms * size)
    assert sign_of_digits(digits) == sign_of_terms


@pytest.mark.parametrize(
    ("largest", "is_moderate"),
    [(-(2.0**-199), True), (2.0**-201, False), (-(2.0**201), False)],
    ids=["2^-199", "2^-201", "2^201"],
)
def test_only_zero_and_moderate_sizes_count_as_moderate(largest, is_moderate):
    """Moderate is 0, and from 2^-200 to 2^200; three numbers are 0, 1 and another one of this size."""
    numbers = np.array([0.0, 1.0, largest])
    assert exponents_are_moderate(numbers, len(numbers)) == is_moderate


def sign_of_volume(corners):
    """Sign of the volume of a tetrahedron (4, 3), in rationals."""
    a, b, c = ([Fraction(float(corners[k, i])) - Fraction(float(corners[3, i])) for i in range(3)] for k in range(3))
    cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    return sign(sum(x * y for x, y in zip(cross, c, strict=True)))


def nearly_flat(rng, step):
    """Four random points of which the last is within two steps of the plane of the others, on each axis."""
    points = rng.random((4, 3))
    weights = rng.dirichlet([1, 1, 1])
    points[3] = weights @ points[:3] + rng.integers(-2, 3, 3) * step
    return points


@pytest.mark.sampled(2)
@pytest.mark.parametrize("step", [0.0, 2.0**-53, 2.0**-45, 1e-3])
def test_sign_of_four_nearly_coplanar_points_is_exact(step):
    """200 tetrahedra, points 0 to 3, whose last corner is within two steps of the plane of the others.

    The sign of the volume is that of rationals, which rounded products may miss; the filter may answer 2, undecided.
    """
    rng, digits, undecided = np.random.default_rng(3), new_digits(), 2
    for _ in range(200):
        points = nearly_flat(rng, step)
        expected = sign_of_volume(points)
        assert orientation_sign(points.ravel(), 0, 1, 2, 3, digits) == expected
        assert orientation_filtered(points.ravel(), 0, 1, 2, 3) in (expected, undecided)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("axis", [0, 1, 2], ids="xyz".__getitem__)
def test_cross_sign_is_exact_for_nearly_parallel_segments(axis):
    """200 pairs of segments, from point 0 to 1 and 2 to 3: the second is half of the first, moved, but for a rounding.

    The sign of their cross product along an axis is that of rationals.
    """
    rng, digits = np.random.default_rng(5), new_digits()
    i, j = (axis + 1) % 3, (axis + 2) % 3
    for _ in range(200):
        a, b, c, _ = rng.random((4, 3))
        d = c + (b - a) * 0.5 + rng.integers(-1, 2, 3) * 2.0**-53
        first, second = (
            [Fraction(float(end[k])) - Fraction(float(start[k])) for k in (i, j)] for start, end in ((a, b), (c, d))
        )
        expected = sign(first[0] * second[1] - first[1] * second[0])
        assert cross_sign(np.concatenate([a, b, c, d]), 0, 1, 2, 3, axis, digits) == expected
