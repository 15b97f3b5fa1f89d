"""Times at which a coordinate lies between two values agree with the coordinate itself at many times."""

from itertools import pairwise

import numpy as np
import pytest

from sessions.synthetic.motion_profiles import Polyline, Swing, joined_intervals, passes

SECONDS = 5.0
PROFILES = {
    "swing": Swing(middle=0.2, amplitude=0.5, period=1.7, start=0.4),
    "swing that starts late": Swing(middle=-0.1, amplitude=0.3, period=4.0, start=9.0),
    "polyline": Polyline((0.5, 1.0, 2.0, 2.5, 4.0), (0.0, 0.6, 0.6, -0.4, 0.5)),
    "passes": passes([1.0, 0.5], [0.3, 0.7], reach=0.4),
}
RANGES = [(-0.2, 0.3), (0.1, 9.0), (-9.0, 0.1), (-9.0, 9.0), (0.6, 0.6), (2.0, 3.0), (-3.0, -2.0), (0.3, 0.1)]


@pytest.mark.parametrize("name", PROFILES)
def test_intervals_are_where_the_value_lies_between(name):
    """``between`` gives the intervals of 5 s in which a value of PROFILES lies between two bounds, here each of RANGES.

    The value itself, at a time a millisecond, says the same, but within 0.1 ms of an end. Intervals do not touch.
    """
    profile, times = PROFILES[name], np.linspace(0.0, SECONDS, 5001) + 1e-5
    times = times[times < SECONDS]
    values = profile(times)
    for lower, upper in RANGES:
        intervals = profile.between(lower, upper, SECONDS)
        assert all(0.0 <= start <= end <= SECONDS for start, end in intervals)
        assert all(end < start for (_, end), (start, _) in pairwise(intervals))
        expected = (lower <= values) & (values <= upper)
        inside, near_end = np.zeros((2, len(times)), dtype=bool)
        for start, end in intervals:
            inside |= (start <= times) & (times <= end)
            near_end |= (np.abs(times - start) < 1e-4) | (np.abs(times - end) < 1e-4)
        assert np.array_equal(inside[~near_end], expected[~near_end]), (lower, upper)


def test_swing_begins_at_its_largest_value():
    """A swing about 0.2 by 0.5 with a period of 2 s starts at 1 s with 0.7, and is at -0.3 half a period later."""
    swing = Swing(middle=0.2, amplitude=0.5, period=2.0, start=1.0)
    assert swing(np.array([1.0, 1.5, 2.0])) == pytest.approx([0.7, 0.2, -0.3])
    # The value is touched at the top of each period alone: two instants in 4 s.
    assert [start for start, _ in swing.between(0.7, 1.0, 4.0)] == pytest.approx([1.0, 3.0])


def test_passes_rest_and_cross_at_their_speeds():
    """From 0.4 m to -0.4 m at 1 m/s (0.8 s) after a rest of 0.3 s, and back at 0.5 m/s (1.6 s) after one of 0.7 s."""
    profile = passes([1.0, 0.5], [0.3, 0.7], reach=0.4)
    assert profile.times == pytest.approx((0.0, 0.3, 1.1, 1.8, 3.4))
    assert profile.values == pytest.approx((0.4, 0.4, -0.4, -0.4, 0.4))


def test_intervals_are_cut_to_the_recording_and_joined():
    """A recording of 4 s: intervals lie before and behind it, two reach over its ends, and two touch at 2 s.

    Those outside are dropped, those over an end are cut to 0 to 4 s, and those that touch or overlap become one.
    """
    spans = [(2.0, 2.5), (-2.0, -1.0), (1.0, 2.0), (3.0, 9.0), (-1.0, 0.5), (1.2, 1.3), (5.0, 6.0)]
    assert joined_intervals(spans, 4.0) == [(0.0, 0.5), (1.0, 2.5), (3.0, 4.0)]
