"""Resting contact: a pair that has not moved since a search found nothing is not searched again.

A search that is left out leaves the verdict NOT_FOUND: it neither invents a contact nor calls a pair clear.
"""

from typing import Final

import numpy as np

from cdcore.kernels.box_axes import pose_seen_from
from cdcore.kernels.compiling import kernel
from cdcore.numerics import EPS, FloatArray
from cdcore.search.features import Features

PROBE: Final = 192
"""Evaluations in which a warm start has found its valley: a few steps to 28 neighbours each."""

ROUNDING_ULPS: Final = 4096.0
"""In eps of sizes and distances: a thing that a hand carries seems to move by this much against the hand. Two poses are
rounded, and one relative pose is computed for each of two frames: below 1000 eps together. At 1 m it is a picometre."""


@kernel
def relative_pose(
    frame: int, first: int, second: int, rotations: FloatArray, translations: FloatArray, pose: FloatArray
) -> None:
    """``pose`` (13,): of the first body in the second's frame, rotation by rows, then translation; last the largest
    coordinate of both places.
    """
    turn, move = np.empty((3, 3)), np.empty(3)
    place_a, place_b = translations[frame, first], translations[frame, second]
    pose_seen_from(rotations[frame, second], place_b, rotations[frame, first], place_a, turn, move)
    pose[12] = 0.0
    for i in range(3):  # assigned as slices, arrays took 2.5 s to compile, not 0.3 (2026-11)
        for j in range(3):
            pose[3 * i + j] = turn[i, j]
        pose[9 + i], pose[12] = move[i], max(pose[12], abs(place_a[i]), abs(place_b[i]))


@kernel
def distance_moved(pose: FloatArray, before: FloatArray, size: float) -> float:
    """Farthest any point within ``size`` of the first body's origin can have moved between two relative poses."""
    turn = move = 0.0
    for k in range(9):
        turn += (pose[k] - before[k]) ** 2
    for k in range(9, 12):
        move += (pose[k] - before[k]) ** 2
    return float(np.sqrt(turn) * size + np.sqrt(move))


@kernel
def budget_at_rest(
    poses: tuple[FloatArray, FloatArray, FloatArray], size: float, sizes: float, news: float, whole: int
) -> int:
    """As ``RestingContact.budget``, of the pose now, the one searched and the one seen; ``news`` in metres."""
    pose, searched, seen = poses
    rounding = ROUNDING_ULPS * EPS * (sizes + max(pose[12], searched[12], seen[12]))
    moved = distance_moved(pose, searched, size)
    if moved <= rounding:
        return 0
    came_to_rest = distance_moved(pose, seen, size) <= rounding
    return whole if came_to_rest or not moved < news else min(whole, PROBE)


class RestingContact:
    """Decides how much to search a pair that rests, or nearly rests, against each other.

    A pair that has moved farther than ``share`` counts as new; in diameters of the mean face of the finer mesh. The
    finer mesh limits how small a contact can be. With the mean of both, a ball of 512 faces was searched in brief for
    18 frames on its way to a plate of 12, and the first two frames of their contact were missed.
    """

    def __init__(self, first: Features, second: Features, share: float) -> None:
        news = share * 2.0 * min(first.mean_radius, second.mean_radius)
        self._lengths = first.size, first.size + second.size, news

    def budget(self, pose: FloatArray, searched: FloatArray | None, seen: FloatArray | None, whole: int) -> int:
        """Evaluations, of the ``whole`` budget, at a relative pose (13,); 0: all of it found nothing here before.

        ``searched``: relative pose at which the whole budget found nothing; ``None``: there is none. ``seen``:
        relative pose at the search before. A pair that comes to rest at a new pose is searched there once.
        """
        if searched is None or seen is None:
            return whole
        return budget_at_rest((pose, searched, seen), *self._lengths, whole)
