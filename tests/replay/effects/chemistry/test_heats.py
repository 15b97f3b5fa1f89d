"""Heats of a first-year laboratory against textbooks, and temperatures that stay between freezing and boiling."""

import tomllib
from pathlib import Path

import pytest
from support.liquid_worlds import heat_of_pouring

from replay.effects.chemistry.formulas import molar_mass

HEATS = tomllib.loads(Path(__file__).with_name("textbook_heats.toml").read_text("utf-8"))["heat"]


@pytest.mark.sampled(4)
@pytest.mark.parametrize("row", HEATS, ids=lambda row: row["equation"])
def test_a_heat_is_that_of_the_textbook(row):
    """Glass a is poured into b, in three steps: 50 mL of a solution into 50 mL of another, or 100 mL on a solid.

    ``row``: an equation, its kJ for a mol by a textbook, below 0 where the mixture warms, and what is in a and b. The
    heat is right within 3 %; b stays between the lowest freezing point of brine, -21.1 degC, and boiling.
    """
    poured, receiver = row.get("a", {}), row["b"]
    moles = receiver.get("moles", row.get("moles"))
    if "solid" in receiver:
        grams = moles * molar_mass(receiver["solid"])
        a = {"volume_ml": 100.0, "solutes": poured}
        b = {"volume_ml": 0.0, "properties": {"solid": {"formula": receiver["solid"], "mass_g": grams}}}
    else:
        a = {"volume_ml": 50.0, "solutes": poured}
        b = {"volume_ml": 50.0, "solutes": receiver.get("solutes", {})}
    joule, coldest_c, warmest_c = heat_of_pouring(a, b, row["equation"], steps=3)
    assert -joule / moles / 1e3 == pytest.approx(row["kj"], rel=0.03)
    assert coldest_c >= -21.1 and warmest_c <= 100.0


@pytest.mark.sampled(10)
@pytest.mark.parametrize(
    "row",
    [row for row in HEATS if row["equation"].startswith(f"{row['b'].get('solid')}(s)")],
    ids=lambda row: row["b"]["solid"],
)
def test_dissolving_solid_has_its_tabled_heat_without_an_equation(row):
    """100 mL of water are poured on a solid, in three steps; the scene has no equation by which it dissolves.

    ``row``: the solid, its moles, and the kJ/mol of the literature, below 0 where the water warms. The heat that the
    water gets is that within 3 %.
    """
    formula, moles = row["b"]["solid"], row["b"].get("moles", row.get("moles"))
    solid = {"properties": {"solid": {"formula": formula, "mass_g": moles * molar_mass(formula)}}, "volume_ml": 0.0}
    joule, _coldest_c, _warmest_c = heat_of_pouring({"volume_ml": 100.0}, solid, equation=None, steps=3)
    assert -joule / moles / 1e3 == pytest.approx(row["kj"], rel=0.03)


@pytest.mark.parametrize("steps", [1, 10])
def test_water_poured_on_potassium_nitrate_cools_by_its_heat(steps):
    """100 mL of water, 418 J/K, are poured in so many steps on 10.1 g, 0.0999 mol, which take 35.4 kJ/mol.

    That is 8.5 K; the first drop, on all of the salt, is not colder than -5 degC.
    """
    nitre = {"properties": {"solid": {"formula": "KNO3", "mass_g": 10.1}}, "volume_ml": 0.0}
    joule, coldest_c, _warmest_c = heat_of_pouring({"volume_ml": 100.0}, nitre, "KNO3(s) -> K+ + NO3-", steps=steps)
    water_j_per_k = 4.18 * 100.0
    assert joule / water_j_per_k == pytest.approx(-0.0999 * 35.4e3 / water_j_per_k, abs=0.1)
    assert coldest_c > -5.0
