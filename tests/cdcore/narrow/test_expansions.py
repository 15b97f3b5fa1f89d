"""Expansions lose nothing: their components add up, as fractions, to the exact sum or product."""

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdcore.narrow.expansions import (
    expansion_scale,
    expansion_sign,
    expansion_sum,
    exponents_are_moderate,
    minor_expansion,
    two_product,
    two_sum,
)

moderate = st.floats(-(2.0**60), 2.0**60, allow_nan=False).filter(lambda x: x == 0 or abs(x) > 2.0**-60)


def total(w, start, length):
    return sum((Fraction(float(value)) for value in w[start : start + length]), Fraction(0))


@given(moderate, moderate)
def test_two_sum_and_two_product_keep_every_bit(a, b):
    assert sum(map(Fraction, two_sum(a, b))) == Fraction(a) + Fraction(b)
    assert sum(map(Fraction, two_product(a, b))) == Fraction(a) * Fraction(b)


@given(st.lists(moderate, min_size=4, max_size=4), st.lists(moderate, min_size=4, max_size=4), moderate)
def test_sums_and_scalings_of_expansions_are_exact_and_end_in_the_sign(first, second, factor):
    w = np.zeros(256)
    w[1], w[0] = two_sum(first[0], first[1])
    w[9], w[8] = two_sum(second[0], second[1])
    length = expansion_sum(w, 0, 2, 8, 2, 16)
    exact = sum(map(Fraction, first[:2] + second[:2]))
    assert total(w, 16, length) == exact
    assert expansion_sign(w, 16, length) == (exact > 0) - (exact < 0)
    scaled = expansion_scale(w, 16, length, factor, 64)
    assert total(w, 64, scaled) == exact * Fraction(factor)


@given(st.lists(moderate, min_size=8, max_size=8))
def test_a_minor_of_differences_is_exact(values):
    pairs = [two_sum(values[k], -values[k + 1]) for k in range(0, 8, 2)]
    w = np.zeros(256)
    length = minor_expansion(w, *[part for pair in pairs for part in pair], 16, 0)
    a, b, c, d = (Fraction(values[k]) - Fraction(values[k + 1]) for k in range(0, 8, 2))
    assert total(w, 0, length) == a * b - c * d
    assert length <= 16


def test_only_zero_and_moderate_sizes_count_as_moderate():
    assert exponents_are_moderate(np.array([[0.0, 1.0, -(2.0**-199)]]))
    assert not exponents_are_moderate(np.array([[0.0, 1.0, 2.0**-201]]))
    assert not exponents_are_moderate(np.array([[0.0, 1.0, -(2.0**201)]]))
