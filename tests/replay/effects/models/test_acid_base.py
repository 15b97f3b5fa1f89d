import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.effects.models.acid_base import AcidBase

WATER = AcidBase(pkw=14.0)
ACETIC = AcidBase({"HAc": (4.756,), "H3PO4": (2.148, 7.198, 12.375)}, {"NH3": 9.25, "NaAc": 4.756}, 14.0)


def ph(chemistry, **molar):
    return chemistry.ph({formula: np.atleast_1d(np.asarray(value, float)) for formula, value in molar.items()})


def closed_form(acid, base, pkw=14.0):
    """Strong acid with strong base: [H] solves a quadratic; the form without cancellation on either side."""
    half = 0.5 * (acid - base)
    root = np.hypot(half, 10.0 ** (-pkw / 2))
    return -np.log10(half + root) if half >= 0 else pkw + np.log10(root - half)


@given(st.floats(0.0, 20.0), st.floats(0.0, 20.0), st.floats(12.0, 15.0))
def test_strong_acid_and_base_have_the_ph_of_the_quadratic(acid, base, pkw):
    assert ph(AcidBase(pkw=pkw), HCl=acid, NaOH=base)[0] == pytest.approx(closed_form(acid, base, pkw), abs=1e-9)


@pytest.mark.parametrize("molar", [1e-12, 1e-8, 1e-7, 1e-3, 1.0, 18.0])
def test_water_is_neutral_and_acid_and_base_mirror_each_other(molar):
    assert ph(WATER, NaCl=molar)[0] == pytest.approx(7.0, abs=1e-12)
    assert ph(WATER, HCl=molar)[0] + ph(WATER, KOH=molar)[0] == pytest.approx(14.0, abs=1e-9)


@pytest.mark.parametrize("molar", [0.5, 0.05, 0.01])
def test_at_half_equivalence_the_ph_is_the_pka_within_the_dilution_error(molar):
    # To first order the buffer's ratio is off by 2 [H] / (c / 2).
    error = 2 * 10.0**-4.756 / (molar / 2) / np.log(10) * 2
    assert ph(ACETIC, HAc=molar, NaOH=molar / 2)[0] == pytest.approx(4.756, abs=error)
    assert ph(ACETIC, NH3=molar, HCl=molar / 2)[0] == pytest.approx(9.25, abs=error)


def test_a_weak_acid_solves_its_cubic():
    for molar in (1e-9, 1e-6, 1e-3, 1.0):
        constant, water = 10.0**-4.756, 1e-14
        roots = np.roots([1.0, constant, -(water + constant * molar), -constant * water])
        proton = max(root.real for root in roots if abs(root.imag) < 1e-20)
        assert ph(ACETIC, HAc=molar)[0] == pytest.approx(-np.log10(proton), abs=1e-6)


def test_the_salt_of_a_weak_acid_is_the_acid_with_its_equivalent_of_base():
    assert ph(ACETIC, NaAc=0.1)[0] == pytest.approx(ph(ACETIC, HAc=0.1, NaOH=0.1)[0], abs=1e-9)


def test_three_protons_have_their_pka_halfway_between_their_equivalences():
    curve = ph(ACETIC, H3PO4=np.full(2, 0.1), NaOH=np.array([0.15, 0.05]))
    assert curve == pytest.approx([7.198, 2.148], abs=0.3) and abs(curve[0] - 7.198) < 0.01


@given(st.sampled_from(["HCl", "HAc", "H3PO4"]), st.floats(1e-14, 100.0))
def test_adding_base_only_raises_the_ph_and_it_stays_finite_at_every_extreme(acid, molar):
    base = np.concatenate([[0.0], np.logspace(-16, 2, 200)])
    curve = ph(ACETIC, **{acid: np.full(201, molar)}, NaOH=base)
    assert np.isfinite(curve).all() and (np.diff(curve) >= -1e-12).all()


def test_nothing_at_all_is_water_and_no_row_is_none():
    assert ph(WATER, HCl=0.0)[0] == pytest.approx(7.0) and len(WATER.ph({})) == 0


def test_barium_hydroxide_gives_two():
    assert ph(WATER, **{"Ba(OH)2": 0.05, "HCl": 0.1})[0] == pytest.approx(7.0, abs=1e-6)
