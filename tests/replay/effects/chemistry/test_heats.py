"""Heats of a first-year laboratory against textbooks, and temperatures that stay between freezing and boiling."""

import tomllib
from pathlib import Path

import pytest
from support.liquid_worlds import heat_of_pouring

from replay.effects.chemistry.formulas import molar_mass

HEATS = tomllib.loads(Path(__file__).with_name("textbook_heats.toml").read_text("utf-8"))["heat"]
PER_ML = 4.18


@pytest.mark.sampled(2)
@pytest.mark.parametrize("row", HEATS, ids=lambda row: row["equation"])
def test_a_heat_is_that_of_the_textbook(row):
    """To 3 %; temperatures stay between the lowest freezing point of brine, -21.1 degC, and boiling.

    A row has an equation, kJ per mol, and what is in both vessels: 50 mL of a solution each, or 100 mL on a solid.
    """
    solid = row["b"].get("solid")
    moles = row["b"].get("moles", row.get("moles"))
    a = {"volume_ml": 100.0 if solid else 50.0, **({"solutes": row["a"]} if "a" in row else {})}
    b = {"volume_ml": 0.0 if solid else 50.0, **({"solutes": row["b"]["solutes"]} if "solutes" in row["b"] else {})}
    if solid:
        b["properties"] = {"solid": {"formula": solid, "mass_g": moles * molar_mass(solid)}}
    joule, coldest, warmest = heat_of_pouring(a, b, row["equation"], steps=5)
    assert -joule / moles / 1e3 == pytest.approx(row["kj"], rel=0.03)
    assert coldest >= -21.1 and warmest <= 100.0


@pytest.mark.sampled(10)
@pytest.mark.parametrize(
    "row",
    [row for row in HEATS if row["equation"].startswith(f"{row['b'].get('solid')}(s)")],
    ids=lambda row: row["b"]["solid"],
)
def test_dissolving_solid_has_its_tabled_heat_without_an_equation(row):
    """Each row of HEATS is a solid, its moles in 100 mL of water and the kJ/mol of the literature."""
    formula, moles = row["b"]["solid"], row["b"].get("moles", row.get("moles"))
    solid = {"properties": {"solid": {"formula": formula, "mass_g": moles * molar_mass(formula)}}, "volume_ml": 0.0}
    joule, *_ = heat_of_pouring({"volume_ml": 100.0}, solid, equation=None, steps=5)
    assert -joule / moles / 1e3 == pytest.approx(row["kj"], rel=0.03)


@pytest.mark.parametrize("steps", [1, 10])
def test_water_poured_on_potassium_nitrate_cools_by_its_heat(steps):
    """10.1 g are 0.0999 mol and take 35.4 kJ/mol; 100 mL of water have 418 J/K."""
    nitre = {"properties": {"solid": {"formula": "KNO3", "mass_g": 10.1}}, "volume_ml": 0.0}
    joule, coldest, _ = heat_of_pouring({"volume_ml": 100.0}, nitre, "KNO3(s) -> K+ + NO3-", steps=steps)
    assert 20.0 + joule / (PER_ML * 100.0) == pytest.approx(20.0 - 0.0999 * 35.4e3 / 418.0, abs=0.1)
    assert coldest > -5.0
