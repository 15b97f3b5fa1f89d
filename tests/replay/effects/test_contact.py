import pytest
from support.small_worlds import unit_cubes_on_x

from replay.effects.contact import SPEC
from replay.engine import compute
from sessions.model.scene import Scene, SceneBody, SceneEffect

SCENE = Scene(
    bodies=(SceneBody("a"), SceneBody("b"), SceneBody("c")), effects=(SceneEffect("contact", {"between": ["a", "b"]}),)
)
NEAR, FAR = 0.9, 3.0


def run_with_cubes_at(points, **more):
    """A run in which cube b is at these places on X beside cube a; c comes to a in the last frame."""
    count = len(points)
    return compute(
        unit_cubes_on_x({"a": [0] * count, "b": points, "c": [9.0] * (count - 1) + [0.5]}, scene=SCENE), **more
    )


def test_contact_ends_only_at_two_successive_clear_frames():
    """Frames are 10 ms apart. Contact begins in frame 1; single clear frames (2, 5) do not end it, frames 7 and 8 do.

    A contact that never lasts two frames (frame 9) is flicker and has no end.
    """
    result = run_with_cubes_at([FAR, NEAR, FAR, NEAR, NEAR, FAR, NEAR, FAR, FAR, NEAR], detectors=())
    contact = result.effects["contact"]
    event, bump = contact.events
    assert (event.name, event.bodies, event.values) == ("contact", ("a", "b"), {"frames": 6, "flicker": False})
    assert (event.time, event.end) == pytest.approx((0.01, 0.07)) and 0.4 <= event.point[0] <= 0.5
    assert (bump.time, bump.end, bump.values) == (0.09, None, {"frames": 1, "flicker": True})
    ((touch, _),) = contact.output.data.values()
    assert (touch.last_clear_frame, touch.first, touch.stop) == (0, 1, 7)
    assert set(result.detections) == {SPEC.detector} and len(result.assembly.pairs) == 1


def test_contact_effect_is_independent_of_audited_detectors():
    """No detector, the exact one, or one that samples too rarely."""
    requested = ({"detectors": ()}, {"detectors": "exact"}, {"detectors": "discrete[rate_hz=25]", "oracle": "exact"})
    answers = {
        run_with_cubes_at([FAR, NEAR, NEAR, FAR, FAR, NEAR, NEAR], **touch).effects["contact"].output.digest
        for touch in requested
    }
    assert len(answers) == 1
