import numpy as np
import pytest
from support.small_worlds import cubes

from cdcore import Detection, Verdict
from replay.effects.effect_plan import plan
from replay.effects.effects_runner import run_effects
from replay.pipeline.engine import compute
from replay.prepare.assemble import assemble
from sessions.model.scene import Scene, SceneBody, SceneEffect

SCENE = Scene(
    bodies=(SceneBody("a"), SceneBody("b")), effects=(SceneEffect("sweep", {"between": ["a", "b"]}),), pairs=()
)
WORDS = {".": Verdict.CLEAR, "C": Verdict.CONTACT, "u": Verdict.UNRESOLVED}


def swept(row, **more):
    """What the effect makes of a detector of intervals that said this."""
    session = cubes({"a": [0.0] * len(row), "b": [3.0 - 0.1 * k for k in range(len(row))]}, scene=SCENE)
    assembly = assemble(session, pairs=[("a", "b")])
    verdict = np.array([[WORDS[letter]] for letter in row], dtype=np.uint8)
    told = Detection("fake", assembly.names, assembly.pairs, assembly.motion.times, verdict, covers="intervals", **more)
    return run_effects(plan(SCENE), session, assembly, {"continuous": told})["sweep"]


def test_a_contact_between_two_frames_is_a_hit_in_the_interval_of_its_impact():
    run = swept("..C..", toi={(2, 0): (0.0131, 0.0132)})
    (event,) = run.events
    assert (event.name, event.time, event.end) == ("hit", 0.0132, pytest.approx(0.03))
    assert event.values["impact_low_s"] == 0.0131 and run.output.lanes["a-b"][0].start == pytest.approx(0.01)


def test_without_an_interval_the_step_bounds_the_impact():
    (event,) = swept(".CC").events
    assert (event.values["impact_low_s"], event.values["impact_high_s"]) == (0.0, 0.01) and event.end is None


def test_undecided_steps_are_told_with_their_reason_and_are_no_hits():
    run = swept(".u.", reasons={(1, 0): "budget spent"})
    assert [(e.name, e.values["reason"]) for e in run.events] == [("unresolved", "budget spent")]
    assert run.counters == {"intervals": 3, "unresolved": 1}


def test_a_body_that_passes_through_between_two_frames_is_hit_on_the_way():
    places = [3.0, 2.0, -2.0, -3.0]
    result = compute(cubes({"a": [0.0] * 4, "b": places}, step_ns=2 * 10**9, scene=SCENE), detectors=())
    (event,) = result.effects["sweep"].events
    # The faces are 1 m apart at x = 1: a quarter of the way from 2 to -2, and so a quarter of the step after frame 1.
    assert event.values["impact_low_s"] <= 2.5 <= event.values["impact_high_s"] + 1e-9
    assert event.bodies == ("a", "b") and set(result.detections) == {"continuous"}
