import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.effects.models.acid_base import AcidBase
from replay.effects.models.equation import approach, atoms, equation_of
from replay.effects.models.gas_laws import gas_ml_per_mol, vapour_pressure_pa
from replay.effects.models.solubility import amount_fallen


@pytest.mark.parametrize(
    ("formula", "counts"),
    [("NaCl", {"Na": 1, "Cl": 1}), ("Ca(OH)2", {"Ca": 1, "O": 2, "H": 2}),
     ("CuSO4.5H2O", {"Cu": 1, "S": 1, "O": 9, "H": 10}), ("Al2(SO4)3", {"Al": 2, "S": 3, "O": 12})],
)  # fmt: skip
def test_atoms_are_counted(formula, counts):
    assert dict(atoms(formula)) == counts


@pytest.mark.parametrize("formula", ["", "nacl", "Na(", "Na)", "Na+", "()"])
def test_what_is_no_formula_is_refused(formula):
    with pytest.raises(ValueError, match="formula"):
        atoms(formula)


def test_an_equation_has_two_balanced_sides():
    equation = equation_of("Zn + 2 HCl -> ZnCl2 + H2")
    assert equation.reagents == {"Zn": 1, "HCl": 2} and equation.products == {"ZnCl2": 1, "H2": 1}
    with pytest.raises(ValueError, match="not balanced: Cl 1 and 2, H 1 and 2"):
        equation_of("Zn + HCl -> ZnCl2 + H2")
    with pytest.raises(ValueError, match="has no ->"):
        equation_of("Zn + 2 HCl = ZnCl2 + H2")
    with pytest.raises(ValueError, match="coefficient 0"):
        equation_of("0 Zn -> 0 Zn")


def test_it_goes_to_the_end_of_the_limiting_reagent():
    equation = equation_of("Zn + 2 HCl -> ZnCl2 + H2")
    amounts = {"Zn": np.array([1.0, 1.0, 0.0, 1.0]), "HCl": np.array([1.0, 4.0, 1.0, 0.0])}
    assert equation.extent(amounts).tolist() == [0.5, 1.0, 0.0, 0.0]


@given(st.lists(st.floats(1e-6, 1e4), min_size=2, max_size=20), st.floats(1e-6, 1e3))
def test_a_first_order_approach_is_its_closed_form_however_it_is_cut(steps, rate):
    times = np.concatenate([[0.0], np.cumsum(steps)])
    reached = approach(times, np.full(len(times), 2.0), rate)
    assert reached[-1] == pytest.approx(-2.0 * np.expm1(-rate * times[-1]), rel=1e-9)
    assert (np.diff(reached) >= 0.0).all() and reached.max() <= 2.0


def test_a_goal_that_sinks_below_what_has_happened_undoes_nothing():
    assert approach(np.array([0.0, 10.0, 20.0]), np.array([1.0, 0.1, 0.1]), 1.0)[-1] == pytest.approx(1.0, rel=1e-4)


WATER = (8.07131, 1730.63, 233.426)
"""Of water from 1 to 100 degC, as handbooks print it; here only a test's input."""


def test_the_molar_volume_at_standard_conditions_is_that_of_codata():
    assert gas_ml_per_mol(0.0, 101325.0) == pytest.approx(22413.97, abs=0.01)
    assert gas_ml_per_mol(0.0, 100000.0) == pytest.approx(22710.95, abs=0.01)


def test_water_boils_at_its_boiling_point_and_over_water_a_gas_takes_more_room():
    assert vapour_pressure_pa(100.0, WATER) == pytest.approx(101325.0, rel=0.002)
    wet = gas_ml_per_mol(20.0, 101325.0, vapour_pressure_pa(20.0, WATER))
    assert wet / gas_ml_per_mol(20.0, 101325.0) == pytest.approx(1.0236, abs=2e-4)


@pytest.mark.parametrize(("celsius", "vapour"), [(-273.15, 0.0), (20.0, 101325.0), (20.0, 2e5)])
def test_where_there_is_no_gas_it_says_so(celsius, vapour):
    with pytest.raises(ValueError, match="no gas is collected"):
        gas_ml_per_mol(celsius, 101325.0, vapour)


def test_antoines_pole_is_refused():
    with pytest.raises(ValueError, match="no value at -233"):
        vapour_pressure_pa(-233.426, WATER)


KSP = 1.77e-10


def fallen(first, second, litres=1.0, ksp=KSP, powers=(1, 1)):
    arrays = [np.atleast_1d(np.asarray(one, dtype=float)) for one in (first, second, litres)]
    return amount_fallen({"A": arrays[0], "B": arrays[1]}, {"A": powers[0], "B": powers[1]}, arrays[2], ksp)


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


WATER_acid_base = AcidBase(pkw=14.0)
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
    assert ph(WATER_acid_base, NaCl=molar)[0] == pytest.approx(7.0, abs=1e-12)
    assert ph(WATER_acid_base, HCl=molar)[0] + ph(WATER_acid_base, KOH=molar)[0] == pytest.approx(14.0, abs=1e-9)


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
    assert ph(WATER_acid_base, HCl=0.0)[0] == pytest.approx(7.0) and len(WATER_acid_base.ph({})) == 0


def test_barium_hydroxide_gives_two():
    assert ph(WATER_acid_base, **{"Ba(OH)2": 0.05, "HCl": 0.1})[0] == pytest.approx(7.0, abs=1e-6)
