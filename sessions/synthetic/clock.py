"""Stamps of frames as headsets give them: never early, never repeated, rarely even."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class Clock:
    """How far a frame's stamp strays from the rate.

    Parameters
    ----------
    jitter_s : standard deviation of a stamp about its place, seconds.
    gap_probability : chance that a step leaves frames out.
    longest_gap_s : no step is longer.
    shortest_step_s : no step is shorter.
    """

    jitter_s: float = 0.0
    gap_probability: float = 0.0
    longest_gap_s: float = 0.128
    shortest_step_s: float = 0.0023


CLOCKS = {
    "even": Clock(),
    "steady": Clock(jitter_s=0.0004, gap_probability=0.004, longest_gap_s=0.034),
    "browser": Clock(jitter_s=0.0019, gap_probability=0.035),
}
"""Name -> clock. ``browser`` has the gaps of three A-Frame recordings at 89 Hz: 44-121 steps above 1.5 times the median
in 15-30 s, steps from 2.3 to 128 ms. ``steady`` is a native program that rarely drops a frame."""


def stamps(seconds: float, rate_hz: float, clock: Clock, rng: np.random.Generator) -> NDArray[np.int64]:
    """Stamps in nanoseconds from 0 up to ``seconds``, strictly increasing.

    Raises
    ------
    ValueError
        A rate or length that is not positive, or a rate whose period is below the shortest step.
    """
    if not (seconds > 0.0 and rate_hz > 0.0):
        raise ValueError(f"{seconds} s at {rate_hz} Hz is no recording; both must be positive")
    period = 1.0 / rate_hz
    if clock.jitter_s > 0.0 and period < clock.shortest_step_s:
        raise ValueError(
            f"{rate_hz} Hz needs steps below {clock.shortest_step_s} s; lower the rate or use clock 'even'"
        )
    most = int(np.floor(seconds * rate_hz)) + 1
    places = np.concatenate([[0], np.cumsum(_periods(most - 1, period, clock, rng))])
    places = places[places < most]
    reach = max(0.0, (period - clock.shortest_step_s) / 2.0)
    stray = np.clip(rng.normal(0.0, 1.0, len(places)) * clock.jitter_s, -reach, reach)
    stray[0] = 0.0
    times = np.rint((places * period + stray) * 1e9).astype(np.int64)
    return times[times <= round(seconds * 1e9)]


def _periods(count: int, period: float, clock: Clock, rng: np.random.Generator) -> NDArray[np.int64]:
    """Whole periods from each frame to the next: 1, or more where frames are left out."""
    longest = max(2, int((clock.longest_gap_s + clock.shortest_step_s) / period) - 1)
    gap = rng.random(count) < clock.gap_probability
    length = np.minimum(1 + rng.geometric(0.75, count), longest)
    return np.where(gap, length, 1).astype(np.int64)
