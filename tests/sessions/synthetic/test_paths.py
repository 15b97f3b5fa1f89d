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
    """20,001 times of a course of COURSES; within 1 us of an interval's end, or 1e-6 of a bound, rounding decides."""
    lower, upper = bounds
    spans = COURSES[name].between(lower, upper, SECONDS)
    starts, ends = np.array([*spans, (np.inf, np.inf)]).T[:, :, None]
    within = ((starts <= TIMES) & (ends >= TIMES)).any(axis=0)
    value = COURSES[name](TIMES)
    edges = (np.abs(TIMES - starts) < 1e-6) | (np.abs(TIMES - ends) < 1e-6)
    near = np.abs(value[:, None] - np.array([lower, upper])).min(axis=1) < 1e-6
    assert (within == (value >= lower) & (value <= upper))[~edges.any(axis=0) & ~near].all()
    assert all(a[1] < b[0] for a, b in itertools.pairwise(spans))
