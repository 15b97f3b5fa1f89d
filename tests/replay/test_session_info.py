import numpy as np
import pytest
from support.small_worlds import framed

from replay.session_info import ClockInfo
from sessions import examine

MS = 1_000_000


def test_a_clock_counts_the_gaps_that_the_doctor_finds():
    stamps = np.array([0, 10, 20, 36, 66, 97, 107, 117]) * MS
    clock = ClockInfo.of(stamps)
    assert (clock.count, clock.gaps, clock.longest_gap, clock.not_forward) == (8, 1, 0.031, 0)
    assert clock.rate_hz == pytest.approx(100.0) and clock.duration == 0.117
    (gap,) = (one for one in examine(framed(stamps, np.ones((8, 1)))) if one.code == "gap" and not one.body)
    assert gap.count == clock.gaps
