import json

import numpy as np
import pytest
from support.small_worlds import cubes

from replay.effects.effect_plan import plan
from replay.effects.effect_summary import effect_summary, happened_words, leading, plan_summary, titration_curves
from replay.effects.effects_runner import EffectRun
from replay.effects.output import EffectEvent, EffectOutput, Series
from replay.effects.protocol import EffectSpec
from replay.pipeline.engine import compute
from sessions.model.scene import Scene, SceneBody, SceneEffect

SCENE = Scene(
    bodies=(SceneBody("a"), SceneBody("b")),
    effects=(SceneEffect("breakage", {"between": ["a", "b"], "speed_m_s": 1.0}),),
)


def test_a_plan_as_json_gives_the_reason_of_every_item_and_what_is_left_out():
    told = plan_summary(plan(SCENE))
    assert told["effects"] == {"contact": ["breakage needs it"], "breakage": ["the scene declares it"]}
    assert told["pairs"] == {"a-b": ["contact"]} and told["detectors"] == {"exact": ["contact"]}
    assert told["topics"] == {"/tf": ["contact", "breakage"]}
    assert "grasp" in told["not_run"] and json.loads(json.dumps(told)) == told


def test_each_effect_has_its_share_of_the_time_its_work_and_its_skips():
    result = compute(cubes({"a": [0] * 20, "b": [3.0] * 8 + [0.9] * 12}, scene=SCENE), detectors=())
    told = result.summary["effects"]
    assert list(told) == ["contact", "breakage"] and told["contact"]["events"] == {"contact": 1}
    assert told["breakage"]["frames"] == 20 and told["breakage"]["frames_run"] <= 10
    assert told["breakage"]["trigger"] and told["contact"]["digest"] == result.effects["contact"].output.digest
    seconds = result.effects["contact"].seconds
    assert effect_summary(result.effects, 2 * seconds)["contact"]["share"] == pytest.approx(0.5)
    assert effect_summary(result.effects, 0.0)["contact"]["share"] == 0.0
    assert json.dumps(told)


def test_what_happened_is_told_in_order_of_time_and_says_how_much_it_leaves_out():
    places = [3.0, 3.0, *(([0.9] * 4 + [3.0] * 20) * 5)]
    result = compute(cubes({"a": [0] * len(places), "b": places}, scene=SCENE), detectors=())
    lines = happened_words(result.effects, 3)
    times = [float(line.split(" s: ")[0]) for line in lines[:3]]
    every = sum(len(run.events) for run in result.effects.values())
    assert times == sorted(times) and lines[3] == f"and {every - 3} more" and every > 4
    assert len(happened_words(result.effects, every)) == every


def told(kind, *events, **series):
    return EffectRun(EffectSpec(kind, "x", lambda i: None), (), EffectOutput(events, series), 0.1, {}, 3, 3)


def test_the_weightiest_result_leads_and_without_one_the_last_event():
    names = enumerate(("pour", "end-point", "colour-change"))
    pour, end, turns = (EffectEvent(float(at), name, ("flask",)) for at, name in names)
    assert leading({}) is None and leading({"pour": told("pour", pour)}) is pour
    assert leading({"pour": told("pour", pour), "a": told("a", turns)}) is turns
    assert leading({"a": told("a", turns), "reaction": told("reaction", end), "pour": told("pour", pour)}) is end


def test_a_curve_is_the_ph_over_what_came_in_and_ends_at_the_end_point():
    times = np.array([1.0, 2.0, 3.0])
    mixing = told("mixing", **{"flask/volume": Series(np.array([0.0, 1.0, 3.0]), np.array([20.0, 20.0, 30.0]), "mL")})
    end = EffectEvent(2.5, "end-point", ("flask",))
    reaction = told("reaction", end, **{"flask/pH": Series(times, np.array([1.0, 7.0, 12.0]), "pH")})
    added, ph, at = titration_curves({"mixing": mixing, "reaction": reaction})["flask"]
    assert added.tolist() == [0.0, 5.0, 10.0] and ph.tolist() == [1.0, 7.0, 12.0] and at == [7.5]
    assert titration_curves({"reaction": reaction}) == {} == titration_curves({"mixing": mixing})
