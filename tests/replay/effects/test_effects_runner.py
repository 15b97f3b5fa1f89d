import json

import numpy as np
import pytest
from support.small_worlds import cubes

from replay.effects.effect_plan import Plan, Step, plan
from replay.effects.effect_summary import effect_summary, happened_words, plan_summary
from replay.effects.effects_runner import run_effects
from replay.effects.output import EffectOutput
from replay.effects.protocol import EffectSpec
from replay.errors import EffectError
from replay.pipeline.engine import compute
from replay.prepare.assemble import assemble
from sessions.model.scene import Scene, SceneBody, SceneEffect


def planned(*specs, **inputs):
    steps = {s.kind: Step(s, (), (), inputs.get(s.kind, ()), ("the scene declares it",)) for s in specs}
    return Plan(steps, (), detection=False, bodies={"a": ("x",)})


def ran(*specs, **inputs):
    session = cubes({"a": [0, 0, 0, 0], "b": [3, 3, 2, 3]})
    return run_effects(planned(*specs, **inputs), session, assemble(session), {})


def spec(kind, compute, **more):
    return EffectSpec(kind, "x", compute, **more)


def test_an_effect_gets_the_outputs_of_its_inputs_and_no_others():
    seen = {}

    def second(inputs):
        seen.update(inputs.outputs)
        return EffectOutput()

    ran(
        spec("one", lambda i: EffectOutput(data=1)),
        spec("two", lambda i: EffectOutput(data=2)),
        spec("x", second),
        x=("two",),
    )
    assert {kind: output.data for kind, output in seen.items()} == {"two": 2}


def test_frames_in_which_the_trigger_was_off_are_counted_and_shown():
    mask = np.array([False, True, True, False])
    run = ran(spec("pour", lambda inputs: EffectOutput(ran=mask)))["pour"]
    assert (run.frames, run.frames_run) == (4, 2)
    assert [(s.start, s.end, s.word) for s in run.output.lanes["skipped"]] == [
        (0.0, 0.01, "skipped"),
        (0.03, 0.03, "skipped"),
    ]


def test_an_effect_that_always_runs_has_no_lane_of_skips():
    run = ran(spec("mix", lambda inputs: EffectOutput()))["mix"]
    assert run.frames_run == run.frames and "skipped" not in run.output.lanes and run.events == () and run.series == {}


def test_counters_and_time_are_those_of_the_effect():
    def compute(inputs):
        inputs.count("drops", 3)
        return EffectOutput()

    runs = ran(spec("burette", compute), spec("mix", lambda inputs: EffectOutput()))
    assert runs["burette"].counters == {"drops": 3} and runs["mix"].counters == {}
    assert runs["burette"].seconds >= 0.0


def test_a_mask_of_another_length_is_refused():
    with pytest.raises(EffectError, match="says it ran in"):
        ran(spec("pour", lambda inputs: EffectOutput(ran=np.ones(3, dtype=np.bool_))))


def test_detections_are_kept_from_effects_that_name_no_detector():
    with pytest.raises(EffectError, match="name a `detector`"):
        ran(spec("pour", lambda inputs: inputs.contact(("a", "b"))))


def test_effects_of_a_session_of_hours_with_its_poses_on_disk_are_the_same(monkeypatch):
    import replay.prepare.assemble_stored as stored
    from replay.detection import run_detector as detecting
    from replay.pipeline.engine import compute
    from sessions.model.scene import Scene, SceneBody, SceneEffect

    effects = (
        SceneEffect("breakage", {"between": ["b", "a"], "speed_m_s": 0.1}),
        SceneEffect("hazard-proximity", {"of": "b", "hazard": "a", "distance": 0.2}),
    )
    scene = Scene(bodies=(SceneBody("a"), SceneBody("b")), effects=effects)
    places = [1.3 - 0.02 * min(k, 17) for k in range(60)]
    session = cubes({"a": [0.0] * 60, "b": places}, scene=scene)
    held = compute(session, detectors=()).effects
    monkeypatch.setattr(stored, "HELD_FRAMES", 10)
    monkeypatch.setattr(detecting, "WHOLE_FRAMES", 16)
    on_disk = compute(session, detectors=())
    assert type(on_disk.assembly.motion).__name__ == "StoredMotion"
    assert {kind: run.output.digest for kind, run in on_disk.effects.items()} == {
        kind: run.output.digest for kind, run in held.items()
    }
    assert held["breakage"].output.named("broken")


SCENE = Scene(
    bodies=(SceneBody("a"), SceneBody("b")),
    effects=(SceneEffect("breakage", {"between": ["a", "b"], "speed_m_s": 1.0}), SceneEffect("penetration")),
)


def test_a_plan_as_json_gives_the_reason_of_every_item_and_what_is_left_out():
    told = plan_summary(plan(SCENE))
    assert told["effects"] == {"contact": ["breakage needs it"], "breakage": ["the scene declares it"]}
    assert told["pairs"] == {"a-b": ["contact"]} and told["detectors"] == {"exact": ["contact"]}
    assert told["topics"] == {"/tf": ["contact", "breakage"]} and told["not_built"] == ["penetration"]
    assert "grasp" in told["not_run"] and json.loads(json.dumps(told)) == told


def test_a_scene_that_declares_nothing_has_all_pairs_and_no_effects():
    told = plan_summary(plan(Scene()))
    assert told["pairs"] is None and told["effects"] == {} and told["detection"]


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
