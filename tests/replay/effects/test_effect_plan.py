import sys
from types import SimpleNamespace

import pytest

from replay.effects import EFFECTS
from replay.effects.effect_plan import DECLARED, plan
from replay.effects.protocol import EffectOutput, EffectSpec
from replay.errors import PlanError
from sessions.model.scene import Scene, SceneBody, SceneEffect
from sessions.scene_files.scene_toml import parse_scene

BODIES = tuple(SceneBody(name, tags=(tag,)) for name, tag in (("cup", "glass"), ("jar", "glass"), ("top", "bench")))
GLASS_ON_BENCH = {"between": ["tag:glass", "top"]}


def scene(*effects, **more):
    return Scene(bodies=BODIES, effects=tuple(SceneEffect(kind, settings) for kind, settings in effects), **more)


@pytest.fixture
def made_up(monkeypatch):
    """Makes these specs the only effects."""

    def make(*specs):
        for kind in (*EFFECTS,):
            monkeypatch.delitem(EFFECTS, kind)
        for one in specs:
            monkeypatch.setitem(EFFECTS, one.kind, f"made_up:{one.kind}")
        monkeypatch.setitem(sys.modules, "made_up", SimpleNamespace(**{one.kind: one for one in specs}))

    return make


def spec(kind, **more):
    return EffectSpec(kind, "made up", lambda inputs: EffectOutput(), **more)


def test_a_scene_that_declares_nothing_runs_no_effect():
    assert plan(Scene()).effects == plan(Scene(effects=())).effects == ()
    assert plan(Scene()).detection and not plan(Scene(effects=())).detection


def test_the_pairs_of_an_effect_are_the_selectors_written_out_and_nothing_else():
    planned = plan(scene(("contact", GLASS_ON_BENCH)))
    assert planned.pairs == (("cup", "top"), ("jar", "top")) and planned.detection
    assert planned.detectors == {"exact": ("contact",)} and list(planned.bodies) == ["cup", "top", "jar"]
    assert planned.topics == {"/tf": ("contact",)} and planned.steps["contact"].because == (DECLARED,)


def test_effects_that_need_each_other_are_refused(made_up):
    made_up(spec("egg", needs=("hen",)), spec("hen", needs=("egg",)))
    with pytest.raises(PlanError, match=r"circle: (egg -> hen -> egg|hen -> egg -> hen)"):
        plan(scene(("egg", {})))


def test_every_fault_is_named_at_any_depth_whether_effects_are_declared_or_not():
    bodies = """[[body]]
id = "cup"
cavity = { capcity_ml = 3.0 }
properties = { liqid = {}, liquid = { volum_ml = 1.0, molar = 1.0 }, solid = 3, glow = { lux = 2 } }
"""
    effects = '[[effect]]\nkind = "contct"\n[[effect]]\nkind = "pour"\nfrom = "cap"\nint = "cup"\n'
    wrong = [
        "('cup'): solid is 3; give a table", "('cup') cavity: unknown key 'capcity_ml'; did you mean 'capacity_ml'?",
        "('cup') properties: unknown key 'liqid'; did you mean 'liquid'?",
        "('cup') properties liquid: unknown key 'volum_ml'; did you mean 'volume_ml'?",
        "('cup') properties: unknown key 'glow'",
    ]  # fmt: skip
    with pytest.raises(PlanError) as caught:
        plan(parse_scene(bodies), "lab.toml")
    assert len(caught.value.faults) == 5
    assert all(sum(f"lab.toml: [[body]] 1 {one}".replace("('cup'): solid", "('cup') properties: solid") in said
                   for said in caught.value.faults) == 1 for one in wrong)  # fmt: skip
    with pytest.raises(PlanError) as caught:
        plan(parse_scene(bodies + effects), "lab.toml")
    said = caught.value.faults
    assert len(said) == 8 and str(caught.value) == f"{said[0]}; and more: `replay scene check` lists every fault"
    assert "[[effect]] 1: no effect of kind 'contct'; did you mean 'contact'?" in said[0]
    assert "[[effect]] 2 ('pour'): unknown key 'int'; did you mean 'into'?" in said[1] and "'cap'" in said[2]
