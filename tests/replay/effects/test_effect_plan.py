"""A plan holds what a scene calls for, with reasons; rows of the table of effects are whole; every fault is named."""

import json
import sys
from types import SimpleNamespace

import pytest

from replay.effects import EFFECTS, load_effect
from replay.effects.effect_plan import DECLARED_REASON, plan
from replay.effects.effect_summary import plan_summary
from replay.effects.protocol import EffectOutput, EffectSpec
from replay.errors import EffectError, PlanError
from sessions.model.scene import Scene, SceneBody, SceneEffect
from sessions.scene_files.scene_toml import parse_scene

BODIES = tuple(SceneBody(name, tags=(tag,)) for name, tag in (("cup", "glass"), ("jar", "glass"), ("top", "bench")))


def test_every_item_of_a_plan_has_its_reason():
    """The scene declares breakage between its two glasses (cup, jar) and a bench top: it needs contacts of two pairs.

    The summary names for each effect, pair, detector and topic the effects that need it, and effects that do not run;
    it can be written as JSON.
    """
    breakage = SceneEffect("breakage", {"between": ["tag:glass", "top"], "speed_m_s": 1.0})
    planned = plan(Scene(bodies=BODIES, effects=(breakage,)))
    assert planned.pairs == (("cup", "top"), ("jar", "top")) and planned.detection
    summary = plan_summary(planned)
    assert summary["effects"] == {"contact": ["breakage needs it"], "breakage": [DECLARED_REASON]}
    assert summary["pairs"] == {"cup-top": ["contact"], "jar-top": ["contact"]}
    assert summary["detectors"] == {"exact": ["contact"]} and summary["topics"] == {"/tf": ["contact", "breakage"]}
    assert list(summary["bodies"]) == ["cup", "top", "jar"]
    assert "grasp" in summary["not_run"] and json.loads(json.dumps(summary)) == summary


def test_effects_that_need_each_other_are_refused(monkeypatch):
    """Made-up effects: egg needs hen, hen needs egg."""
    specs = {
        kind: EffectSpec(kind, "made up", lambda inputs: EffectOutput(), needs=(other,))
        for kind, other in (("egg", "hen"), ("hen", "egg"))
    }
    for kind in specs:
        monkeypatch.setitem(EFFECTS, kind, f"made_up:{kind}")
    monkeypatch.setitem(sys.modules, "made_up", SimpleNamespace(**specs))
    with pytest.raises(PlanError, match=r"circle: (egg -> hen -> egg|hen -> egg -> hen)"):
        plan(Scene(effects=(SceneEffect("egg", {}),)))


BODY_WITH_5_FAULTS = """[[body]]
id = "cup"
cavity = { capcity_ml = 3.0 }
properties = { liqid = {}, liquid = { volum_ml = 1.0, molar = 1.0 }, solid = 3, glow = { lux = 2 } }
"""


def test_every_fault_of_a_body_is_named_at_any_depth():
    """``starts``: how the reasons of the five faults of a scene's only body start, in any order."""
    starts = {
        "cavity: unknown key 'capcity_ml'; did you mean 'capacity_ml'?", "properties: solid is 3; give a table",
        "properties: unknown key 'liqid'; did you mean 'liquid'?", "properties: unknown key 'glow'",
        "properties liquid: unknown key 'volum_ml'; did you mean 'volume_ml'?",
    }  # fmt: skip
    with pytest.raises(PlanError) as refused:
        plan(parse_scene(BODY_WITH_5_FAULTS, "lab.toml"))
    reasons = [fault.removeprefix("lab.toml: [[body]] 1 ('cup') ") for fault in refused.value.faults]
    assert all(sum(reason.startswith(start) for reason in reasons) == 1 for start in starts)
    assert len(reasons) == len(starts)


def test_faults_of_effects_come_before_those_of_bodies():
    """Three faults of two effects: an unknown kind, an unknown key and an unknown body; and five of a body.

    The error shows the first of the eight, and how to see all.
    """
    effects = '[[effect]]\nkind = "contct"\n[[effect]]\nkind = "pour"\nfrom = "cap"\nint = "cup"\n'
    with pytest.raises(PlanError) as refused:
        plan(parse_scene(BODY_WITH_5_FAULTS + effects, "lab.toml"))
    unknown_kind, unknown_key, unknown_body, *faults_of_body = refused.value.faults
    assert "[[effect]] 1: no effect of kind 'contct'; did you mean 'contact'?" in unknown_kind
    assert "[[effect]] 2 ('pour'): unknown key 'int'; did you mean 'into'?" in unknown_key
    assert "'cap'" in unknown_body
    assert len(faults_of_body) == 5
    assert str(refused.value) == f"{unknown_kind}; and more: `replay scene check` lists every fault"


@pytest.mark.parametrize(
    ("entry", "text"),
    [
        ("replay.effects.nowhere:SPEC", r"effect 'x' \(replay.effects.nowhere:SPEC\) cannot be loaded: .*repair"),
        (EFFECTS["contact"], "calls itself 'contact' and its row 'x'"),
    ],
    ids=["no such module", "spec of another effect"],
)
def test_a_row_that_cannot_be_loaded_is_refused(entry, text, monkeypatch):
    """A row "x" is added to the table of effects; ``entry``: module and name of its spec; ``text``: of the error."""
    monkeypatch.setitem(EFFECTS, "x", entry)
    with pytest.raises(EffectError, match=text):
        load_effect("x")
