"""Redox potentials (`replay.effects.chemistry.redox`) are those of handbooks and of PHREEQC at full equilibrium."""

import numpy as np
import pytest
from support.liquid_worlds import BURETTE_COLUMN, MIXING_IN_FLASK, effects_of_tap_degrees, glass
from support.second_opinions import library_with_minteq

from replay.effects.chemistry.redox import couples_of
from replay.effects.effect_summary import titration_curves

PERMANGANATE = "MnO4- + 5 Fe2+ + 8 H+ -> Mn2+ + 5 Fe3+ + 4 H2O"
HZ = 4
"""Frames a second."""
VOLT_PER_PE = 0.05916
"""R T ln 10 / F at 25 degC."""
NO_OXYGEN = "SOLUTION_SPECIES\n2H2O = O2 + 4H+ + 4e-\n log_k -200\n"
"""PHREEQC's permanganate would oxidise water, which takes days."""


def curves(flask, burette, equation, rate=None):
    """Curves of a titration, by what they show: 10 mL in the flask, into which the burette runs, 18 mL in 8 s.

    ``flask``, ``burette``: solute -> mol/L; ``rate``: of a slow reaction, 1/s.
    """
    reaction = ("reaction", {"equation": equation} | ({} if rate is None else {"rate_per_s": rate}))
    effects = effects_of_tap_degrees(
        [0.0, 0.0, *([90.0] * 8 * HZ), 0.0],
        MIXING_IN_FLASK,
        reaction,
        flask=glass("flask", volume_ml=10.0, solutes=flask),
        burette=glass("burette", volume_ml=50.0, solutes=burette, cavity=BURETTE_COLUMN),
        step_ns=round(1e9 / HZ),
        settings={"full_area_m2": 1.2e-6},
    )
    return {curve.quantity: curve for curve in titration_curves(effects)}


def potential_by_phreeqc(molar):
    """V of a solution of ions (PHREEQC's name -> mol/L) where every oxidation state is at equilibrium but oxygen."""
    library = library_with_minteq(NO_OXYGEN)
    # Each state is brought alone, so that PHREEQC mixes what it would otherwise refuse to be given together.
    text = "SOLUTION 1\n units mol/kgw\n pH 7 charge\nREACTION 1\n"
    text += "".join(f" {formula} {float(amount)!r}\n" for formula, amount in molar.items())
    text += " 1.0 moles\nSELECTED_OUTPUT\n -reset false\n -pe true\nEND\n"
    assert not library.RunString(text), library.GetErrorString()
    return VOLT_PER_PE * library.GetSelectedOutput()["pe"][-1]


# Standard potentials in V: CRC Handbook, 97th ed., Electrochemical Series; I2 and Br2 dissolved.
HANDBOOK = [
    ({"MnO4-": -1.0, "Fe^2+": -5.0, "H+": -8.0, "Mn^2+": 1.0, "Fe^3+": 5.0, "H2O": 4.0}, 1.507, 0.771),
    ({"H2O2": -1.0, "I-": -2.0, "H+": -2.0, "I2": 1.0, "H2O": 2.0}, 1.776, 0.621),
    ({"MnO4-": -2.0, "H2O2": -5.0, "H+": -6.0, "Mn^2+": 2.0, "O2(g)": 5.0, "H2O": 8.0}, 1.507, 0.695),
    ({"Ce^4+": -2.0, "Sn^2+": -1.0, "Ce^3+": 2.0, "Sn^4+": 1.0}, 1.72, 0.151),
    ({"IO3-": -1.0, "I-": -5.0, "H+": -6.0, "I2": 3.0, "H2O": 3.0}, 1.195, 0.621),
    ({"Br2": -1.0, "I-": -2.0, "Br-": 2.0, "I2": 1.0}, 1.0873, 0.621),
    ({"MnO4-": -2.0, "C2O4^2-": -5.0, "H+": -16.0, "Mn^2+": 2.0, "CO2(g)": 10.0, "H2O": 8.0}, 1.507, -0.59),
]  # fmt: skip


def test_standard_potentials_agree_with_the_handbook():
    """``changes``: mol of each formula that a redox equation makes, negative where it uses them up.

    Its oxidant and its reductant are a couple each, such as MnO4-/Mn^2+; their standard potentials, from free energies,
    are those of the handbook within 25 mV.
    """
    for changes, oxidant_volt, reductant_volt in HANDBOOK:
        oxidant, reductant = couples_of(changes)
        assert [oxidant.volt, reductant.volt] == pytest.approx([oxidant_volt, reductant_volt], abs=0.025), changes


def test_couples_without_free_energies_are_not_invented():
    """``changes``: mol of each formula that an equation makes, negative where it uses them up; none has potentials.

    Acetate has no oxidant beside it, silver and chloride exchange no electron, and no table has vanadium's ions.
    """
    for case, changes in {
        "no oxidant": {"H+": -1.0, "CH3COO-": -1.0, "CO2(g)": 1.0},
        "no electrons": {"Ag+": -1.0, "Cl-": -1.0, "AgCl(s)": 1.0},
        "vanadium": {"VO2+": -1.0, "Fe^2+": -1.0, "VO^2+": 1.0, "Fe^3+": 1.0},
    }.items():  # fmt: skip
        assert couples_of(changes) is None, case


def test_permanganate_has_the_potential_of_phreeqc_before_and_after():
    """10 mL with 0.5 mmol of iron(II) and 5 mmol of acid take 5 mL of permanganate of 0.02 mol/L, a fifth of 0.5 mmol.

    The curve of the potential is within 20 mV of what PHREEQC computes for all that was added until then.
    """
    curve = curves({"FeSO4": 0.05, "H2SO4": 0.5}, {"KMnO4": 0.02}, PERMANGANATE)["redox potential"]
    assert curve.ends_ml == pytest.approx([5.0], abs=0.01) and curve.unit == "V against hydrogen"
    for added_ml in (0.5, 2.5, 4.5, 5.5, 8.0, 15.0):
        mmol = {"FeSO4": 0.5, "H2SO4": 5.0, "KMnO4": 0.02 * added_ml}
        molar = {name: amount / (10.0 + added_ml) for name, amount in mmol.items()}
        volt = np.interp(added_ml, curve.added_ml, curve.values)
        assert volt == pytest.approx(potential_by_phreeqc(molar), abs=0.02), added_ml


TRIIODIDE_LITRE_PER_MOL = 698.0
"""Constant of I2 + I- = I3-."""
IODINE_VOLT = 0.621
"""Standard potential of dissolved iodine, of HANDBOOK."""


def potential_of_iodine(iodine, iodide, activity_coefficient):
    """V by Nernst's law of so many mol/L of iodine and iodide, some of which are triiodide."""
    # triiodide = constant * (iodine - triiodide) * (iodide - triiodide)
    triiodide = min(np.roots([1.0, -(iodine + iodide + 1.0 / TRIIODIDE_LITRE_PER_MOL), iodine * iodide]))
    activity_of_iodide = activity_coefficient * (iodide - triiodide)
    return IODINE_VOLT + 0.5 * VOLT_PER_PE * np.log10((iodine - triiodide) / activity_of_iodide**2)


def test_iodine_has_its_potential_beside_triiodide():
    """Thiosulfate runs into 0.05 mol/L of iodine in 0.1 mol/L of iodide, whose activity coefficient is 0.8.

    At first the potential is that of iodine and iodide less their triiodide, by hand. In the end thiosulfate is in
    excess, whose couple has 0.08 V.
    """
    iodine, iodide = 0.05, 0.1
    equation = "I2 + 2 S2O32- -> 2 I- + S4O6^2-"
    curve = curves({"I2": iodine, "KI": iodide}, {"Na2S2O3": 0.1}, equation)["redox potential"]
    expected_volt = potential_of_iodine(iodine, iodide, activity_coefficient=0.8)
    assert curve.values[0] == pytest.approx(expected_volt, abs=0.005)
    assert curve.values[-1] < 0.15


def test_peroxide_in_iodide_has_the_potential_of_iodine():
    """10 mL with 0.5 mmol of iodide; half of it is iodine after 12.5 mL of peroxide of 0.01 mol/L, 0.125 mmol.

    By hand: 0.125 mmol of iodine beside 0.25 of iodide in 22.5 mL; iodide's activity coefficient is 0.75.
    """
    curve = curves({"KI": 0.05, "H2SO4": 0.5}, {"H2O2": 0.01}, "H2O2 + 2 I- + 2 H+ -> I2 + 2 H2O")["redox potential"]
    expected_volt = potential_of_iodine(iodine=0.125 / 22.5, iodide=0.25 / 22.5, activity_coefficient=0.75)
    assert np.interp(12.5, curve.added_ml, curve.values) == pytest.approx(expected_volt, abs=0.005)


def test_cerium_in_sulfuric_acid_has_amounts_and_no_potential():
    """Cerium(IV) of 0.05 mol/L runs into 10 mL with 0.05 mol/L of iron(II), 0.5 mmol: 10 mL of it are equivalent.

    Cerium's potential in sulfuric acid is not known, so there is no curve of a potential, only one of the iron(II) that
    is left after ``added_ml``: half after 5 mL, none from 10 mL on.
    """
    ((quantity, left),) = curves(
        {"FeSO4": 0.05, "H2SO4": 0.5}, {"Ce(SO4)2": 0.05}, "Ce4+ + Fe2+ -> Ce3+ + Fe3+"
    ).items()
    assert quantity == "mol of Fe^2+ left"
    left_mol = np.interp([0.0, 5.0, 11.0, 15.0], left.added_ml, left.values)
    assert left_mol == pytest.approx([5e-4, 2.5e-4, 0.0, 0.0], abs=2e-6)
    assert left.ends_ml == pytest.approx([10.0], abs=0.01)


def test_slow_oxidation_plots_the_remaining_reductant():
    """Permanganate oxidises iron(II) by 5 a second: an equation with a rate has no potential.

    Its couples are not at equilibrium, so the only curve is of the iron(II) that is left.
    """
    slow = curves({"FeSO4": 0.05, "H2SO4": 0.5}, {"KMnO4": 0.02}, PERMANGANATE, rate=5.0)
    assert set(slow) == {"mol of Fe^2+ left"}


def test_titration_with_silver_plots_pag():
    """10 mL of 0.05 mol/L chloride end at 5 mL of 0.1 mol/L silver nitrate; pAg is -log10 of the activity of Ag+.

    At the end point it is half of the silver chloride's log_k, 9.75; before, beside 0.05 mol/L of chloride, 9.75 less
    1.3; in the end, with 1.3 mmol of Ag+ in excess in 28 mL, 0.05 mol/L, about 1.3.
    """
    (curve,) = curves({"NaCl": 0.05}, {"AgNO3": 0.1}, "Ag+ + Cl- -> AgCl").values()
    assert curve.quantity == curve.unit == "pAg" and curve.ends_ml == pytest.approx([5.0], abs=0.01)
    half_of_log_k = 4.9
    assert np.interp(5.0, curve.added_ml, curve.values) == pytest.approx(half_of_log_k, abs=0.4)
    assert curve.values[0] > 8.0 and curve.values[-1] < 1.6


def test_titration_with_base_plots_ph():
    """Lye runs into hydrochloric acid, in which nothing is oxidised: the only curve is of the pH."""
    (curve,) = curves({"HCl": 0.05}, {"NaOH": 0.1}, "HCl + NaOH -> NaCl + H2O").values()
    assert curve.quantity == "pH"
