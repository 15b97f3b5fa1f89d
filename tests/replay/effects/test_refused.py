"""Impossible scenes are refused before the run with what to give: one scene of every kind, one slip a row."""

import re
import tomllib
from pathlib import Path

import pytest
from support.liquid_worlds import scene_with_changes

from replay.effects import CATALOGUE, RETIRED_KINDS
from replay.effects.effect_plan import plan
from replay.errors import PlanError
from sessions.model.scene import Scene, SceneEffect

SLIPS = tomllib.loads(Path(__file__).with_name("refused.toml").read_text("utf-8"))["slip"]


@pytest.mark.parametrize("slip", SLIPS, ids=lambda slip: slip["words"])
def test_a_slip_is_refused_with_a_remedy(slip):
    """``slip``: of refused.toml, what is written otherwise in a whole scene, or left out, and words of the refusal."""
    changes = {where: value for where, value in slip.items() if where not in ("words", "without")}
    with pytest.raises(PlanError) as refused:
        plan(scene_with_changes(changes, slip.get("without", ())))
    faults = refused.value.faults
    assert any(re.search("^scene.toml: .*" + slip["words"], fault) for fault in faults), faults


def test_the_scene_without_a_slip_is_planned():
    """So each slip alone is why its scene is refused; two changes of the scene are right too."""
    assert plan(scene_with_changes({})).effects
    assert plan(scene_with_changes({"burn.between": ["hand", "flask"]})).effects  # warm tells how hot each vessel is
    assert plan(scene_with_changes({"flask.properties.liquid.solutes.C2H5OH": 0.1})).effects


RETIRED = [(kind, word) for kind, row in CATALOGUE.items() for word in row.get("retired", {})]


@pytest.mark.parametrize(("kind", "word"), RETIRED)
def test_a_retired_key_or_word_is_refused_with_its_successor(kind, word):
    """``word``: retired as a key, or as a value of a key that allows certain words; its row says what to write."""
    row = CATALOGUE[kind]
    assert word not in row["fields"]
    texts = [key for key, field in row["fields"].items() if "among" in field]
    for settings in ({word: 1.0}, *({key: word} for key in texts)):
        with pytest.raises(PlanError) as refused:
            plan(Scene(effects=(SceneEffect(kind, settings),)))
        assert any(fault.endswith(f": {row['retired'][word]}") for fault in refused.value.faults)
    assert re.search("leave it out|it is called|write ", row["retired"][word])


@pytest.mark.parametrize("kind", RETIRED_KINDS)
def test_a_retired_kind_is_refused_with_its_successor(kind):
    with pytest.raises(PlanError, match=f"no effect of kind '{kind}': .*; leave this table out"):
        plan(Scene(effects=(SceneEffect(kind, {"jar": "jar"}),)))


def test_keys_of_the_former_solver_are_refused_as_retired():
    """All keys and words that the catalogue before PHREEQC had and this one has not."""
    assert set(RETIRED) == {
        ("pour", "solids_along"), ("reaction", "acids"), ("reaction", "bases"), ("precipitation", "ksp"),
        ("heat", "solute"), ("heat", "heat_j_mol"), ("heat", "half_water"), ("heat", "dilution"),
        ("heat", "neutralisation"),
    }  # fmt: skip
    assert set(RETIRED_KINDS) == {"gas"}
