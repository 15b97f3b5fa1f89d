"""End points of mixtures, and the reagents that are equivalent there."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from support.liquid_worlds import glass

from replay.effects.chemistry.contents import contents_of_scene
from replay.effects.chemistry.formulas import molar_mass
from replay.effects.chemistry.ledger_columns import UNFOLLOWED_WARMTH
from replay.effects.chemistry.matter import Matter
from replay.effects.chemistry.recipe import recipe_of
from replay.effects.effect_plan import plan
from replay.effects.end_points import end_points
from sessions.model.scene import Scene, SceneEffect

MIXTURES = tomllib.loads(Path(__file__).with_name("chemistry").joinpath("mixtures.toml").read_text("utf-8"))["mixture"]
WITHOUT_TITRATION = ("hydrolysis", "metals", "solids", "copper", "complexes")
"""Families in which nothing is titrated."""

STEPS = 20


def end_point_texts(a, b, equation, steps=STEPS):
    """Texts of the end points while a is poured into b in so many steps."""
    scene = Scene(
        bodies=(glass("a", cavity={"radius": 0.05, "height": 0.08}, **a), glass("b", cavity={"radius": 0.05}, **b)),
        effects=(
            SceneEffect("pour", {"from": ["a"], "into": ["b"]}),
            SceneEffect("mixing", {"in": ["b"]}),
            SceneEffect("reaction", {"equation": equation}),
        ),
    )
    contents = contents_of_scene(scene, "scene.toml")
    recipe = recipe_of({kind: step.declared for kind, step in plan(scene).steps.items()}, contents)
    book = recipe.ledger(0.0, UNFOLLOWED_WARMTH)
    book.begin(0.0)
    frames = np.arange(1, 1 + steps)
    volumes = np.full((steps, 1), contents["a"].volume_ml / steps)
    book.flow(frames, 0.1 * frames, [("a", "b")], volumes, np.zeros(1, dtype=bool))
    book.end(steps + 100, 0.1 * (steps + 100))
    matter = Matter(recipe, book, {}, {name: book.history(name) for name in book.vessels})
    return [event.text for event in end_points(matter, "b")]


def glass_arguments(row, name):
    """Arguments of a glass that holds what a row of the table says."""
    content = row.get(name, {})
    liquid = {"volume_ml": content.get("ml", 0.0), **({"solutes": content["solutes"]} if "solutes" in content else {})}
    if "solid" in content:
        grams = content["moles"] * molar_mass(content["solid"])
        liquid["properties"] = {"solid": {"formula": content["solid"], "mass_g": grams}}
    return liquid


@pytest.mark.sampled(4)
@pytest.mark.parametrize(
    "row",
    [
        row
        for row in MIXTURES
        if row["family"] in WITHOUT_TITRATION and len(row["equations"]) == 1 and "rate_per_s" not in row
    ],
    ids=lambda row: row["name"],
)
def test_nothing_is_equivalent_where_nothing_is_titrated(row):
    """``row``: of mixtures.toml, a glass a that is poured into b in 20 steps, and an equation between what they hold.

    It is of hydrolysis, metals, solids, copper or complexes, in which nothing is titrated: no end point is reported.
    """
    assert end_point_texts(glass_arguments(row, "a"), glass_arguments(row, "b"), row["equations"][0]) == []


def test_aluminium_in_alkali_has_no_end_point():
    """10 mmol of lye are poured on 54 mg of aluminium, 2 mmol: a metal that dissolves in a base is no titration."""
    metal = {"volume_ml": 0.0, "properties": {"solid": {"formula": "Al", "mass_g": 0.054}}}
    alkali = {"volume_ml": 50.0, "solutes": {"NaOH": 0.2}}
    assert end_point_texts(alkali, metal, "2 Al + 2 NaOH + 6 H2O -> 2 NaAl(OH)4 + 3 H2") == []


@pytest.mark.sampled(5)
@pytest.mark.parametrize(
    ("a", "b", "equation", "names"),
    [
        ({"NaOH": 0.1}, {"CH3COOH": 0.05}, "CH3COOH + NaOH -> CH3COONa + H2O", "CH3COOH and NaOH"),
        ({"KMnO4": 0.02}, {"FeSO4": 0.05, "H2SO4": 1.0}, "MnO4- + 5 Fe2+ + 8 H+ -> Mn2+ + 5 Fe3+ + 4 H2O",
         "Fe^2+ and MnO4-"),
        ({"K2Cr2O7": 0.01}, {"FeSO4": 0.03, "H2SO4": 1.0},
         "Cr2O7^2- + 6 Fe^2+ + 14 H+ -> 2 Cr^3+ + 6 Fe^3+ + 7 H2O", "Cr2O7^2- and Fe^2+"),
        ({"Na2S2O3": 0.1}, {"KI": 0.1, "I2": 0.025}, "I2 + 2 S2O3^2- -> 2 I- + S4O6^2-", "I2 and S2O3^2-"),
        ({"KI": 0.2}, {"CuSO4": 0.05}, "2 Cu2+ + 4 I- -> 2 CuI + I2", "Cu^2+ and I-"),
    ],
    ids=["acetic acid", "permanganate", "dichromate", "iodine", "copper"],
)  # fmt: skip
def test_an_end_point_names_its_two_reagents(a, b, equation, names):
    """50 mL of a are poured into 50 mL of b, both in mol/L, chosen so that half of a is equivalent to b."""
    (text,) = end_point_texts({"volume_ml": 50.0, "solutes": a}, {"volume_ml": 50.0, "solutes": b}, equation)
    assert text.startswith(f"{names} are equivalent in b after 25.00 mL")


def test_splash_that_frees_gas_states_only_between_which_volumes():
    """75 mL of acid in 3 steps of 25 mL; 50 mL of 1 mol/L are equivalent to 50 mL of soda, 0.5 mol/L, 2 to 1.

    CO2 leaves after each step and takes its carbonate along, so that no volume between two steps can be named.
    """
    acid, soda = {"volume_ml": 75.0, "solutes": {"HCl": 1.0}}, {"volume_ml": 50.0, "solutes": {"Na2CO3": 0.5}}
    texts = end_point_texts(acid, soda, "Na2CO3 + 2 HCl -> 2 NaCl + H2O + CO2", steps=3)
    assert texts
    assert all("somewhere between" in text and "which came at once" in text for text in texts)
