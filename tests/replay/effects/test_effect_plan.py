"""A plan holds what a scene calls for, with reasons; rows of the table of effects are whole; every fault is named."""

import json
import sys
from types import SimpleNamespace

import pytest

from replay.effects import EFFECTS, load_effect
from replay.effects.declaring import READERS
from replay.effects.effect_plan import DECLARED_REASON, plan
from replay.effects.effect_summary import plan_summary
from replay.effects.protocol import EffectOutput, EffectSpec
from replay.errors import EffectError, PlanError
from sessions.model.scene import Scene, SceneBody, SceneEffect
from sessions.scene_files.scene_toml import parse_scene

BODIES = tuple(SceneBody(name, tags=(tag,)) for name, tag in (("cup", "glass"), ("jar", "glass"), ("top", "bench")))


def test_every_item_of_a_plan_has_its_reason():
    """The scene declares breakage between its two glasses and the top, which needs contacts of these two pairs."""
    falls = SceneEffect("breakage", {"between": ["tag:glass", "top"], "speed_m_s": 1.0})
    planned = plan(Scene(bodies=BODIES, effects=(falls,)))
    assert planned.pairs == (("cup", "top"), ("jar", "top")) and planned.detection
    settings = plan_summary(planned)
    assert settings["effects"] == {"contact": ["breakage needs it"], "breakage": [DECLARED_REASON]}
    assert settings["pairs"] == {"cup-top": ["contact"], "jar-top": ["contact"]}
    assert settings["detectors"] == {"exact": ["contact"]} and settings["topics"] == {"/tf": ["contact", "breakage"]}
    assert list(settings["bodies"]) == ["cup", "top", "jar"]
    assert "grasp" in settings["not_run"] and json.loads(json.dumps(settings)) == settings


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


def test_every_fault_is_named_at_any_depth():
    """The body has five faults; two effects, of which one is of an unknown kind, bring the faults to eight."""
    bodies = """[[body]]
id = "cup"
cavity = { capcity_ml = 3.0 }
properties = { liqid = {}, liquid = { volum_ml = 1.0, molar = 1.0 }, solid = 3, glow = { lux = 2 } }
"""
    effects = '[[effect]]\nkind = "contct"\n[[effect]]\nkind = "pour"\nfrom = "cap"\nint = "cup"\n'
    wrong = {
        "cavity: unknown key 'capcity_ml'; did you mean 'capacity_ml'?", "properties: solid is 3; give a table",
        "properties: unknown key 'liqid'; did you mean 'liquid'?", "properties: unknown key 'glow'",
        "properties liquid: unknown key 'volum_ml'; did you mean 'volume_ml'?",
    }  # fmt: skip
    with pytest.raises(PlanError) as caught:
        plan(parse_scene(bodies, "lab.toml"))
    message = [fault.removeprefix("lab.toml: [[body]] 1 ('cup') ") for fault in caught.value.faults]
    assert all(sum(reason.startswith(text) for reason in message) == 1 for text in wrong) and len(message) == len(wrong)
    with pytest.raises(PlanError) as caught:
        plan(parse_scene(bodies + effects, "lab.toml"))
    message = caught.value.faults
    assert len(message) == 8 and str(caught.value) == f"{message[0]}; and more: `replay scene check` lists every fault"
    assert "[[effect]] 1: no effect of kind 'contct'; did you mean 'contact'?" in message[0]
    assert "[[effect]] 2 ('pour'): unknown key 'int'; did you mean 'into'?" in message[1] and "'cap'" in message[2]


@pytest.mark.parametrize("kind", EFFECTS)
def test_every_row_leads_to_a_spec_of_its_name(kind):
    """A row of the table of effects; those that it needs or uses are in the table too."""
    spec = load_effect(kind)
    assert spec.kind == kind and spec.about.endswith(".")
    assert {*spec.needs, *spec.needs_if, *spec.uses} <= set(EFFECTS)
    assert all(field.about and field.kind in READERS for field in spec.fields.values())


@pytest.mark.parametrize(
    ("entry", "text"),
    [
        ("replay.effects.nowhere:SPEC", r"effect 'x' \(replay.effects.nowhere:SPEC\) cannot be loaded: .*repair"),
        (EFFECTS["contact"], "calls itself 'contact' and its row 'x'"),
    ],
)
def test_a_row_that_cannot_be_loaded_is_refused(entry, text, monkeypatch):
    monkeypatch.setitem(EFFECTS, "x", entry)
    with pytest.raises(EffectError, match=text):
        load_effect("x")
