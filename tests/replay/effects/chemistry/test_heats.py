"""Heats of a first-year laboratory against textbooks, and temperatures that stay between freezing and boiling."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from support.liquid_worlds import glass

from replay.effects.chemistry.contents import contents_of_scene
from replay.effects.chemistry.formulas import molar_mass
from replay.effects.chemistry.ledger import HEAT, LATENT, Warmth
from replay.effects.chemistry.recipe import recipe_of
from replay.effects.effect_plan import plan
from sessions.model.scene import Scene, SceneEffect

HEATS = tomllib.loads(Path(__file__).with_name("textbook_heats.toml").read_text("utf-8"))["heat"]
LARGE = {"radius": 0.05, "height": 0.08}
PER_ML = 4.18


def poured_on(a, b, equation, steps=20, **heat):
    """Joule above the room, the coldest and the warmest in degC of b while a is poured on it in so many steps."""
    bodies = (glass("a", cavity=LARGE, **a), glass("b", cavity=LARGE, **b))
    liquids = {"of": "liquids", "ambient_c": 20.0, "loss_w_per_k": 0.0, "heat_capacity_j_per_ml_k": PER_ML}
    effects = (
        SceneEffect("pour", {"from": ["a"], "into": ["b"]}),
        SceneEffect("mixing", {"in": ["b"]}),
        *([SceneEffect("reaction", {"equation": equation})] if equation else []),
        SceneEffect("heat", liquids),
    )
    scene = Scene(bodies=bodies, effects=effects)
    tables = {kind: step.declared for kind, step in plan(scene).steps.items()}
    contents = contents_of_scene(scene, "scene.toml")
    book = recipe_of(tables, contents).ledger(0.0, Warmth(PER_ML, {}, {}, 0.0, 80.0, room=20.0, **heat))
    book.begin(0.0)
    index, celsius = book.at["b"], []
    for step in range(1, steps + 1):
        volume = np.array([[contents["a"].volume_ml / steps]])
        book.flow(np.array([step]), np.array([0.1 * step]), [("a", "b")], volume, np.zeros(1, dtype=bool))
        celsius.append(float(book.celsius(index, book.state[index : index + 1])[0]))
    joule = book.amounts[index, book.column[HEAT]] + book.amounts[index, book.column[LATENT]]
    return float(joule), min(celsius), max(celsius)


@pytest.mark.parametrize("row", HEATS, ids=lambda row: row["equation"])
def test_a_heat_is_that_of_the_textbook(row):
    solid = row["b"].get("solid")
    moles = row["b"].get("moles", row.get("moles"))
    a = {"volume_ml": 100.0 if solid else 50.0, **({"solutes": row["a"]} if "a" in row else {})}
    b = {"volume_ml": 0.0 if solid else 50.0, **({"solutes": row["b"]["solutes"]} if "solutes" in row["b"] else {})}
    if solid:
        b["properties"] = {"solid": {"formula": solid, "mass_g": moles * molar_mass(solid)}}
    joule, coldest, warmest = poured_on(a, b, row["equation"])
    assert -joule / moles / 1e3 == pytest.approx(row["kj"], rel=0.03)
    assert coldest >= -21.1 and warmest <= 100.0


@pytest.mark.parametrize(
    "row",
    [row for row in HEATS if row["equation"].startswith(f"{row['b'].get('solid')}(s)")],
    ids=lambda row: row["b"]["solid"],
)
def test_a_solid_dissolves_with_its_heat_without_an_equation(row):
    """Ammonium and hydroxide too, whose protons PHREEQC places: NH4Cl once took 67 kJ/mol, NaOH gave 100."""
    formula, moles = row["b"]["solid"], row["b"].get("moles", row.get("moles"))
    solid = {"properties": {"solid": {"formula": formula, "mass_g": moles * molar_mass(formula)}}, "volume_ml": 0.0}
    joule, *_ = poured_on({"volume_ml": 100.0}, solid, None)
    assert -joule / moles / 1e3 == pytest.approx(row["kj"], rel=0.03)


@pytest.mark.parametrize("steps", [1, 10, 100])
def test_water_on_nitre_cools_by_its_heat_of_dissolving(steps):
    """100 mL on 10.1 g: 0.1 mol takes 35.4 kJ/mol; it once ended at -2441 degC."""
    nitre = {"properties": {"solid": {"formula": "KNO3", "mass_g": 10.1}}, "volume_ml": 0.0}
    joule, coldest, _ = poured_on({"volume_ml": 100.0}, nitre, "KNO3(s) -> K+ + NO3-", steps)
    assert 20.0 + joule / (PER_ML * 100.0) == pytest.approx(20.0 - 0.0999 * 35.4e3 / 418.0, abs=0.1)
    assert coldest > -5.0
