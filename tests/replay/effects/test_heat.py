from types import SimpleNamespace

import numpy as np
import pytest
from support.liquid_worlds import glass, poured, still, tilted, world
from support.small_worlds import cubes

from replay.effects.burn_exposure import SPEC, damage, surface
from replay.effects.declaring import declare
from replay.effects.effect_plan import plan
from replay.effects.output import EffectOutput, Series
from replay.errors import EffectError, PlanError
from replay.pipeline.engine import compute
from sessions.model.scene import Scene, SceneBody, SceneEffect

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


def run(xs, height=0.2, capacity=60.0, **more):
    places = np.zeros((len(xs), 3))
    places[:, 0], places[:, 1] = xs, height
    poses = {"lamp": still(len(xs)), "dish": (places, still(len(xs))[1])}
    dish = SceneBody("dish", extra={"properties": {"heat_capacity_j_per_k": capacity}})
    session = world(poses, (SceneBody("lamp"), dish), ("heat", {**FLAME, **more}), step_ns=100_000_000)
    return compute(session).effects["heat"]


XS = [1.0] * 5 + [0.01] * 100 + [1.0] * 100


def test_over_the_flame_it_warms_and_beside_it_it_cools():
    run_ = run(XS)
    (event,) = run_.events
    peak = 20.0 + 400.0 * -np.expm1(-10.0 * 0.4 / 60.0)
    assert event.name == "heated" and (event.time, event.end) == pytest.approx((0.5, 10.5))
    assert event.values["to_c"] == pytest.approx(peak, rel=1e-9)
    told = run_.series["dish/temperature"]
    assert told.values.max() == pytest.approx(peak, rel=1e-9) and told.values[0] == 20.0
    after = 20.0 + (peak - 20.0) * np.exp(-(told.times[-1] - 10.5) * 0.4 / 60.0)
    assert told.values[-1] == pytest.approx(after, rel=1e-9) and run_.frames_run == 200


@pytest.mark.parametrize("where", [{"xs": [0.021] * 20}, {"xs": [0.0] * 20, "height": 0.1}, {"xs": [1.0, 0.0, 1.0]}])
def test_beside_below_or_for_one_frame_it_is_not_heated(where):
    run_ = run(**where)
    assert run_.events == () and run_.frames_run == 0 and set(run_.series["dish/temperature"].values) == {20.0}


def test_reaching_the_boiling_point_is_an_event_and_short_of_it_none():
    assert [event.name for event in run(XS, boils_c=40.0).events] == ["heated", "boil"]
    assert [event.name for event in run(XS, boils_c=80.0).events] == ["heated"]


@pytest.mark.parametrize("capacity", [0.0, -1.0, None, "small"])
def test_a_heat_capacity_that_cannot_be_is_named(capacity):
    with pytest.raises(EffectError, match="'dish' has heat_capacity_j_per_k"):
        run(XS, capacity=capacity)


SKIN = {
    "damage_rate_per_s": 3.1e98, "damage_energy_j_mol": 6.28e5, "skin_c": 34.0, "skin_effusivity": 1100.0,
    "part_effusivity": 1600.0,
}  # fmt: skip


def scene(**more):
    settings = {"between": ["hand", "pot"], "threshold_c": 65.0, "seconds": 0.5, **more}
    return Scene(bodies=(SceneBody("hand"), SceneBody("pot")), effects=(SceneEffect("burn-exposure", settings),))


def run_burn_exposure(frames, **more):
    places = [3.0] * 20 + [0.9] * frames + [3.0] * 20
    return compute(cubes({"hand": places, "pot": [0.0] * len(places)}, scene=scene(**more)), detectors=()).effects


def test_a_hand_on_a_hot_part_for_long_enough_is_a_burn():
    effect = run_burn_exposure(60, surface_c=70.0)["burn-exposure"]
    exposed, burn = effect.events
    assert (exposed.name, burn.name, burn.level) == ("exposed", "burn", "error")
    assert burn.values["seconds"] == pytest.approx(0.6) and burn.time == pytest.approx(0.2)
    assert effect.frames_run == 60 and effect.output.lanes["hand-pot"][0].word == "burn"


@pytest.mark.parametrize(("frames", "surface_c"), [(60, 65.0), (49, 70.0)], ids=["not hot enough", "not long enough"])
def test_at_the_threshold_or_for_a_shorter_time_it_is_an_exposure(frames, surface_c):
    assert [event.name for event in run_burn_exposure(frames, surface_c=surface_c)["burn-exposure"].events] == [
        "exposed"
    ]


def test_without_a_contact_nothing_is_computed():
    effect = run_burn_exposure(0, surface_c=90.0)["burn-exposure"]
    assert effect.frames_run == 0 and effect.events == () and effect.counters == {}


def test_the_temperature_of_the_effect_heat_is_followed_through_the_contact():
    declared = declare(scene().effects[0], 1, SPEC.fields, scene(), "lab.toml")
    heat = EffectOutput(series={"pot/temperature": Series(np.array([0.0, 10.0]), np.array([20.0, 120.0]), "degC")})
    inputs = SimpleNamespace(times=np.arange(0.0, 5.0), output=lambda kind: {"heat": heat}[kind])
    assert surface(inputs, declared, "pot", SimpleNamespace(first=2, stop=4)).tolist() == [40.0, 50.0]
    with pytest.raises(EffectError, match="nothing says how hot 'cup' is"):
        surface(inputs, declared, "cup", SimpleNamespace(first=2, stop=4))


def test_the_damage_at_a_constant_temperature_is_rate_times_time():
    declared = declare(scene(**SKIN).effects[0], 1, SPEC.fields, scene(), "lab.toml")
    interface = (1100.0 * 34.0 + 1600.0 * 70.0) / 2700.0 + 273.15
    expected = 0.6 * np.exp(np.log(3.1e98) - 6.28e5 / (8.314462618 * interface))
    assert damage(declared, np.linspace(0.0, 0.6, 61), np.full(61, 70.0)) == pytest.approx(expected, rel=1e-9)
    values = run_burn_exposure(60, surface_c=70.0, **SKIN)["burn-exposure"].events[0].values
    assert values["damage"] == pytest.approx(expected, rel=0.02)


def test_damage_grows_with_temperature_and_stays_finite_at_any():
    declared = declare(scene(**SKIN).effects[0], 1, SPEC.fields, scene(), "lab.toml")
    times = np.array([0.0, 1.0])
    doses = [
        damage(declared, times, np.full(2, temperature)) for temperature in (-200.0, 20.0, 45.0, 60.0, 500.0, 5000.0)
    ]
    assert np.isfinite(doses).all() and doses == sorted(doses) and doses[0] >= 0.0


def test_heat_is_needed_exactly_where_no_temperature_is_declared():
    kinds = {True: SPEC.needed((declare(scene(surface_c=70).effects[0], 1, SPEC.fields, scene(), "f"),)),
             False: SPEC.needed((declare(scene().effects[0], 1, SPEC.fields, scene(), "f"),))}  # fmt: skip
    assert kinds == {True: ("contact",), False: ("contact", "heat")}


def test_constants_of_the_damage_integral_come_together():
    with pytest.raises(PlanError, match="damage_rate_per_s is given and damage_energy_j_mol is not"):
        plan(scene(surface_c=70.0, damage_rate_per_s=3.1e98))
