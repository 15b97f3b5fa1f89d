from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import STEP_NS, session_of_frames, unit_cubes_on_x

from replay.prepare.session_info import ClockInfo, session_info
from sessions import ScalarTrack, examine
from sessions.model.event import Event, Interval
from sessions.model.scene import Pose, Scene, SceneBody

MILLISECOND_NS = 1_000_000
SECOND_NS = 1_000_000_000


def test_a_clock_counts_the_gaps_that_the_doctor_finds():
    """Frames every 10 ms from 5 s on, but for steps of 16, 30 and 31 ms: only more than three frames are a gap.

    The rate is that of the usual step; the duration is from the first stamp to the last.
    """
    stamps = 5 * SECOND_NS + np.array([0, 10, 20, 36, 66, 97, 107, 117]) * MILLISECOND_NS
    clock = ClockInfo.of(stamps)
    assert (clock.count, clock.gaps, clock.longest_gap, clock.not_forward) == (8, 1, 0.031, 0)
    assert clock.rate_hz == pytest.approx(100.0) and clock.duration == 0.117
    findings = examine(session_of_frames(stamps, np.ones((8, 1))))
    (gap_of_all_bodies,) = (item for item in findings if item.code == "gap" and not item.body)
    assert gap_of_all_bodies.count == clock.gaps


STAMPS_OF_60_HZ = np.arange(300) * SECOND_NS // 60
JITTERED_STAMPS = STAMPS_OF_60_HZ + np.random.default_rng(4).integers(-MILLISECOND_NS, MILLISECOND_NS, size=300)
"""Stamps of 60 Hz, each up to 1 ms early or late."""


def merged_streams(stamps, *delays_ns):
    """Stamps of a camera, and of others each so many nanoseconds later, in order."""
    return np.sort(np.concatenate([stamps, *(stamps + delay for delay in delays_ns)]))


@pytest.mark.parametrize(
    ("stamps", "rate_hz"),
    [
        pytest.param(STAMPS_OF_60_HZ, 60.0, id="one camera"),
        pytest.param(merged_streams(STAMPS_OF_60_HZ, 93_850), 60.0, id="two cameras"),
        pytest.param(merged_streams(STAMPS_OF_60_HZ, 93_850)[:-1], 60.0, id="two cameras, an odd number of frames"),
        pytest.param(merged_streams(STAMPS_OF_60_HZ, 300_000, 600_000), 60.0, id="three cameras"),
        pytest.param(merged_streams(JITTERED_STAMPS, 50_000), 60.0, id="two cameras with jitter"),
        pytest.param(merged_streams(STAMPS_OF_60_HZ, SECOND_NS // 120), 120.0, id="two cameras, stamps midway"),
    ],
)
def test_paired_stamps_are_camera_frames_without_gaps(stamps, rate_hz):
    """Several streams at 60 Hz, 0.05 to 0.6 ms apart, count as one; stamps midway are a stream of 120 Hz.

    They have no gap; without twelve stamps, 33 ms or more, they have one.
    """
    clock = ClockInfo.of(stamps)
    assert clock.rate_hz == pytest.approx(rate_hz, rel=0.02)
    assert clock.gaps == 0
    assert ClockInfo.of(np.delete(stamps, slice(100, 112))).gaps == 1


@pytest.fixture(scope="module")
def info_of_two_cubes():
    """Information about a session whose first of three frames, 10 ms apart, has the stamp of 5 s.

    Cube a moves, b rests. Declared as fixed are a bench, which has no mesh, and b, which was recorded; ghost is
    declared and nothing more. There are a task, three events and two streams of numbers.
    """
    start = 5 * SECOND_NS
    fixed = Pose((0, 0, 0), (0, 0, 0, 1))
    declared = (SceneBody("a"), SceneBody("bench", fixed=fixed), SceneBody("b", fixed=fixed), SceneBody("ghost"))
    made = unit_cubes_on_x({"a": [0, 1, 2], "b": [3, 3, 3]}, first_ns=start, scene=Scene(bodies=declared))
    heart = ScalarTrack([start, start + 1], [60.0, np.nan], "bpm")
    session = replace(
        made,
        intervals=(Interval(start + 10 * MILLISECOND_NS, start + 30 * MILLISECOND_NS, "task", "pour", {}),),
        events=(Event(start, "spill", "", ""), Event(start, "drop", "", ""), Event(start + 1, "drop", "", "")),
        scalars={"heart": heart, "none": ScalarTrack([start], [np.nan], "")},
    )
    return session_info(session)


def test_times_of_a_session_are_counted_from_its_first_frame(info_of_two_cubes):
    """The first of three frames has the stamp of 5 s; a task lasts from 10 to 30 ms after it."""
    assert info_of_two_cubes["first_stamp_ns"] == 5 * SECOND_NS
    assert info_of_two_cubes["frames"]["count"] == 3
    assert info_of_two_cubes["intervals"] == [{"kind": "task", "name": "pour", "start": 0.01, "end": 0.03}]


def test_events_are_counted_by_name_and_scalars_have_a_range(info_of_two_cubes):
    """There are two drops and a spill, listed in order of names; a heart of 60 beats a minute, and a NaN, no value."""
    assert [*info_of_two_cubes["events"].items()] == [("drop", 2), ("spill", 1)]
    assert [(row["name"], row["least"], row["largest"]) for row in info_of_two_cubes["scalars"]] == [
        ("heart", 60.0, 60.0),
        ("none", None, None),
    ]


def test_bodies_of_a_session_are_those_recorded_or_fixed(info_of_two_cubes):
    """A recorded body is not fixed, whatever is declared; what is neither recorded nor fixed is no row.

    Cube a has an edge of 1 m and a pose every 10 ms; the bench has no mesh, so that its faces are unknown.
    """
    rows = info_of_two_cubes["bodies"]
    assert [(row["name"], row["fixed"]) for row in rows] == [("a", False), ("b", False), ("bench", True)]
    a, _, bench = rows
    assert a["rate_hz"] == pytest.approx(SECOND_NS / STEP_NS)
    assert a["samples"] == {"valid": 3}
    assert a["size"] == pytest.approx([1.0, 1.0, 1.0])
    assert not a["proxy"]
    assert bench["faces"] is None
