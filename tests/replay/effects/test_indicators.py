"""The ten indicators by name: seven by the pH, three by an ion, each against its range and an equivalence."""

import numpy as np
import pytest
from support.liquid_worlds import BURETTE_COLUMN, MIXING_IN_FLASK, effects_of_tap_degrees, glass

from replay.effects.colour_tables import INDICATORS, coloured_species

OPEN = [*([0.0] * 2), *([90.0] * 54), *([0.0] * 4)]
"""Degrees of the stopcock, one a frame of a thirtieth of a second: some 2 mL run in."""

BY_PH = {
    "phenolphthalein": (8.2, 10.0, "colourless", "pink"),
    "methyl orange": (3.1, 4.4, "red", "yellow"),
    "bromothymol blue": (6.0, 7.6, "yellow", "blue"),
    "litmus": (5.0, 8.0, "red", "blue"),
    "methyl red": (4.4, 6.2, "red", "yellow"),
    "thymol blue": (8.0, 9.6, "yellow", "blue"),
    "bromocresol green": (3.8, 5.4, "yellow", "blue"),
}
"""Name -> pH range and colours. Source: Harris, Quantitative Chemical Analysis, 8th ed., table 10-3."""


def titrated(solutes, titrant, indicator, *effects, hz=30):
    """Effects of a titrant that runs into 2 mL of a solution with an indicator; both: solute -> mol/L."""
    flask = glass("flask", volume_ml=2.0, solutes=solutes)
    burette = glass("burette", volume_ml=50.0, solutes=titrant, cavity=BURETTE_COLUMN)
    display = ("colour", {"in": "flask", "indicator": indicator})
    return effects_of_tap_degrees(
        OPEN, MIXING_IN_FLASK, *effects, display, burette=burette, flask=flask, step_ns=10**9 // hz
    )


def test_ten_indicators_have_a_name():
    """Seven change by the pH; Eriochrome black T, starch and ferroin by an ion."""
    assert set(INDICATORS) == {*BY_PH, "Eriochrome black T", "starch", "ferroin"}


@pytest.mark.sampled(7)
@pytest.mark.parametrize("name", BY_PH)
def test_a_ph_indicator_changes_within_its_range(name):
    """Some 2 mL of lye, 0.4 mmol, run into 0.1 mmol of phosphoric acid, which has 0.3 mmol of protons.

    So the pH only rises, through the ranges of all indicators. The event begins with the first row of the pH within the
    indicator's range, and ends with the first that is not below its upper end; the indicator turns from its acid colour
    to the other.
    """
    neutralisation = ("reaction", {"equation": "H3PO4 + 3 NaOH -> Na3PO4 + 3 H2O"})
    effects = titrated({"H3PO4": 0.05}, {"NaOH": 0.2}, name, neutralisation)
    (event,) = effects["colour"].events
    ph = effects["reaction"].series["flask/pH"]
    start, end, acid_colour, base_colour = BY_PH[name]
    before, after = ph.values[ph.times < event.time], ph.values[ph.times > event.end]
    assert before.max() <= start < end <= after.min()
    assert event.text == f"{name} in flask turns from {acid_colour} to {base_colour}"
    assert event.values["to"] == base_colour


EDTA = ("reaction", {"equation": "Mg^2+ + C10H12N2O8^4- -> MgC10H12N2O8^2-"})
IODINE = ("reaction", {"equation": "I2 + 2 S2O3^2- -> 2 I- + S4O6^2-"})
CERIUM = ("reaction", {"equation": "Fe^2+ + Ce^4+ -> Fe^3+ + Ce^3+"})
PERMANGANATE = ("reaction", {"equation": "MnO4- + 5 Fe2+ + 8 H+ -> Mn2+ + 5 Fe3+ + 4 H2O"})


@pytest.mark.sampled(4)
@pytest.mark.parametrize(
    ("name", "solutes", "titrant", "reaction", "change"),
    [
        # A Mg2+ takes an EDTA, an I2 two thiosulfates, an Fe2+ a Ce4+ or a fifth of a permanganate.
        ("Eriochrome black T", {"MgCl2": 0.01, "NH3": 0.2, "NH4Cl": 0.04}, {"Na4C10H12N2O8": 0.02}, EDTA,
         "red to blue"),
        ("starch", {"I2": 1e-3, "KI": 0.1}, {"Na2S2O3": 4e-3}, IODINE, "blue to colourless"),
        ("ferroin", {"FeSO4": 0.05, "H2SO4": 1.0}, {"Ce(SO4)2": 0.1, "H2SO4": 1.0}, CERIUM, "red to blue"),
        ("ferroin", {"FeSO4": 0.05, "H2SO4": 1.0}, {"KMnO4": 0.02}, PERMANGANATE, "red to blue"),
    ],
    ids=["magnesium with EDTA", "iodine with thiosulfate", "iron with cerium", "iron with permanganate"],
)  # fmt: skip
def test_an_ion_indicator_changes_at_the_equivalence(name, solutes, titrant, reaction, change):
    """2 mL of ``solutes`` are titrated with ``titrant``, both in mol/L, chosen so that 1 mL is equivalent."""
    flask_ml, equivalent_ml = 2.0, 1.0
    effects = titrated(solutes, titrant, name, reaction)
    (event,) = effects["colour"].events
    assert event.text == f"{name} in flask turns from {change}"
    volume = effects["mixing"].series["flask/volume"]
    changed_s = event.time if event.end is None else event.end  # a change within one frame has no end
    added_ml = float(np.interp(changed_s, volume.times, volume.values)) - flask_ml
    less_than_two_drops_ml = 0.08
    assert added_ml == pytest.approx(equivalent_ml, abs=less_than_two_drops_ml)


# Source of what a salt brings: its name in IUPAC's Nomenclature of Inorganic Chemistry, 2005.
SPECIES = {
    "KMnO4": "MnO4-", "K2CrO4": "CrO4^2-", "(NH4)2Cr2O7": "Cr2O7^2-", "CuSO4.5H2O": "Cu^2+",
    "Cu(NH3)4SO4": "Cu(NH3)4^2+", "[Cu(NH3)4(H2O)2]2+": "Cu(NH3)4^2+", "[Fe(SCN)(H2O)5]2+": "FeSCN^2+",
    "(NH4)2Fe(SO4)2.6H2O": "Fe^2+", "K3[Fe(CN)6]": "Fe(CN)6^3-", "I2": "I2",
}  # fmt: skip


def test_a_salt_has_the_colour_of_its_ion():
    """SPECIES, written by hand, has the coloured ion of each formula, or of iodine the molecule itself."""
    assert {formula: coloured_species(formula) for formula in SPECIES} == SPECIES
