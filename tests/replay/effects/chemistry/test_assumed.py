"""Gaps in the data are reported: solids without a constant, iodine beyond its solubility, end points of ions."""

import pytest
from support.liquid_worlds import COLUMN, MIX, glass, run_in

OPEN = [*([0.0] * 2), *([90.0] * 200), *([0.0] * 10)]
"""Degrees of the stopcock: some 2.5 mL run in."""

PRUSSIAN = "4 FeCl3 + 3 K4Fe(CN)6 -> Fe4(Fe(CN)6)3 + 12 KCl"
PEROXIDE = "H2O2 + 2 I- + 2 H+ -> I2 + 2 H2O"


def reaction(burette, flask, equation):
    """Output of the reaction of a burette's liquid that runs into 2 mL."""
    titrant = glass("burette", 50.0, solutes=burette, cavity=COLUMN)
    sample = glass("flask", 2.0, solutes=flask)
    return run_in(OPEN, MIX, ("reaction", {"equation": equation}), base=titrant, acid=sample)["reaction"].output


@pytest.mark.parametrize(
    ("burette", "flask", "equation", "solid"),
    [
        ({"KCl": 1.0}, {"C4H6O6": 0.5}, "C4H6O6 + KCl -> KHC4H4O6(s) + HCl", "KHC4H4O6"),
        ({"FeCl3": 0.1}, {"K4Fe(CN)6": 0.05}, PRUSSIAN, "Fe4(Fe(CN)6)3"),
    ],
)
def test_a_solid_without_a_constant_is_named(burette, flask, equation, solid):
    (event,) = reaction(burette, flask, equation).events_named("assumed")
    assert event.text.startswith(f"no data know how much {solid} dissolves") and event.time > 0.0


@pytest.mark.parametrize(("iodide", "told"), [(0.01, True), (0.5, False)])
def test_iodine_beyond_its_solubility_is_reported(iodide, told):
    """Much iodide dissolves iodine as triiodide, so with 0.5 mol/L nothing is beyond."""
    output = reaction({"H2O2": 0.1}, {"KI": iodide, "H2SO4": 0.2}, PEROXIDE)
    assert bool(output.events_named("beyond")) == told


def test_a_known_solid_assumes_nothing():
    silver = reaction({"AgNO3": 0.1}, {"NaCl": 0.05}, "AgNO3 + NaCl -> AgCl + NaNO3")
    assert not silver.events_named("assumed") and not silver.events_named("beyond")


# Edta is brought as its disodium salt in a buffer of ammonia; the other two are a Fajans and a sulfate titration.
@pytest.mark.parametrize(
    ("burette", "flask", "equation", "formula", "molar"),
    [
        ({"AgNO3": 0.1}, {"NaCl": 0.05}, "AgNO3 + NaCl -> AgCl + NaNO3", "NaCl", 0.05),
        ({"BaCl2": 0.1}, {"Na2SO4": 0.05}, "BaCl2 + Na2SO4 -> BaSO4 + 2 NaCl", "Na2SO4", 0.05),
        (
            {"C10H14N2Na2O8": 0.01}, {"CaCl2": 0.005, "NH3": 0.2, "NH4Cl": 0.02},
            "Ca2+ + C10H12N2O8^4- -> CaC10H12N2O8^2-", "CaCl2", 0.005,
        ),
    ],
)  # fmt: skip
def test_ions_of_a_solid_or_complex_have_an_end_point(burette, flask, equation, formula, molar):
    (event,) = reaction(burette, flask, equation).events_named("end-point")
    assert event.values["formula"] == formula and event.values["mol_per_l"] == pytest.approx(molar, rel=0.01)


def test_a_weak_complex_has_no_end_point():
    assert not reaction({"FeCl3": 0.1}, {"KSCN": 0.05, "HCl": 0.5}, "Fe3+ + SCN- -> FeSCN^2+").events_named("end-point")


@pytest.mark.parametrize(
    ("metal", "anion", "equation", "has_doubt"),
    [
        ({"ZnSO4": 0.1}, {"Na2C2O4": 0.05}, "Zn2+ + C2O4^2- -> ZnC2O4", True),
        ({"MgCl2": 0.1}, {"Na2SO4": 0.05}, "Mg2+ + SO4^2- -> MgSO4", False),
    ],
)
def test_a_salt_known_as_complex_alone_is_doubted(metal, anion, equation, has_doubt):
    """Zinc oxalate falls out (solubility product 1.4e-9, CRC Handbook); magnesium sulfate is in the tables."""
    events = reaction(metal, anion, equation).events_named("assumed")
    assert [event.values["formula"] for event in events] == ["ZnC2O4"] * has_doubt
