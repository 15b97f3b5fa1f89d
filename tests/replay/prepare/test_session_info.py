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
    """Frames every 10 ms from 5 s on; 31 ms are a gap, 16 and 30 ms are not."""
    stamps = 5 * SECOND_NS + np.array([0, 10, 20, 36, 66, 97, 107, 117]) * MILLISECOND_NS
    clock = ClockInfo.of(stamps)
    assert (clock.count, clock.gaps, clock.longest_gap, clock.not_forward) == (8, 1, 0.031, 0)
    assert clock.rate_hz == pytest.approx(100.0) and clock.duration == 0.117
    (gap,) = (
        item for item in examine(session_of_frames(stamps, np.ones((8, 1)))) if item.code == "gap" and not item.body
    )
    assert gap.count == clock.gaps


STAMPS_OF_60_HZ = np.arange(300) * SECOND_NS // 60
JITTER_OF_1_MS = np.random.default_rng(4).integers(-MILLISECOND_NS, MILLISECOND_NS, size=300)


@pytest.mark.parametrize(
    ("stamps", "rate"),
    [
        (np.sort(np.concatenate([STAMPS_OF_60_HZ, STAMPS_OF_60_HZ + 93_850])), 60.0),
        (np.sort(np.concatenate([STAMPS_OF_60_HZ, STAMPS_OF_60_HZ + 93_850]))[:-1], 60.0),
        (np.sort(np.concatenate([STAMPS_OF_60_HZ, STAMPS_OF_60_HZ + 300_000, STAMPS_OF_60_HZ + 600_000])), 60.0),
        (np.sort(np.concatenate([STAMPS_OF_60_HZ + JITTER_OF_1_MS, STAMPS_OF_60_HZ + JITTER_OF_1_MS + 50_000])), 60.0),
        (np.sort(np.concatenate([STAMPS_OF_60_HZ, STAMPS_OF_60_HZ + SECOND_NS // 120])), 120.0),
        (STAMPS_OF_60_HZ, 60.0),
    ],
    ids=["two cameras", "an odd number", "three cameras", "with jitter", "between each other", "one"],
)
def test_paired_stamps_are_camera_frames_without_gaps(stamps, rate):
    """Several streams at 60 Hz, 0.05 to 0.6 ms apart, count as one; stamps midway are a stream of 120 Hz."""
    clock = ClockInfo.of(stamps)
    assert clock.rate_hz == pytest.approx(rate, rel=0.02) and clock.gaps == 0
    assert ClockInfo.of(np.delete(stamps, slice(100, 112))).gaps == 1


def test_contents_of_a_session_are_counted_from_its_first_frame():
    """Stamps begin at second 5; times of the answer count from there. A NaN is no value of a scalar.

    The declared bodies: the bench is fixed, b fixed and recorded, and ghost neither.
    """
    fixed = Pose((0, 0, 0), (0, 0, 0, 1))
    declared = (SceneBody("a"), SceneBody("bench", fixed=fixed), SceneBody("b", fixed=fixed), SceneBody("ghost"))
    scene = Scene(bodies=declared)
    start = 5 * SECOND_NS
    made = unit_cubes_on_x({"a": [0, 1, 2], "b": [3, 3, 3]}, first_ns=start, scene=scene)
    heart = ScalarTrack([start, start + 1], [60.0, np.nan], "bpm")
    session = replace(
        made,
        intervals=(Interval(start + 10 * MILLISECOND_NS, start + 30 * MILLISECOND_NS, "task", "pour", {}),),
        events=(Event(start, "spill", "", ""), Event(start, "drop", "", ""), Event(start + 1, "drop", "", "")),
        scalars={"heart": heart, "none": ScalarTrack([start], [np.nan], "")},
    )
    info = session_info(session)
    assert info["first_stamp_ns"] == start and info["frames"]["count"] == 3
    assert info["intervals"] == [{"kind": "task", "name": "pour", "start": 0.01, "end": 0.03}]
    assert [*info["events"].items()] == [("drop", 2), ("spill", 1)]
    assert [(row["least"], row["largest"]) for row in info["scalars"]] == [(60.0, 60.0), (None, None)]
    bodies = {row["name"]: row for row in info["bodies"]}
    fixed_by_name = [(row["name"], row["fixed"]) for row in info["bodies"]]
    assert fixed_by_name == [("a", False), ("b", False), ("bench", True)]
    assert bodies["a"]["rate_hz"] == pytest.approx(SECOND_NS / STEP_NS)
    assert bodies["a"]["samples"] == {"valid": 3} and bodies["a"]["size"] == pytest.approx([1.0, 1.0, 1.0])
    assert not bodies["a"]["proxy"] and bodies["bench"]["faces"] is None
