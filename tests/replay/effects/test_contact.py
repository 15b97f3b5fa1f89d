import numpy as np
import pytest
from support.small_worlds import cubes

from replay.effects.contact import SPEC
from replay.pipeline.engine import compute
from sessions.model.scene import Scene, SceneBody, SceneEffect

SCENE = Scene(
    bodies=(SceneBody("a"), SceneBody("b"), SceneBody("c")), effects=(SceneEffect("contact", {"between": ["a", "b"]}),)
)
NEAR, FAR = 0.9, 3.0


def run(places, **more):
    count = len(places)
    return compute(cubes({"a": [0] * count, "b": places, "c": [9.0] * (count - 1) + [0.5]}, scene=SCENE), **more)


def test_every_contact_is_kept_and_ends_with_two_clear_frames_and_flicker_is_a_column():
    result = run([FAR, NEAR, FAR, NEAR, NEAR, FAR, NEAR, FAR, FAR, NEAR], detectors=())
    event, bump = result.effects["contact"].events
    assert (event.name, event.bodies, event.values) == ("contact", ("a", "b"), {"frames": 6, "flicker": False})
    assert (event.time, event.end) == pytest.approx((0.01, 0.07))
    assert (bump.time, bump.end, bump.values) == (0.09, None, {"frames": 1, "flicker": True})


def test_only_the_declared_pair_is_looked_at_by_the_detector_that_contact_names():
    result = run([FAR, NEAR, NEAR], detectors=())
    assert set(result.detections) == {SPEC.detector} and len(result.assembly.pairs) == 1


def test_a_contact_stands_where_the_surfaces_met_and_lasts_to_the_end_of_the_recording():
    (event,) = run([FAR, FAR, NEAR, NEAR], detectors=()).effects["contact"].events
    assert event.end is None and event.point is not None and 0.4 <= event.point[0] <= 0.5


def test_touches_remember_the_last_clear_frame():
    touches = run([FAR, FAR, NEAR, NEAR], detectors=()).effects["contact"].output.data
    ((touch,),) = touches.values()
    assert (touch.before, touch.first, touch.stop) == (1, 2, 4)


def test_the_answer_is_the_same_whoever_else_is_audited():
    places = [FAR, NEAR, NEAR, FAR, FAR, NEAR, NEAR]
    alone = run(places, detectors=()).effects["contact"].output.digest
    assert run(places, detectors="discrete[rate_hz=25]", oracle="exact").effects["contact"].output.digest == alone
    assert np.array_equal(run(places, detectors="exact").effects["contact"].output.digest, alone)
