from types import SimpleNamespace

import numpy as np
import pytest
from support.small_worlds import unit_cubes_on_x

from replay.effects.contact import SPEC
from replay.effects.contact import compute as contacts_of
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
    """No detector is audited, the exact one, or one that samples too rarely; the effect has the same digest."""
    requested = ({"detectors": ()}, {"detectors": "exact"}, {"detectors": "discrete[rate_hz=25]", "oracle": "exact"})
    answers = {
        run_with_cubes_at([FAR, NEAR, NEAR, FAR, FAR, NEAR, NEAR], **touch).effects["contact"].output.digest
        for touch in requested
    }
    assert len(answers) == 1


class Inputs(SimpleNamespace):
    """Inputs of an effect, with as many frames as times."""

    def __len__(self):
        return len(self.times)


def normal_of_contact(points):
    """Normal of a contact of one pair, whose surfaces meet along a curve through these points."""
    touching = SimpleNamespace(
        pair=("a", "b"),
        touching=np.array([False, True, True]),
        known=np.ones(3, dtype=bool),
        section=lambda _: np.stack([points[:-1], points[1:]], axis=1),
    )
    inputs = Inputs(
        times=np.arange(3.0),
        pairs=[("a", "b")],
        contact=lambda _: touching,
        lane_spans=lambda *_: [],
        end=lambda _: None,
    )
    ((contact,),) = contacts_of(inputs).data.values()
    return contact.normal


def test_normal_of_a_contact_is_that_of_its_curve():
    """A loop of 2 mm across the normal (1, 2, 2) / 3, five metres from the origin; a straight curve has no plane."""
    angles = np.linspace(0.0, 2.0 * np.pi, 9)
    first, second, normal = np.array([2.0, 1.0, -2.0]) / 3.0, np.array([2.0, -2.0, 1.0]) / 3.0, [1 / 3, 2 / 3, 2 / 3]
    loop = np.array([5.0, 0.0, 0.0]) + 1e-3 * (np.outer(np.cos(angles), first) + np.outer(np.sin(angles), second))
    assert abs(np.dot(normal_of_contact(loop), normal)) == pytest.approx(1.0)
    assert normal_of_contact(np.outer(angles, first)) is None
