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

    A contact that never lasts two frames (frame 9, the last) is flicker and has no end. Unit cubes overlap from x = 0.4
    to 0.5, where the point is. Other effects get the frames of each contact.
    """
    result = run_with_cubes_at([FAR, NEAR, FAR, NEAR, NEAR, FAR, NEAR, FAR, FAR, NEAR], detectors=())
    contact = result.effects["contact"]
    event, flicker = contact.events
    assert (event.name, event.bodies, event.values) == ("contact", ("a", "b"), {"frames": 6, "flicker": False})
    assert (event.time, event.end) == pytest.approx((0.01, 0.07)) and 0.4 <= event.point[0] <= 0.5
    assert (flicker.time, flicker.end, flicker.values) == (0.09, None, {"frames": 1, "flicker": True})
    ((frames_of_contact, _frames_of_flicker),) = contact.output.data.values()
    assert (frames_of_contact.last_clear_frame, frames_of_contact.first, frames_of_contact.stop) == (0, 1, 7)


def test_contacts_of_declared_pairs_only_are_detected():
    """The scene declares contacts between a and b; c is a body that comes to a, too."""
    result = run_with_cubes_at([FAR, NEAR, NEAR], detectors=())
    assert len(result.assembly.pairs) == 1
    assert set(result.detections) == {SPEC.detector}, "the detector of the effect contact"


def test_contact_effect_is_independent_of_audited_detectors():
    """No detector is audited, the exact one, or one that looks at every fourth frame only: the digest is the same."""
    audits = ({"detectors": ()}, {"detectors": "exact"}, {"detectors": "discrete[rate_hz=25]", "oracle": "exact"})
    digests = {
        run_with_cubes_at([FAR, NEAR, NEAR, FAR, FAR, NEAR, NEAR], **audit).effects["contact"].output.digest
        for audit in audits
    }
    assert len(digests) == 1


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
    """The curve along which two surfaces meet is a circle of 2 mm, five metres from the origin, in a plane.

    The plane is spanned by two unit vectors, and (1, 2, 2) / 3 is across it: the normal, up to its sign.
    """
    angles = np.linspace(0.0, 2.0 * np.pi, 9)
    first, second, normal = np.array([2.0, 1.0, -2.0]) / 3.0, np.array([2.0, -2.0, 1.0]) / 3.0, [1 / 3, 2 / 3, 2 / 3]
    circle = np.array([5.0, 0.0, 0.0]) + 1e-3 * (np.outer(np.cos(angles), first) + np.outer(np.sin(angles), second))
    assert abs(np.dot(normal_of_contact(circle), normal)) == pytest.approx(1.0)


def test_contact_along_a_straight_line_has_no_normal():
    """The curve along which two surfaces meet is straight, so it lies in many planes."""
    assert normal_of_contact(np.outer(np.linspace(0.0, 1.0, 9), [2 / 3, 1 / 3, -2 / 3])) is None
