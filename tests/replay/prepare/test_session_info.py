import numpy as np
import pytest
from support.small_worlds import framed

from replay.prepare.session_info import ClockInfo
from sessions import examine

MS = 1_000_000


def test_a_clock_counts_the_gaps_that_the_doctor_finds():
    stamps = np.array([0, 10, 20, 36, 66, 97, 107, 117]) * MS
    clock = ClockInfo.of(stamps)
    assert (clock.count, clock.gaps, clock.longest_gap, clock.not_forward) == (8, 1, 0.031, 0)
    assert clock.rate_hz == pytest.approx(100.0) and clock.duration == 0.117
    (gap,) = (item for item in examine(framed(stamps, np.ones((8, 1)))) if item.code == "gap" and not item.body)
    assert gap.count == clock.gaps


SECOND = 1_000_000_000
FRAMES = np.arange(300) * SECOND // 60
JITTER = np.random.default_rng(4).integers(-MS, MS, size=300)


@pytest.mark.parametrize(
    ("stamps", "rate"),
    [
        (np.sort(np.concatenate([FRAMES, FRAMES + 93_850])), 60.0),
        (np.sort(np.concatenate([FRAMES, FRAMES + 93_850]))[:-1], 60.0),
        (np.sort(np.concatenate([FRAMES, FRAMES + 300_000, FRAMES + 600_000])), 60.0),
        (np.sort(np.concatenate([FRAMES + JITTER, FRAMES + JITTER + 50_000])), 60.0),
        (np.sort(np.concatenate([FRAMES, FRAMES + SECOND // 120])), 120.0),
        (FRAMES, 60.0),
    ],
    ids=["two cameras", "an odd number", "three cameras", "with jitter", "between each other", "one"],
)
def test_paired_stamps_are_camera_frames_without_gaps(stamps, rate):
    clock = ClockInfo.of(stamps)
    assert clock.rate_hz == pytest.approx(rate, rel=0.02) and clock.gaps == 0
    assert ClockInfo.of(np.delete(stamps, slice(100, 112))).gaps == 1
