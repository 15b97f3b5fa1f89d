import dataclasses
import json

import numpy as np
import pytest
from support.small_worlds import cube, framed

from replay.session_info import ClockInfo, session_info
from sessions import Event, Interval, Scene, Status, examine
from sessions.model.scene import Pose, SceneBody

V, L, A, H = int(Status.VALID), int(Status.LOST), int(Status.ABSENT), int(Status.HELD)
MS = 1_000_000


def test_a_clock_counts_the_gaps_that_the_doctor_finds():
    stamps = np.array([0, 10, 20, 36, 66, 97, 107, 117]) * MS
    clock = ClockInfo.of(stamps)
    assert (clock.count, clock.gaps, clock.longest_gap, clock.not_forward) == (8, 1, 0.031, 0)
    assert clock.rate_hz == pytest.approx(100.0) and clock.duration == 0.117
    (gap,) = (one for one in examine(framed(stamps, np.ones((8, 1)))) if one.code == "gap" and not one.body)
    assert gap.count == clock.gaps


def test_a_clock_that_repeats_or_steps_back_is_counted_not_refused():
    clock = ClockInfo.of(np.array([0, 10, 10, 5, 15, 25]) * MS)
    assert clock.not_forward == 2 and clock.rate_hz == pytest.approx(100.0)


def test_a_clock_of_one_stamp_or_none_has_no_rate():
    assert ClockInfo.of(np.array([5])) == ClockInfo(1, 0.0, 0.0, 0, 0.0, 0)
    assert ClockInfo.of(np.zeros(0, np.int64)) == ClockInfo(0, 0.0, 0.0, 0, 0.0, 0)


def test_information_about_a_session_counts_each_body_and_never_judges():
    position = np.full((4, 2, 3), np.nan)
    session = framed(np.arange(4) * 10 * MS, [[V, V], [V, A], [L, V], [H, A]], position)
    scene = Scene("small", (SceneBody("bench", fixed=Pose()), SceneBody("a", proxy=True)))
    session = dataclasses.replace(
        session,
        scene=scene,
        meshes={"a": cube(), "bench": cube(2.0)},
        events=(Event(0, "press"), Event(5, "press"), Event(9, "drop")),
        intervals=(Interval(10 * MS, 30 * MS, "stage", "explore"),),
        facts={"vr_type": "immersive"},
    )
    info = session_info(session)
    assert json.loads(json.dumps(info, allow_nan=False)) == info
    a, b, bench = info["bodies"]
    assert (a["samples"], a["faces"], a["proxy"]) == ({"valid": 2, "lost": 1, "held": 1}, 12, True)
    assert (b["samples"], b["faces"], b["rate_hz"]) == ({"absent": 2, "valid": 2}, None, pytest.approx(50.0))
    assert (bench["name"], bench["fixed"], bench["size"]) == ("bench", True, [2.0, 2.0, 2.0])
    assert info["events"] == {"press": 2, "drop": 1}
    assert info["intervals"] == [{"kind": "stage", "name": "explore", "start": 0.01, "end": 0.03}]
    assert info["frames"]["count"] == 4 and info["facts"] == {"vr_type": "immersive"}


def test_a_session_without_frames_has_information_too():
    info = session_info(framed(np.zeros(0), np.zeros((0, 1))))
    assert info["frames"]["count"] == 0 and info["first_stamp_ns"] is None
