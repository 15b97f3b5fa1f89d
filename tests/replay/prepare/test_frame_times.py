"""A frame lasts until the next, or the median step before a gap and at the end."""

import numpy as np
import pytest

from replay.prepare.frame_times import frame_ends, frame_rate


@pytest.mark.parametrize(
    ("times", "ends"),
    [
        pytest.param([0.0, 0.01, 0.02, 5.0], [0.01, 0.02, 0.02 + 0.01, 5.0 + 0.01], id="a gap of 4.98 s"),
        pytest.param([0.0, 0.01, 0.05, 0.06, 0.07], [0.01, 0.05, 0.06, 0.07, 0.07 + 0.01], id="a step of 40 ms"),
        pytest.param([0.0, 1.0, 2.0, 4.0], [1.0, 2.0, 4.0, 4.0 + 1.0], id="a step of two median steps"),
        pytest.param([0.0, 1.0, 2.0, 4.5], [1.0, 2.0, 2.0 + 1.0, 4.5 + 1.0], id="a gap of 2.5 median steps"),
        pytest.param([0.0, 1.0, 2.5, 9.0], [1.0, 2.5, 2.5 + 1.5, 9.0 + 1.5], id="unequal steps, the median is 1.5 s"),
        pytest.param([3.0], [3.0], id="one frame"),
        pytest.param([], [], id="no frame"),
    ],
)
def test_frame_lasts_until_the_next_unless_a_gap_follows(times, ends):
    """Seconds. Before a gap and at the end a frame lasts the median step; a gap is more than 40 ms and two such steps.

    A single frame has no step and lasts no time.
    """
    assert frame_ends(np.array(times)) == pytest.approx(ends)


def test_frame_rate_is_that_of_the_typical_step():
    """Steps of 0.02 s are 50 a second; a single frame has no step, and a rate beyond all limits."""
    assert frame_rate(np.array([0.0, 0.02, 0.04])) == pytest.approx(50.0)
    assert frame_rate(np.zeros(1)) == np.inf
