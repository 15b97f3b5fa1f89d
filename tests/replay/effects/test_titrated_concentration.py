"""Concentrations that a titration gives, from the volume alone, and where it gives none."""

import pytest
from support.liquid_worlds import BURETTE_COLUMN, MIXING_IN_FLASK, effects_of_tap_degrees, glass

from replay.effects.chemistry.contents import Contents
from replay.effects.titrated_concentration import titrated_concentration

OPEN = [*([0.0] * 2), *([90.0] * 50), *([0.0] * 3)]
"""Degrees of the stopcock, one a frame of 40 ms: some 2.5 mL run in."""

MOHRS_SALT = {"formula": "(NH4)2Fe(SO4)2.6H2O", "mass_g": 0.0392}
"""0.1 mmol."""
IRON = "MnO4- + 5 Fe2+ + 8 H+ -> Mn2+ + 5 Fe3+ + 4 H2O"
IRON_BY_SALTS = "2 KMnO4 + 10 FeSO4 + 8 H2SO4 -> 2 MnSO4 + 5 Fe2(SO4)3 + K2SO4 + 8 H2O"
IODINE = "I2 + 2 S2O3^2- -> 2 I- + S4O6^2-"
ROWS = [
    ({"NaOH": 0.1}, {"HCl": 0.05}, None, "HCl + NaOH -> NaCl + H2O", "HCl", 0.05),
    ({"NaOH": 0.1}, {"H2SO4": 0.03}, None, "H2SO4 + 2 NaOH -> Na2SO4 + 2 H2O", "H2SO4", 0.03),
    ({"NaOH": 0.1}, {"CH3COOH": 0.05}, None, "CH3COOH + NaOH -> CH3COONa + H2O", "CH3COOH", 0.05),
    ({"Na2S2O3": 0.1}, {"I2": 0.001, "KI": 0.1}, None, IODINE, "I2", 0.001),
    ({"KMnO4": 0.02}, {"H2SO4": 1.0}, MOHRS_SALT, IRON, "KMnO4", 0.02),
    ({"KMnO4": 0.02}, {"H2SO4": 1.0}, MOHRS_SALT, IRON_BY_SALTS, "KMnO4", 0.02),
]


def end_points(burette, flask, solid, equation):
    """Events of the end points of a burette's liquid in 2 mL."""
    titrant = glass("burette", volume_ml=50.0, solutes=burette, cavity=BURETTE_COLUMN)
    sample = glass("flask", volume_ml=2.0, solutes=flask, properties={"solid": solid} if solid else {})
    return effects_of_tap_degrees(
        OPEN,
        MIXING_IN_FLASK,
        ("reaction", {"equation": equation}),
        burette=titrant,
        flask=sample,
        step_ns=40_000_000,
    )["reaction"].output.events_named("end-point")


@pytest.mark.parametrize(
    ("burette", "flask", "solid", "equation", "formula", "molar"),
    ROWS,
    ids=["HCl", "H2SO4", "CH3COOH", "I2", "Mohr's salt by ions", "Mohr's salt by salts"],
)
def test_an_end_point_gives_the_concentration_that_was_sought(burette, flask, solid, equation, formula, molar):
    """A burette's liquid runs into 2 mL in the flask, both in mol/L; ``molar`` is the scene's own of ``formula``.

    Sought is what is in the flask, or, where 0.1 mmol of Mohr's salt is weighed into it, what is in the burette.
    """
    *_, event = end_points(burette, flask, solid, equation)
    assert event.values["formula"] == formula and event.values["mol_per_l"] == pytest.approx(molar, rel=0.01)
    assert f"{molar:g} mol/L" in event.text


def test_two_bases_give_no_single_concentration():
    """Acid runs into lye and soda; the first end point gives a concentration.

    The last, of both together, cannot say how much of each there was.
    """
    first, *_, last = end_points(
        burette={"HCl": 0.1}, flask={"NaOH": 0.03, "Na2CO3": 0.02}, solid=None, equation="HCl + NaOH -> NaCl + H2O"
    )
    assert "mol_per_l" in first.values
    assert "mol_per_l" not in last.values


def titrated_acid(volume_ml, source="burette", burette_ml=50.0, base_mol=5e-3):
    """Text and values of the concentration of 1 mmol of HCl in 20 mL after so many mL of NaOH from ``source``."""
    contents = {
        "burette": Contents(volume_ml=burette_ml, amounts={"NaOH": base_mol}, solids={}, solubility={}),
        "flask": Contents(volume_ml=20.0, amounts={"HCl": 1e-3}, solids={}, solubility={}),
    }
    return titrated_concentration(contents, vessel="flask", source=source, names=("HCl", "NaOH"), volume_ml=volume_ml)


def test_no_titrated_concentration_without_a_whole_number_ratio():
    """20 mL of 0.05 mol/L acid take 10 mL of 0.1 mol/L base; 10.4 mL fit no ratio of whole numbers up to 10."""
    text, values = titrated_acid(volume_ml=10.0)
    assert values["mol_per_l"] == pytest.approx(0.05) and "HCl had 0.05 mol/L" in text
    text, values = titrated_acid(volume_ml=10.4)
    assert (text, values) == ("", {})


def test_nothing_that_ran_in_gives_no_concentration():
    """A flask with 1 mmol of acid has an end point after ``volume_ml`` mL of base from ``source``.

    No base can have run in where that is no vessel, where the burette is empty, or after 0 mL: no text and no values.
    """
    for case, arguments in {
        "unknown vessel": {"volume_ml": 10.0, "source": "a vessel that is not there"},
        "empty burette": {"volume_ml": 10.0, "burette_ml": 0.0, "base_mol": 0.0},
        "end point at 0 mL": {"volume_ml": 0.0},
    }.items():
        text, values = titrated_acid(**arguments)
        assert (text, values) == ("", {}), case


def test_salt_with_an_ion_of_the_equation_is_titrated():
    """12.5 mL with 4 mmol of barium in 50 mL bring the 1 mmol that ends the sodium sulfate in 20 mL: 0.05 mol/L.

    The equation names copper sulfate, whose sulfate it shares; of K2SO4 there is none, and KNO3 has no such ion.
    """
    sample = {"H2O": 1.1, "Na2SO4": 1e-3, "KNO3": 1e-3, "K2SO4": 0.0}
    contents = {
        "burette": Contents(volume_ml=50.0, amounts={"BaCl2": 4e-3}, solids={}, solubility={}),
        "flask": Contents(volume_ml=20.0, amounts=sample, solids={}, solubility={}),
    }
    text, values = titrated_concentration(
        contents, vessel="flask", source="burette", names=("BaCl2", "CuSO4"), volume_ml=12.5
    )
    assert values == {"formula": "Na2SO4", "mol_per_l": pytest.approx(0.05)} and "Na2SO4 had 0.05 mol/L" in text
