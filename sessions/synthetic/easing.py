"""How a share of the way grows with a share of the time, and the time at which a given share is reached."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.glassware.profile import solved


def minimum_jerk(share_of_time: ArrayLike) -> NDArray[np.float64]:
    """Share of the way of a reach between rests: 10 u^3 - 15 u^4 + 6 u^5, held outside [0, 1].

    Source: Flash and Hogan, "The coordination of arm movements", J. Neuroscience 5 (1985) 1688, eq. 4: people move
    a hand from point to point so that the integral of the squared jerk is least.
    """
    u = np.clip(np.asarray(share_of_time, dtype=np.float64), 0.0, 1.0)
    share: NDArray[np.float64] = u * u * u * (10.0 + u * (6.0 * u - 15.0))
    return share


def minimum_jerk_inverse(share_of_way: float) -> float:
    """Share of the time at which a minimum-jerk reach has come this share of its way."""
    if not 0.0 <= share_of_way <= 1.0:
        raise ValueError(f"a share of the way lies between 0 and 1, not {share_of_way}")
    if share_of_way in (0.0, 1.0):
        return share_of_way  # flat there: many times come within rounding of the end
    return solved(lambda time: float(minimum_jerk(time)) - share_of_way, 0.0, 1.0)


def knock(share_of_time: ArrayLike) -> NDArray[np.float64]:
    """There and back without a rest at the far end: sin^2(pi u) on [0, 1], 0 outside.

    Unlike two reaches put together, which rest at the turning point, this turns as a tapping finger does.
    """
    u = np.clip(np.asarray(share_of_time, dtype=np.float64), 0.0, 1.0)
    share: NDArray[np.float64] = np.sin(np.pi * u) ** 2
    return share


def knock_interval(share_of_way: float) -> tuple[float, float] | None:
    """Shares of time between which a knock is at least this far out; ``None`` where it never is."""
    if share_of_way > 1.0:
        return None
    if share_of_way <= 0.0:
        return 0.0, 1.0
    start = math.asin(math.sqrt(share_of_way)) / math.pi
    return start, 1.0 - start
