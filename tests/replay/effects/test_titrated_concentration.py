"""Concentrations that a titration gives, from the volume alone, and where it gives none."""

import pytest
from support.liquid_worlds import BURETTE_COLUMN, MIXING_IN_FLASK, effects_of_tap_degrees, glass

from replay.effects.chemistry.contents import Contents
from replay.effects.titrated_concentration import titrated_concentration

OPEN = [*([0.0] * 2), *([90.0] * 200), *([0.0] * 10)]
"""Degrees of the stopcock: some 2.5 mL run in."""

MOHR = {"formula": "(NH4)2Fe(SO4)2.6H2O", "mass_g": 0.0392}
IRON = "MnO4- + 5 Fe2+ + 8 H+ -> Mn2+ + 5 Fe3+ + 4 H2O"
IRON_BY_SALTS = "2 KMnO4 + 10 FeSO4 + 8 H2SO4 -> 2 MnSO4 + 5 Fe2(SO4)3 + K2SO4 + 8 H2O"
IODINE = "I2 + 2 S2O3^2- -> 2 I- + S4O6^2-"
ROWS = [
    ({"NaOH": 0.1}, {"HCl": 0.05}, None, "HCl + NaOH -> NaCl + H2O", ("HCl", 0.05)),
    ({"NaOH": 0.1}, {"H2SO4": 0.03}, None, "H2SO4 + 2 NaOH -> Na2SO4 + 2 H2O", ("H2SO4", 0.03)),
    ({"NaOH": 0.1}, {"CH3COOH": 0.05}, None, "CH3COOH + NaOH -> CH3COONa + H2O", ("CH3COOH", 0.05)),
    ({"Na2S2O3": 0.1}, {"I2": 0.001, "KI": 0.1}, None, IODINE, ("I2", 0.001)),
    ({"KMnO4": 0.02}, {"H2SO4": 1.0}, MOHR, IRON, ("KMnO4", 0.02)),
    ({"KMnO4": 0.02}, {"H2SO4": 1.0}, MOHR, IRON_BY_SALTS, ("KMnO4", 0.02)),
]


def end_points(burette, flask, solid, equation):
    """Events of the end points of a burette's liquid in 2 mL."""
    titrant = glass("burette", volume_ml=50.0, solutes=burette, cavity=BURETTE_COLUMN)
    sample = glass("flask", volume_ml=2.0, solutes=flask, properties={"solid": solid} if solid else {})
    return effects_of_tap_degrees(
        OPEN, MIXING_IN_FLASK, ("reaction", {"equation": equation}), burette=titrant, flask=sample
    )["reaction"].output.events_named("end-point")


@pytest.mark.parametrize(("burette", "flask", "solid", "equation", "expected"), ROWS, ids=lambda row: str(row)[:24])
def test_an_end_point_gives_the_concentration_that_was_sought(burette, flask, solid, equation, expected):
    """``expected``: the scene's own mol/L in the flask, or where 0.1 mmol of Mohr's salt is weighed, in the burette."""
    *_, event = end_points(burette, flask, solid, equation)
    formula, molar = expected
    assert event.values["formula"] == formula and event.values["mol_per_l"] == pytest.approx(molar, rel=0.01)
    assert f"{molar:g} mol/L" in event.text


def test_two_bases_give_no_single_concentration():
    """The last end point of lye and soda in one flask cannot say how much of each there was."""
    events = end_points({"HCl": 0.1}, {"NaOH": 0.03, "Na2CO3": 0.02}, solid=None, equation="HCl + NaOH -> NaCl + H2O")
    assert "mol_per_l" in events[0].values and "mol_per_l" not in events[-1].values


def test_no_titrated_concentration_without_a_whole_number_ratio():
    """20 mL of 0.05 mol/L acid take 10 mL of 0.1 mol/L base; 10.4 mL fit no ratio of small whole numbers."""
    contents = {
        "b": Contents(volume_ml=50.0, amounts={"NaOH": 5e-3}, solids={}, solubility={}),
        "f": Contents(volume_ml=20.0, amounts={"HCl": 1.0e-3}, solids={}, solubility={}),
    }
    assert titrated_concentration(contents, vessel="f", source="b", names=("HCl", "NaOH"), volume_ml=10.0)[1][
        "mol_per_l"
    ] == pytest.approx(0.05)
    assert titrated_concentration(contents, vessel="f", source="b", names=("HCl", "NaOH"), volume_ml=10.4) == ("", {})
    assert titrated_concentration(contents, vessel="f", source="elsewhere", names=("HCl", "NaOH"), volume_ml=10.0) == (
        "",
        {},
    )


def test_salt_with_an_ion_of_the_equation_is_titrated():
    """12.5 mL with 0.08 mol/L of barium end the 1 mmol of sodium sulfate in 20 mL, which is 0.05 mol/L.

    The equation names copper sulfate, whose sulfate it shares; of K2SO4 there is none, and KNO3 has no such ion.
    """
    flask = {"H2O": 1.1, "Na2SO4": 1e-3, "KNO3": 1e-3, "K2SO4": 0.0}
    contents = {
        "b": Contents(volume_ml=50.0, amounts={"BaCl2": 4e-3}, solids={}, solubility={}),
        "f": Contents(volume_ml=20.0, amounts=flask, solids={}, solubility={}),
    }
    text, values = titrated_concentration(contents, vessel="f", source="b", names=("BaCl2", "CuSO4"), volume_ml=12.5)
    assert values == {"formula": "Na2SO4", "mol_per_l": pytest.approx(0.05)} and "Na2SO4 had 0.05 mol/L" in text


@pytest.mark.parametrize(("titrant_ml", "volume_ml"), [(0.0, 10.0), (50.0, 0.0)])
def test_nothing_that_ran_in_gives_no_concentration(titrant_ml, volume_ml):
    """An empty burette, and an end point at 0 mL."""
    contents = {
        "b": Contents(volume_ml=titrant_ml, amounts={"NaOH": 5e-3}, solids={}, solubility={}),
        "f": Contents(volume_ml=20.0, amounts={"HCl": 1e-3}, solids={}, solubility={}),
    }
    assert titrated_concentration(contents, vessel="f", source="b", names=("HCl", "NaOH"), volume_ml=volume_ml) == (
        "",
        {},
    )
