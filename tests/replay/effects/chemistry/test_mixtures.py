"""Families of first-year mixtures against PHREEQC's own minteq.v4 and against the amounts of a laboratory manual."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from support.liquid_worlds import glass

from replay.effects.chemistry.contents import contents_of_scene
from replay.effects.chemistry.formulas import ion_of, molar_mass
from replay.effects.chemistry.ledger import UNFOLLOWED
from replay.effects.chemistry.recipe import recipe_of
from replay.effects.effect_plan import plan
from sessions.model.scene import Scene, SceneEffect

MIXTURES = tomllib.loads(Path(__file__).with_name("mixtures.toml").read_text("utf-8"))["mixture"]
LARGE = {"radius": 0.05, "height": 0.08}
WITHIN = {"pH": {"abs": 0.1}, "solid": {"rel": 0.05, "abs": 1e-7}, "complex": {"rel": 0.1}}


def scene_of(row):
    """Three glasses, everything mixed, and the row's equations."""
    bodies = []
    for name in "abc":
        vessel = row.get(name, {})
        solid = {}
        if "solid" in vessel:
            grams = vessel["moles"] * molar_mass(vessel["solid"])
            solid = {"solid": {"formula": vessel["solid"], "mass_g": grams}}
        liquid = {"solutes": vessel["solutes"]} if "solutes" in vessel else {}
        bodies.append(glass(name, vessel.get("ml", 0.0), cavity=LARGE, properties=solid, **liquid))
    rate = {"rate_per_s": row["rate_per_s"]} if "rate_per_s" in row else {}
    effects = [SceneEffect("pour", {"from": ["a", "c"], "into": ["b"]}), SceneEffect("mixing", {"in": ["b"]})]
    effects += [SceneEffect("reaction", {"equation": equation, **rate}) for equation in row["equations"]]
    effects += [SceneEffect("precipitation", {"solid": solid, "colour": "white"}) for solid in row.get("falls", ())]
    return Scene(bodies=tuple(bodies), effects=tuple(effects))


def mixed(row):
    """Name -> what came out, with everything poured into b at one moment and left for a minute."""
    scene = scene_of(row)
    tables = {kind: step.declared for kind, step in plan(scene).steps.items()}
    contents = contents_of_scene(scene, "scene.toml")
    recipe = recipe_of(tables, contents)
    book = recipe.ledger(0.0, UNFOLLOWED)
    book.begin(0.0)
    for number, name in enumerate("ac", start=1):
        volume = contents[name].volume_ml if name in contents else 0.0
        if volume:
            moment = np.array([number]), np.array([0.1 * number])
            book.flow(*moment, [(name, "b")], np.array([[volume]]), np.zeros(1, dtype=bool))
    book.end(600, 60.0)
    amounts = book.amounts[book.at["b"]]
    found = {name.removesuffix("(s)").removesuffix("(g)"): amounts[place] for name, place in book.column.items()
             if name.endswith(("(s)", "(g)"))}  # fmt: skip
    if len(book.processes):
        found["extent"] = book.extents[book.at["b"], 0]
    if recipe.solver is not None:
        mixture = recipe.solver.mixture
        standing = amounts[None, book.phases] * ~book.gas
        totals = (amounts - standing @ book.formation)[:, book.parts]
        solved = recipe.solver.equilibrium(totals, amounts[None, book.water], np.array([25.0]), ~book.gas)
        found["pH"] = solved.ph[0]
        for wanted in row["expected"]:
            place = None if wanted in (*found, "extent") else mixture.row_of(ion_of(wanted))
            if place is not None:
                found[wanted] = solved.species[0, place]
        dissolved = solved.species[0] @ mixture.powers + solved.phases[0] @ mixture.uses
        assert dissolved == pytest.approx(totals[0], rel=1e-8, abs=1e-12)
    return found


@pytest.mark.parametrize("row", MIXTURES, ids=lambda row: row["name"])
def test_a_mixture_comes_out_as_phreeqc_or_the_manual_says(row):
    found = mixed(row)
    for name, wanted in row["expected"].items():
        kind = "pH" if name == "pH" else "complex" if "^" in name or name in ("NH3", "Ag(NH3)2+") else "solid"
        if name == "CO2" and wanted == 0.0:
            # Poured one after the other, a little leaves before the rest dilutes it.
            assert found.get(name, 0.0) < 1e-3
            continue
        assert found.get(name, 0.0) == pytest.approx(wanted, **WITHIN[kind]), (name, found)


def test_every_family_has_its_rows():
    families = {row["family"] for row in MIXTURES}
    assert len(MIXTURES) >= 80 and families == {
        "acids and bases", "hydrolysis", "gases", "precipitates", "copper", "complexes", "redox", "metals", "solids",
    }  # fmt: skip
