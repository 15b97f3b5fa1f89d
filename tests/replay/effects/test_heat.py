import pytest
from support.liquid_worlds import glass, poured, still, tilted, world

from replay.effects.effect_plan import plan
from replay.errors import PlanError
from replay.pipeline.engine import compute
from sessions.model.scene import SceneBody

DILUTION = {
    "of": "dilution", "solute": "H2SO4", "ambient_c": 20.0, "loss_w_per_k": 0.0, "heat_j_mol": 74000.0,
    "half_water": 1.8, "heat_capacity_j_per_ml_k": 4.0,
}  # fmt: skip
FLAME = {
    "of": "flame", "source": "lamp", "heats": "dish", "within": 0.02, "base": [0.0, 0.1, 0.0], "power_w": 160.0,
    "loss_w_per_k": 0.4, "ambient_c": 20.0,
}  # fmt: skip
DISH = SceneBody("dish", extra={"properties": {"heat_capacity_j_per_k": 60.0}})


def bench(*effects):
    poses = {"a": tilted([0.0, 60.0, 60.0]), "b": still(3), "lamp": still(3), "dish": still(3, (0.0, 0.2, 0.0))}
    bodies = (glass("a", 60.0), glass("b", 60.0, solute="H2SO4", molar=18.0, water_molar=4.1), SceneBody("lamp"), DISH)
    return world(poses, bodies, *effects)


POUR = ("pour", {"from": ["a"], "into": ["b"]})


def test_a_flame_needs_no_mixing_and_a_dilution_does():
    assert plan(bench(("heat", FLAME)).scene).effects == ("heat",)
    assert set(plan(bench(POUR, ("heat", DILUTION)).scene).effects) == {"heat", "mixing", "pour"}


def test_both_kinds_in_one_scene_tell_both():
    heat = compute(bench(POUR, ("heat", FLAME), ("heat", DILUTION))).effects["heat"]
    assert {"dish/temperature", "b/temperature"} <= set(heat.series) and heat.frames_run == 3
    assert {event.name for event in heat.events} == {"heated", "wrong-order"}
    assert [event.time for event in heat.events] == sorted(event.time for event in heat.events)


@pytest.mark.parametrize(
    ("settings", "words"),
    [({**FLAME, "of": "fire"}, "of is 'fire'"), ({k: v for k, v in FLAME.items() if k != "power_w"}, "power_w is miss"),
     ({**FLAME, "solute": "HCl"}, "solute belongs to heat of a dilution"), ({"of": "dilution"}, "ambient_c is missing"),
     ({**DILUTION, "half_water": 0.0}, "half_water is 0.0; give above 0.0")],
)  # fmt: skip
def test_what_a_kind_of_heat_needs_is_asked_for(settings, words):
    with pytest.raises(PlanError, match=words):
        plan(bench(("heat", settings)).scene)


def test_without_a_pour_nothing_is_diluted():
    assert poured([0.0, 0.0], None, ("heat", DILUTION))["heat"].events == ()
