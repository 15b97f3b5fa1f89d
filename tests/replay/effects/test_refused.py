"""Impossible scenes are refused before the run with what to give: one scene of every kind, one slip a row."""

import re
import tomllib
from pathlib import Path

import pytest
from support.liquid_worlds import scene_with_changes

from replay.effects import CATALOGUE, RETIRED_KINDS
from replay.effects.effect_plan import plan, plan_faults
from replay.errors import PlanError
from sessions.model.scene import Scene, SceneEffect

SLIPS = tomllib.loads(Path(__file__).with_name("refused.toml").read_text("utf-8"))["slip"]


def test_a_slip_is_refused_with_a_remedy():
    """A scene with an effect of every kind has no fault; a slip is a change of it that makes one.

    A slip: place in the scene -> what is written there instead; ``without``: what is left out; ``words``: a pattern of
    the fault, which says what to do.
    """
    assert plan_faults(scene_with_changes({})) == ()
    for slip in SLIPS:
        changes = {where: value for where, value in slip.items() if where not in ("words", "without")}
        faults = plan_faults(scene_with_changes(changes, slip.get("without", ())))
        assert any(re.search("^scene.toml: .*" + slip["words"], fault) for fault in faults), (slip, faults)


def test_the_scene_is_planned_after_a_right_change():
    """A burn between the hand and the flask, whose temperature an effect heat computes, is no fault.

    Nor is alcohol in the flask.
    """
    assert plan_faults(scene_with_changes({"burn.between": ["hand", "flask"]})) == ()
    assert plan_faults(scene_with_changes({"flask.properties.liquid.solutes.C2H5OH": 0.1})) == ()


RETIRED = [(kind, word) for kind, row in CATALOGUE.items() for word in row.get("retired", {})]


def test_a_retired_key_or_word_is_refused_with_its_successor():
    """``word``: of an effect in scenes of former versions, a key, or a value of a key with a list of ``among`` words.

    The catalogue's row of the effect says what to write instead (``advice``). The word is refused with that advice, as
    a key and as a value of each such key.
    """
    assert RETIRED
    for kind, word in RETIRED:
        row = CATALOGUE[kind]
        advice = row["retired"][word]
        assert word not in row["fields"], word
        keys_with_choices = [key for key, field in row["fields"].items() if "among" in field]
        for settings in ({word: 1.0}, *({key: word} for key in keys_with_choices)):
            faults = plan_faults(Scene(effects=(SceneEffect(kind, settings),)))
            assert any(fault.endswith(f": {advice}") for fault in faults), (word, settings)
        assert re.search("leave it out|it is called|write ", advice), word


@pytest.mark.parametrize("kind", RETIRED_KINDS)
def test_a_retired_kind_is_refused_with_its_successor(kind):
    """``kind``: of an effect that former versions had, declared in a scene."""
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
