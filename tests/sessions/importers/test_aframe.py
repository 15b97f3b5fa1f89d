import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.mutants import assert_import_refused, ledger_text, round_trips

from sessions.importers import import_session
from sessions.model.assumption import Subject, assumptions_of


def pose_row(stamp, angles=(0.0, 0.0, 0.0)):
    """A pose at (1, 2, 3) m as A-Frame's recorder writes it; the stamp in ms, angles about x, y, z in degrees."""
    return {
        "position": {"x": 1.0, "y": 2.0, "z": 3.0},
        "rotation": dict(zip("xyz", angles, strict=True)),
        "timestamp": stamp,
    }


def take_file(tmp_path, data):
    """The file take.json with this content."""
    path = tmp_path / "take.json"
    path.write_text(data if isinstance(data, str) else json.dumps(data), encoding="utf-8")
    return path


def test_stamps_rotations_and_events_come_through(tmp_path):
    """Stamps are milliseconds; angles are degrees about x, y and z, applied as YXZ; a button pressed is an event.

    The cup is no wand, of which alone it is known which button is the trigger: the session has no hand. All of it comes
    back from the session's own file.
    """
    x, y, z = 20.0, -75.0, 140.0
    data = {
        "cup": {
            "poses": [pose_row(stamp=1000.5, angles=(x, y, z)), pose_row(stamp=1011.6)],
            "events": [{"name": "buttondown", "detail": {"id": 1}, "timestamp": 1005}],
        }
    }
    session = import_session("aframe", take_file(tmp_path, data))
    assert session.frames.stamp_ns.tolist() == [1_000_500_000, 1_011_600_000]
    expected = Rotation.from_euler("YXZ", [y, x, z], degrees=True).as_quat()
    actual = session.frames.quaternion_xyzw[0, 0]
    # A quaternion and its negative are the same rotation.
    assert np.allclose(actual * np.sign(actual[3]), expected * np.sign(expected[3]), atol=1e-15)
    (event,) = session.events
    assert (event.time_ns, event.name, event.body, event.message) == (1_005_000_000, "buttondown", "cup", '{"id": 1}')
    assert not session.hands
    round_trips(session, tmp_path)


def button_row(stamp, button, name="buttondown"):
    """A button that is pressed or ("buttonup") let go, as A-Frame's recorder writes it; the stamp in ms."""
    return {"name": name, "detail": {"id": button}, "timestamp": stamp}


def test_presses_of_a_vive_wand_become_its_trigger(tmp_path):
    """The trigger, button 1, is pressed at 5 ms and let go at 6; other buttons and a malformed event are ignored.

    The wand is called leftWheel, which decides the hand: not "right", as its gamepad says. The lamp is no wand.
    """
    trigger, menu, unknown = 1, 2, 99
    events = [
        button_row(stamp=5, button=trigger),
        button_row(stamp=6, button=menu),
        button_row(stamp=6, button=trigger, name="buttonup"),
        button_row(stamp=7, button=menu, name="buttonup"),
        button_row(stamp=8, button=unknown),
        {**button_row(stamp=8, button=trigger), "detail": "no button"},
    ]
    wand = {
        "poses": [pose_row(stamp=1), pose_row(stamp=9)],
        "events": events,
        "gamepad": {"id": "OpenVR Gamepad", "hand": "right"},
    }
    session = import_session("aframe", take_file(tmp_path, {"leftWheel": wand, "lamp": {"poses": [pose_row(stamp=1)]}}))
    assert list(session.hands) == ["student/left"]
    hand = session.hands["student/left"]
    assert hand.times_ns.tolist() == [5_000_000, 6_000_000]
    assert hand.trigger.tolist() == [1.0, 0.0]


def test_a_pose_without_a_number_is_lost(tmp_path):
    """The second of two poses lacks y: it is lost, and the first is valid."""
    broken = pose_row(stamp=3)
    del broken["position"]["y"]
    session = import_session("aframe", take_file(tmp_path, {"cup": {"poses": [pose_row(stamp=1), broken]}}))
    assert session.tracks["cup"].valid.tolist() == [True, False]


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ('{"cup": {"poses": [%s]}, "cup": {"poses": [%s]}}', "cup"),
        ('{"recording": {"rod": {"poses": [%s]}}, "recording": {"cup": {"poses": [%s]}}}', "recording"),
        ('{"cup": {"poses": [%s], "poses": [%s]}}', "poses"),
    ],
    ids=["two devices", "two recordings", "two lists"],
)
def test_duplicate_key_in_an_aframe_recording_is_refused(tmp_path, text, name):
    """JSON keeps the last of two equal keys, which would lose the poses of the first in silence."""
    path = take_file(tmp_path, text % (json.dumps(pose_row(stamp=1)), json.dumps(pose_row(stamp=2))))
    assert_import_refused("aframe", path, f"'{name}' stands twice in one object; rename or remove")


def test_poseless_devices_and_repeated_sides_are_accounted_for(tmp_path):
    """Two wands are of the left side: the second gets a number. The device "right" has no "poses" (misspelt).

    The second wand's trigger is pressed and let go at the same 3 ms: only that it is let go counts.
    """

    def wand(*events):
        return {"poses": [pose_row(stamp=1)], "events": events, "gamepad": {"id": "OpenVR Gamepad"}}

    trigger = 1
    data = {
        "leftHand": wand(button_row(stamp=2, button=trigger)),
        "left wheel": wand(button_row(stamp=3, button=trigger), button_row(stamp=3, button=trigger, name="buttonup")),
        "right": {"posez": [pose_row(stamp=1)]},
    }
    session = import_session("aframe", take_file(tmp_path, data))
    assert list(session.hands) == ["student/left", "student/left (2)"]
    assert session.hands["student/left (2)"].trigger.tolist() == [0.0]
    assert "1 of 3 names dropped: without a list of poses" in ledger_text(session)
    assert "trigger student/left (2): 1 of 2 samples dropped: with the stamp of another sample" in ledger_text(session)


def test_rotation_of_four_numbers_is_refused(tmp_path):
    """A-Frame writes angles x, y, z; a rotation with a w is another program's."""
    rotated = {**pose_row(stamp=1), "rotation": {"x": 0.0, "y": 0.6, "z": 0.0, "w": 0.8}}
    assert_import_refused(
        "aframe",
        take_file(tmp_path, {"cup": {"poses": [rotated]}}),
        "cup: poses: a rotation has a w: it is a quaternion",
    )


@pytest.mark.parametrize(
    ("largest_angle", "source"), [(3.1, "guessed, not sure"), (31.0, "the format"), (0.0, "the format")]
)
def test_angles_that_would_fit_radians_are_a_doubt(tmp_path, largest_angle, source):
    """A-Frame's format says degrees, but some write radians: ten angles go from 0 to ``largest_angle``.

    3.1 may be radians or degrees, 31 is no angle in radians, 0 is 0 in both. ``source``: who says that it is degrees.
    """
    poses = [pose_row(stamp=k, angles=(0.0, angle, 0.0)) for k, angle in enumerate(np.linspace(0, largest_angle, 10))]
    session = import_session("aframe", take_file(tmp_path, {"cup": {"poses": poses}}))
    (unit,) = (row for row in assumptions_of(session.facts) if row.subject is Subject.ANGLE_UNIT)
    assert unit.value == "deg"
    assert source in unit.sentence
