import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.analytic_cases import Dips, Turning

from sessions.geometry.rotations import quaternion_about
from sessions.synthetic.motion_profiles import Polyline, Swing, passes

TURN = tuple(quaternion_about((0.0, 1.0, 0.0), 1.0).tolist())


SECONDS = 7.0
TIMES = np.linspace(0.0, SECONDS, 20_001)
COURSES = {
    "swing": Swing(0.2, 1.0, 1.3, 0.4), "slow swing": Swing(0.0, 1.0, 30.0, 2.0),
    "polyline": Polyline((0.5, 1.0, 1.5, 3.0, 4.0, 4.5), (0.3, -1.2, -1.2, 1.1, 0.0, 0.9)),
    "passes": passes([0.5, 3.0, 1.0], [0.2, 0.3, 0.1], 1.0), "dips": Dips((1.0, 3.0, 5.0), (-0.1, 0.2, 0.0), 0.4),
}  # fmt: skip


def sampled(course, low, high):
    value = course(TIMES)
    return (value >= low) & (value <= high)


@pytest.mark.parametrize("name", COURSES)
@given(bounds=st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5)))
def test_the_intervals_hold_exactly_the_times_whose_values_lie_between(name, bounds):
    low, high = bounds
    if name == "dips":
        low = -1.0
    spans = COURSES[name].between(low, high, SECONDS)
    within = np.zeros(len(TIMES), dtype=bool)
    edges = np.zeros(len(TIMES), dtype=bool)
    for start, end in spans:
        within |= (start <= TIMES) & (end >= TIMES)
        edges |= (np.abs(TIMES - start) < 1e-6) | (np.abs(TIMES - end) < 1e-6)
    near = np.abs(COURSES[name](TIMES)[:, None] - np.array([low, high])).min(axis=1) < 1e-6
    assert (within == sampled(COURSES[name], low, high))[~edges & ~near].all()
    assert all(a[1] < b[0] for a, b in itertools.pairwise(spans))


@given(st.floats(0.0, 0.7), st.floats(3.0, 12.0), st.floats(0.0, 1.0))
def test_a_turning_is_between_in_every_half_turn(reach, speed, start):
    turning = Turning(speed, np.pi, start)
    angle = turning(TIMES)
    folded = (angle + np.pi / 2) % np.pi - np.pi / 2
    within = np.zeros(len(TIMES), dtype=bool)
    for a, b in turning.between(-reach, reach, SECONDS):
        within |= (a <= TIMES) & (b >= TIMES)
    clear = np.abs(np.abs(folded) - reach) > 1e-6
    assert (within == (np.abs(folded) <= reach))[clear].all()
