"""Hydroxides that ammonia dissolves fresh and not aged, and solids beyond their solubility, have events."""

from types import SimpleNamespace

import numpy as np
from support.liquid_worlds import glass

from replay.effects.chemistry.contents import contents_of_scene
from replay.effects.chemistry.ledger_columns import UNFOLLOWED_WARMTH
from replay.effects.chemistry.matter import Matter
from replay.effects.chemistry.recipe import recipe_of
from replay.effects.chemistry.supersaturated import aged_hydroxide_events, supersaturation_events
from replay.effects.effect_plan import plan
from sessions.model.scene import Scene, SceneEffect


def flask_with(ph=9.5, **mol):
    """A flask in which so many mol of each formula are in the end."""
    return SimpleNamespace(
        histories={"flask": SimpleNamespace(times=np.array([0.0, 2.0]))},
        ledger=SimpleNamespace(column=dict.fromkeys(mol, 0)),
        solver=object(),
        amount=lambda vessel, column: np.array([0.0, mol.get(column, 0.0)]),
        equilibria=lambda vessel, times: (None, SimpleNamespace(ph=np.array([ph]))),
    )


ALUMINIUM = {
    "half": (0.5, 0.5, 2.0, 9.5, "50 %"),
    "a tenth": (0.9, 0.1, 1.1, 9.5, "10 %"),
    "little ammonia": (0.5, 0.5, 0.9, 9.5, ""),
    "hardly any dissolved": (0.97, 0.03, 2.0, 9.5, ""),
    "acid": (0.5, 0.5, 2.0, 6.5, ""),
    "lye": (0.5, 0.5, 2.0, 12.0, ""),
}  # fmt: skip


def test_aluminium_that_ammonia_keeps_dissolved_is_fresh():
    """In a flask are mol of aluminium hydroxide (``solid``), of dissolved aluminium and of ammonia.

    In textbooks ammonia dissolves no fresh hydroxide, by PHREEQC it does: an event "fresh" says how many ``percent`` of
    the aluminium. There is none ("") with less ammonia than aluminium, below 5 %, in acid (pH 6.5), or in lye (pH 12),
    which dissolves it in textbooks too.
    """
    for case, (solid, dissolved, ammonia, ph, percent) in ALUMINIUM.items():
        amounts = {"Al(OH)3(s)": solid, "Al^3+": dissolved, "NH3": ammonia}
        texts = [event.text for event in aged_hydroxide_events(flask_with(ph, **amounts)) if event.name == "fresh"]
        assert len(texts) == (1 if percent else 0), case
        assert all(text.startswith(f"{percent} of the aluminium") for text in texts), case


def test_aluminium_is_not_fresh_where_nobody_knows_the_ph():
    """Half of the aluminium is dissolved beside much ammonia, which at pH 9.5 would be reported; no pH is computed."""
    flask = flask_with(**{"Al(OH)3(s)": 0.5, "Al^3+": 0.5, "NH3": 2.0})
    flask.solver = None
    assert list(aged_hydroxide_events(flask)) == []


COPPER = {
    "sulfate": (0.5, 0.5, 5.0, "SO4^2-", "Cu4(OH)6SO4"),
    "nitrate": (0.5, 0.5, 5.0, "NO3-", "Cu2(OH)3NO3"),
    "an anion without a basic salt": (0.5, 0.5, 5.0, "F-", ""),
    "little ammonia": (0.5, 0.5, 3.0, "SO4^2-", ""),
    "1 in 200": (0.005, 0.995, 5.0, "SO4^2-", ""),
    "1 in 50": (0.02, 0.98, 5.0, "SO4^2-", "Cu4(OH)6SO4"),
    "no ammonia": (0.5, 0.5, 0.0, "SO4^2-", ""),
}  # fmt: skip


def test_copper_hydroxide_left_beside_much_ammonia_is_aged():
    """In a flask are mol of copper hydroxide, of dissolved copper, of ammonia, and a mol of an ``anion``.

    The ammine takes 4 mol of ammonia, so 5 mol would dissolve all of the mol of copper fresh, 3 would not: what is left
    beside 5 is aged, and an event names the basic ``salt`` of the anion that falls out at first, "" where there is
    none. Less than 1 in 100 of the copper does not count.
    """
    for case, (hydroxide, copper, ammonia, anion, salt) in COPPER.items():
        amounts = {"Cu(OH)2(s)": hydroxide, "Cu^2+": copper, "NH3": ammonia, anion: 1.0}
        texts = [event.text for event in aged_hydroxide_events(flask_with(**amounts)) if event.name == "aged"]
        assert len(texts) == (1 if salt else 0), case
        assert all(f"at first is {salt}, which" in text for text in texts), case


def flask_at_rest(solutes):
    """All that is known of a flask of 50 mL in which nothing happens; ``solutes``: formula -> mol/L."""
    effects = (SceneEffect("mixing", {"in": ["flask"]}), SceneEffect("colour", {"in": "flask", "indicator": "litmus"}))
    scene = Scene(bodies=(glass("flask", volume_ml=50.0, solutes=solutes),), effects=effects)
    tables = {kind: step.declared for kind, step in plan(scene).steps.items()}
    recipe = recipe_of(tables, contents_of_scene(scene, "scene.toml"))
    ledger = recipe.ledger(0.0, UNFOLLOWED_WARMTH)
    ledger.begin(0.0)
    ledger.end(1, 1.0)
    return Matter(recipe, ledger, {}, {"flask": ledger.history("flask")})


SOLUTIONS = {
    "hydroxide": ({"CaCl2": 0.1, "NaOH": 0.3}, ["Ca(OH)2"]),
    "hardly any sulfate": ({"CaCl2": 0.1, "NaOH": 0.3, "Na2SO4": 0.001}, ["Ca(OH)2"]),
    "carbonate": ({"CaCl2": 0.1, "NaOH": 0.3, "Na2CO3": 0.1}, ["CaCO3"]),
    "basic salt": ({"CuSO4": 0.1, "NH3": 0.1}, ["Cu4(OH)6SO4"]),
    "copper hydroxide": ({"CuSO4": 0.1, "NaOH": 0.1}, ["Cu(OH)2"]),
    "all dissolves": ({"NaCl": 0.1}, []),
}


def test_solid_beyond_its_solubility_is_reported_once_a_metal():
    """``solutes``: mol/L in a flask, whose scene names no solid that may fall out; ``solids``: that warnings name.

    Of a metal, calcium or copper, one solid alone is named. Gypsum takes more sulfate than 0.001 mol/L. A saturation
    index, log10 of the product of the ions over the soluble one, above 0.3 is more than twice that (10^0.3).
    """
    for case, (solutes, solids) in SOLUTIONS.items():
        events = list(supersaturation_events(flask_at_rest(solutes)))
        assert [event.values["formula"] for event in events] == solids, case
        assert all(event.time == 0.0 and event.values["saturation_index"] > 0.3 for event in events), case
