"""A frame lasts until the next, or the median step before a gap and at the end."""

import numpy as np
import pytest

from replay.prepare.frame_times import frame_ends, frame_rate


@pytest.mark.parametrize(
    ("times", "ends"),
    [
        ([0.0, 0.01, 0.02, 5.0], [0.01, 0.02, 0.03, 5.01]),
        ([0.0, 0.01, 0.05, 0.06, 0.07], [0.01, 0.05, 0.06, 0.07, 0.08]),
        ([0.0, 1.0, 2.0, 4.0], [1.0, 2.0, 4.0, 5.0]),
        ([0.0, 1.0, 2.0, 4.5], [1.0, 2.0, 3.0, 5.5]),
        ([3.0], [3.0]),
        ([], []),
    ],
    ids=["gap", "40 ms are bridged", "two slow steps", "more than two", "one frame", "none"],
)
def test_frame_lasts_until_the_next_unless_a_gap_follows(times, ends):
    """Seconds; a gap is longer than 40 ms and than two median steps."""
    assert frame_ends(np.array(times)) == pytest.approx(ends)


def test_frame_rate_is_that_of_the_typical_step():
    """Steps of 0.02 s are 50 a second; a single frame has no step."""
    assert frame_rate(np.array([0.0, 0.02, 0.04])) == pytest.approx(50.0) and frame_rate(np.zeros(1)) == np.inf
