import json
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.import_mutants import MUTANTS, round_trips, survive

from sessions.importers import import_session


def pose(stamp, angles=(0.0, 0.0, 0.0)):
    return {
        "position": {"x": 1.0, "y": 2.0, "z": 3.0},
        "rotation": dict(zip("xyz", angles, strict=True)),
        "timestamp": stamp,
    }


def written(tmp_path, data):
    path = tmp_path / "take.json"
    path.write_text(data if isinstance(data, str) else json.dumps(data), encoding="utf-8")
    return path


def test_stamps_rotations_and_events_come_through(tmp_path):
    angles = (20.0, -75.0, 140.0)
    data = {
        "left": {
            "poses": [pose(1000.5, angles), pose(1011.6)],
            "events": [{"name": "buttondown", "detail": {"id": 1}, "timestamp": 1005}],
        }
    }
    session = import_session("aframe", written(tmp_path, data), proxies=False)
    assert session.frames.stamp_ns.tolist() == [1_000_500_000, 1_011_600_000]
    expected = Rotation.from_euler("YXZ", [angles[1], angles[0], angles[2]], degrees=True).as_quat()
    round_trips(session, tmp_path)
    got = session.frames.quaternion_xyzw[0, 0]
    assert np.allclose(got * np.sign(got[3]), expected * np.sign(expected[3]), atol=1e-15)
    (event,) = session.events
    assert (event.time_ns, event.name, event.body, event.message) == (1_005_000_000, "buttondown", "left", '{"id": 1}')
    assert session.meshes == {}


def press(stamp, button, name="buttondown"):
    return {"name": name, "detail": {"id": button}, "timestamp": stamp}


def test_presses_of_a_vive_wand_become_its_trigger_and_buttons(tmp_path):
    happened = [
        press(5, 1), press(6, 2), press(6, 1, "buttonup"), press(7, 2, "buttonup"), {**press(8, 9), "detail": 3},
    ]  # fmt: skip
    wand = {"poses": [pose(1), pose(9)], "events": happened, "gamepad": {"id": "OpenVR Gamepad", "hand": "right"}}
    session = import_session("aframe", written(tmp_path, {"leftHand": wand, "camera": {"poses": [pose(1)]}}))
    assert list(session.hands) == ["student/left"]
    hand = session.hands["student/left"]
    assert hand.times_ns.tolist() == [5_000_000, 6_000_000, 7_000_000]
    assert hand.buttons == ("trackpad", "trigger", "grip", "menu")
    assert hand.trigger.tolist() == [1.0, 0.0, 0.0]
    assert hand.pressed[:, 2].tolist() == [False, True, False]


def test_repeated_stamps_are_dropped_and_missing_numbers_flagged_and_both_are_said(tmp_path):
    broken = pose(3)
    del broken["position"]["y"]
    session = import_session("aframe", written(tmp_path, {"left": {"poses": [pose(1), pose(1), broken, pose(2)]}}))
    track = session.tracks["left"]
    assert track.times_ns.tolist() == [1_000_000, 3_000_000]
    assert track.valid.tolist() == [True, False]
    assert "left: 2 rows dropped" in session.facts["conversions"]
    assert "left: 1 rows flagged" in session.facts["conversions"]


def left(first, **more):
    return {"left": {"poses": [first], **more}}


NO_DEVICE, NO_TIME, NO_EVENT = (
    "no device with a list of poses",
    "left: pose 0: it has no timestamp",
    "event 0 has no time",
)


ROOT = Path(__file__).resolve().parents[3]

SCRIPT = (ROOT / "replay/guide/VrLabRecorder.cs").read_text("utf-8")


def templates():
    """The header and the kinds of lines as the script writes them."""
    kinds = ("pose,", "trigger,", "{kind},", "scalar,", "gaze,")
    (header,) = re.findall(r'WriteLine\("(kind,[^"]*)"\)', SCRIPT)
    lines = re.findall(r'Invariant\(\$"([^"]*)"\)', SCRIPT)
    return header, *(next(line for line in lines if line.startswith(start)) for start in kinds)


def filled(template, values):
    """One line: ``F6`` is six decimals, ``R`` of a float the shortest text that reads back the same."""

    def cell(match):
        expression, _, form = match.group(1).partition(":")
        value = values[expression]
        return f"{value:.6f}" if form == "F6" else str(np.float32(value)) if form == "R" else str(value)

    return re.sub(r"\{([^{}]*)\}", cell, template)


def pose_values(time, name, position, quaternion, tracked=1):
    parts = {f"p.{axis}": value for axis, value in zip("xyz", position, strict=True)}
    parts |= {f"q.{axis}": value for axis, value in zip("xyzw", quaternion, strict=True)}
    return {"Time.timeAsDouble": time, "Cell(body.name)": name, "Tracked(body)": tracked, **parts}


def test_a_session_that_the_script_writes_is_imported_as_it_was(tmp_path):
    header, pose, trigger, contact, scalar, gaze = templates()
    rng = np.random.default_rng(8)
    count = 40
    turns, places = Rotation.random(count, random_state=8), rng.normal(size=(count, 3)) * [1, 1, 1e-5]
    lines = [header]
    for k in range(count):
        time = k / 90
        lines.append(filled(pose, pose_values(time, "LeftHand", places[k], turns[k].as_quat(), int(k != 3))))
        lines.append(filled(trigger, {"Time.timeAsDouble": time, "hand": "left", "value": k / count}))
        lines.append(filled(scalar, {"Time.timeAsDouble": time, "Cell(name)": "heart rate", "value": 70 + k}))
        eye = pose_values(time, "", places[k], turns[k].as_quat()) | {"Cell(who)": "anna"}
        lines.append(filled(gaze, eye))
        if k in (10, 20):
            kind = {10: "enter", 20: "exit"}[k]
            both = (("LeftHand", "Beaker"), ("Beaker", "LeftHand"))
            lines += [
                filled(contact, {"kind": kind, "Time.timeAsDouble": time, "Cell(body)": a, "Cell(other)": b})
                for a, b in both
            ]
    path = tmp_path / "session.csv"
    path.write_text("\r\n".join(lines) + "\r\n", encoding="utf-8")

    session = import_session("csv", path, proxies=False)
    assert session.names == ("LeftHand",) and session.facts["handedness"] == "left"
    assert "axes unity" in session.facts["conversions"]
    assert session.frames.stamp_ns.tolist() == [round(round(k / 90, 6) * 1e9) for k in range(count)]
    mirror = np.diag([1.0, 1.0, -1.0])
    assert np.allclose(session.frames.position[:, 0], places @ mirror, rtol=1e-7, atol=1e-12)
    got = Rotation.from_quat(session.frames.quaternion_xyzw[:, 0]).as_matrix()
    assert np.allclose(got, mirror @ turns.as_matrix() @ mirror, atol=1e-6)
    assert np.flatnonzero(~session.tracks["LeftHand"].valid).tolist() == [3]
    assert np.allclose(session.hands["student/left"].trigger, np.arange(count) / count)
    assert [(one.body_a, one.body_b, one.phase) for one in session.live_contacts] == [
        ("LeftHand", "Beaker", "enter"),
        ("LeftHand", "Beaker", "exit"),
    ]
    assert "left out" not in session.facts["conversions"]
    assert session.scalars["heart rate"].values.tolist() == [70.0 + k for k in range(count)]
    round_trips(session, tmp_path)
    looked = session.gaze["anna"]
    assert np.allclose(looked.origins, places @ mirror, rtol=1e-7, atol=1e-12)
    assert np.allclose(looked.directions, turns.apply([0, 0, 1]) @ mirror, atol=1e-6)


@pytest.mark.parametrize("count", MUTANTS)
def test_mutants_end_in_a_session_or_one_sentence(tmp_path, count):
    (tmp_path / "take").mkdir()
    take = {name: {"poses": [pose(11.0 * k, (0.0, 0.5, 0.0)) for k in range(30)]} for name in "ab"}
    survive("aframe", written(tmp_path / "take", take), count)
