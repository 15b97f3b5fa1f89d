"""Resting contact: a pair that has not moved since a search found nothing is not searched again.

A search that is left out leaves the verdict NOT_FOUND: it neither invents a contact nor calls a pair clear.
"""

from typing import Final

import numpy as np

from cdcore.kernels.compiling import kernel
from cdcore.numerics import EPS, FloatArray
from cdcore.search.features import Features

PROBE: Final = 192
"""Evaluations in which a warm start has found its valley: a few steps to 28 neighbours each."""

ROUNDING_ULPS: Final = 4096.0
"""In eps of sizes and distances: a thing that a hand carries seems to move by this much against the hand. Two poses are
rounded, and one relative pose is computed for each of two frames: below 1000 eps together. At 1 m it is a picometre."""


def lengths_at_rest(first: Features, second: Features, fraction: float) -> tuple[float, float, float]:
    """Metres: size of the first body, of both, and how far a pair has moved that counts as new.

    ``fraction`` is in diameters of the mean face of the finer mesh, which limits how small a contact can be. With the
    mean of both, a ball of 512 faces was searched in brief for 18 frames on its way to a plate of 12, and the first two
    frames of their contact were missed.
    """
    news = fraction * 2.0 * min(first.mean_radius, second.mean_radius)
    return first.size, first.size + second.size, news


@kernel
def distance_moved(pose: FloatArray, before: FloatArray, size: float) -> float:
    """Farthest any point within ``size`` of the first body's origin can have moved between two relative poses."""
    rotation_change = move = 0.0
    for k in range(9):
        change = pose[k] - before[k]
        rotation_change += change * change
    for k in range(9, 12):
        moved = pose[k] - before[k]
        move += moved * moved
    return float(np.sqrt(rotation_change) * size + np.sqrt(move))


@kernel
def budget_at_rest(
    pose: FloatArray, searched: FloatArray, last_relative: FloatArray, lengths: tuple[float, float, float], whole: int
) -> int:
    """Evaluations, of the ``whole`` budget, at a relative pose (13,); 0: all of it found nothing here before.

    ``searched``: relative pose at which the whole budget found nothing; ``last_relative``: relative pose at the search
    before; not a number where there is none. A pair that comes to rest at a new pose is searched there once.
    """
    size, sizes, news = lengths
    rounding = ROUNDING_ULPS * EPS * (sizes + max(pose[12], searched[12], last_relative[12]))
    moved = distance_moved(pose, searched, size)
    if moved <= rounding:
        return 0
    came_to_rest = distance_moved(pose, last_relative, size) <= rounding
    # Written so that what is not a number has moved.
    return whole if came_to_rest or not moved < news else min(whole, PROBE)
