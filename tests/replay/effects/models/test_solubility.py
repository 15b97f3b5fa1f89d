"""What falls out, against quadratics and against what equilibrium demands of every solid at once."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.effects.models.solubility import solids_formed

KSP = 1.77e-10


def fallen(first, second, litres=1.0, ksp=KSP, powers=(1, 1)):
    a, b, volume = np.broadcast_arrays(
        *(np.atleast_1d(np.asarray(one, dtype=float)) for one in (first, second, litres))
    )
    return solids_formed(np.stack([a, b], axis=1), volume, np.array([powers], dtype=float), np.array([ksp]))[0][:, 0]


@given(st.floats(1e-6, 1.0), st.floats(1e-6, 1.0))
def test_one_to_one_solves_its_quadratic(first, second):
    x = fallen(first, second)[0]
    if first * second <= KSP:
        assert x == 0.0
    else:
        # The smaller root of (a - x)(b - x) = K in the form that adds.
        total = first + second
        root = np.sqrt((first - second) ** 2 + 4 * KSP)
        assert x == pytest.approx(2 * (first * second - KSP) / (total + root), rel=1e-9, abs=1e-18)


@given(st.floats(1e-9, 1.0), st.floats(1e-9, 1.0), st.floats(1e-3, 10.0))
def test_two_to_one_ends_at_its_product_and_dissolves_nothing_that_was_not_there(first, second, litres):
    x = fallen(first, second, litres, 1e-12, (2, 1))[0]
    assert 0.0 <= x <= min(first / 2, second)
    left = ((first - 2 * x) / litres) ** 2 * (second - x) / litres
    scarce = min(first - 2 * x, second - x)
    if x > 0.0 and scarce > 1e-9 * max(first, second):
        assert left == pytest.approx(1e-12, rel=1e-5)
    elif x == 0.0:
        assert left <= 1e-12 * (1 + 1e-9)


def test_just_below_the_product_nothing_falls_and_just_above_something():
    edge = np.sqrt(KSP)
    assert fallen(edge * (1 - 1e-9), edge)[0] == 0.0 and fallen(edge * (1 + 1e-6), edge)[0] > 0.0


def test_equal_amounts_leave_the_root_of_the_product():
    assert 1.0 - fallen(1.0, 1.0)[0] == pytest.approx(np.sqrt(KSP), rel=1e-9)


def test_without_one_ion_or_without_liquid_nothing_falls():
    assert fallen([0.0, 1.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 0.0]).tolist() == [0.0, 0.0, 0.0]


def test_more_of_either_ion_never_makes_less_solid():
    more = fallen(np.linspace(0.0, 0.1, 200), np.full(200, 0.05), np.full(200, 1.0))
    assert (np.diff(more) >= 0.0).all() and more[-1] == pytest.approx(0.05, rel=1e-6)


@pytest.mark.parametrize("seed", range(20))
def test_of_several_salts_each_is_at_its_product_or_is_not_there_and_nothing_is_lost(seed):
    rng = np.random.default_rng(seed)
    uses = np.array([[1, 1, 0, 0, 0], [2, 0, 1, 0, 0], [0, 0, 1, 1, 0], [0, 0, 0, 1, 2]], dtype=float)
    total, litres = 10.0 ** rng.uniform(-8, 0, (50, 5)), 10.0 ** rng.uniform(-3, 0, 50)
    products = 10.0 ** rng.uniform(-30, -3, 4)
    solid, left = solids_formed(total, litres, uses, products)
    assert np.abs(left + solid @ uses - total).max(axis=1) == pytest.approx(0.0, abs=1e-14)
    over = np.log(left / litres[:, None]) @ uses.T - np.log(products)
    assert (solid >= 0.0).all() and over[solid > 0.0] == pytest.approx(0.0, abs=1e-8)
    assert (over[solid == 0.0] <= 1e-8).all()
