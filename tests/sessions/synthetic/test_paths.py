import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sessions.synthetic.motion_profiles import Polyline, Swing, passes

SECONDS = 7.0
TIMES = np.linspace(0.0, SECONDS, 20_001)
COURSES = {
    "swing": Swing(middle=0.2, amplitude=1.0, period=1.3, start=0.4),
    "slow swing": Swing(middle=0.0, amplitude=1.0, period=30.0, start=2.0),
    "polyline": Polyline((0.5, 1.0, 1.5, 3.0, 4.0, 4.5), (0.3, -1.2, -1.2, 1.1, 0.0, 0.9)),
    "passes": passes([0.5, 3.0, 1.0], [0.2, 0.3, 0.1], 1.0),
}


@pytest.mark.parametrize("name", COURSES)
@given(bounds=st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5)))
def test_the_intervals_hold_exactly_the_times_whose_values_lie_between(name, bounds):
    """A course of COURSES is a value over 7 s; ``between`` gives the intervals in which it lies between two bounds.

    Its value at 20,001 times says the same, but within 1 us of an interval's end or 1e-6 of a bound, where rounding
    decides. Intervals are in order and do not touch.
    """
    lower, upper = bounds
    intervals = COURSES[name].between(lower, upper, SECONDS)
    starts, ends = np.array([*intervals, (np.inf, np.inf)]).T[:, :, None]  # an empty list has a shape too
    in_an_interval = ((starts <= TIMES) & (ends >= TIMES)).any(axis=0)
    values = COURSES[name](TIMES)
    between_bounds = (values >= lower) & (values <= upper)
    near_an_end = ((np.abs(TIMES - starts) < 1e-6) | (np.abs(TIMES - ends) < 1e-6)).any(axis=0)
    near_a_bound = np.abs(values[:, None] - np.array([lower, upper])).min(axis=1) < 1e-6
    assert (in_an_interval == between_bounds)[~near_an_end & ~near_a_bound].all()
    assert all(end < next_start for (_, end), (next_start, _) in itertools.pairwise(intervals))
