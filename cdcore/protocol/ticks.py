"""The clock of a fixed step: a frame is looked at when it is the first at or after a tick ``k / rate_hz``."""

from __future__ import annotations

from typing import Final

import numpy as np

from cdcore.numerics import BoolArray, FloatArray

TICK_SLACK: Final = 1e-6
"""A frame up to a microsecond before a tick counts as at it: stamps are whole nanoseconds, and k/rate is rounded."""


def looks_of(times: FloatArray, rate_hz: float, before: float = -np.inf) -> tuple[BoolArray, float]:
    """Which frames are looked at, (T,), and the number of the last tick, which is ``before`` of the next block.

    Parameters
    ----------
    times : (T,) seconds, increasing.
    rate_hz : ticks per second.
    before : number of the last tick that had a look; minus infinity: none, so that the first frame has one.
    """
    if not len(times):
        return np.zeros(0, dtype=np.bool_), before
    ticks = np.floor((times + TICK_SLACK) * rate_hz)
    return np.diff(ticks, prepend=before) > 0, float(ticks[-1])


def looks_at(times: FloatArray, frame: int, rate_hz: float) -> bool:
    """Whether one frame of a whole motion is looked at."""
    first = max(0, frame - 1)
    looks, _ = looks_of(times[first : frame + 1], rate_hz)
    return frame == 0 or bool(looks[-1])
