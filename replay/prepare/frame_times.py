"""The rate of a recording, and when a frame is over: one definition for every output."""

from math import inf
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray
from sessions.doctor.timing import typical_step
from sessions.model.constants import BRIDGE_NS

LONGEST_GAP_STEPS: Final = 2.0
"""A next frame that is farther away than this many usual steps, and than what is bridged, comes after a gap."""


def frame_rate(times: FloatArray) -> float:
    """Return the frames per second of a recording with these times (T,), by its typical step; infinite of one frame."""
    step = typical_step(times)
    return 1.0 / step if step else inf


def frame_ends(times: FloatArray) -> FloatArray:
    """Seconds at which each frame is over, (T,), of the seconds ``times`` (T,) of all frames.

    A frame lasts until the next one. The last, and one before a gap, lasts the median step. So a contact from frame a
    to frame b begins at ``times[a]`` and ends at ``frame_ends(times)[b]``: at the first frame without it.

    Examples
    --------
    >>> frame_ends(np.array([0.0, 0.01, 0.02, 5.0])).round(3).tolist()
    [0.01, 0.02, 0.03, 5.01]
    """
    if len(times) < 2:
        return times.copy()
    steps = np.diff(times)
    usual_step = float(np.median(steps))
    end_times = times + usual_step
    is_short_step = steps <= max(BRIDGE_NS / 1e9, LONGEST_GAP_STEPS * usual_step)
    end_times[:-1] = np.where(is_short_step, times[1:], end_times[:-1])
    return end_times
