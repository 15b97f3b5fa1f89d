"""What cannot be is refused before the run in words that say what to give: one scene of every kind, one slip a row."""

import re
import tomllib
from pathlib import Path

import pytest
from support.effect_proofs import scene

from replay.effects.effect_plan import plan
from replay.errors import PlanError

SLIPS = tomllib.loads(Path(__file__).with_name("refused.toml").read_text("utf-8"))["slip"]


@pytest.mark.parametrize("slip", SLIPS, ids=lambda slip: slip["words"])
def test_a_slip_is_refused_before_the_run_in_words_that_say_what_to_give(slip):
    changes = {where: value for where, value in slip.items() if where not in ("words", "without")}
    with pytest.raises(PlanError) as refused:
        plan(scene(changes, slip.get("without", ())))
    faults = refused.value.faults
    assert any(re.search("^scene.toml: .*" + slip["words"], fault) for fault in faults), faults


def test_the_scene_without_a_slip_is_planned_with_a_solute_that_keeps_its_protons_too():
    assert plan(scene({})).effects
    assert plan(scene({"burn.between": ["hand", "flask"]})).effects  # warm tells how hot each vessel is
    assert plan(scene({"flask.properties.liquid.solutes.C2H5OH": 0.1})).effects
