"""Brute force: every face of one mesh against every face of another, the reference and the last resort."""

import numpy as np
from numpy.typing import NDArray

from cdcore.numerics import FloatArray, IntArray
from cdcore.poses import place_points
from cdcore.triangles.decide import triangles_intersect

Pose = tuple[FloatArray, FloatArray]
"""Rotation (3, 3) and translation (3,)."""
PAIRS_AT_ONCE = 1 << 20
"""Keeps each array of comparisons at a mebibyte, which stays in the processor's cache."""


def meeting_faces_exhaustive(first: FloatArray, second: FloatArray) -> IntArray:
    """Face pairs (k, 2) that meet among placed triangles (f, 3, 3) and (g, 3, 3), sorted; f g comparisons of boxes.

    Choose it for tests and for coordinates so large that the bounds of the trees no longer hold.
    """
    pairs = near_faces(first, second, 0.0)
    return pairs[triangles_intersect(np.stack([first[pairs[:, 0]], second[pairs[:, 1]]], axis=1))]


def meeting_faces_placed(
    first: FloatArray, first_pose: Pose, second: FloatArray, second_pose: Pose
) -> NDArray[np.int32]:
    """The same of triangles (f, 3, 3) and (g, 3, 3) in their bodies' frames, at rotations (3, 3), translations (3,)."""
    placed = place_points(first, *first_pose), place_points(second, *second_pose)
    return meeting_faces_exhaustive(*placed).astype(np.int32)


def near_faces(first: FloatArray, second: FloatArray, reach: float) -> IntArray:
    """Face pairs (k, 2) of placed triangles whose boxes are no further apart than ``reach`` along any axis, sorted."""
    lower_a, upper_a, lower_b, upper_b = first.min(axis=1), first.max(axis=1), second.min(axis=1), second.max(axis=1)
    if reach > 0.0:
        # The sum rounds once: a step outward keeps every face pair within reach.
        lower_a, upper_a = np.nextafter(lower_a - reach, -np.inf), np.nextafter(upper_a + reach, np.inf)
    # coordinates that overflowed to NaN are near nothing, and keep nothing else away
    rows = np.flatnonzero(((lower_a <= np.fmax.reduce(upper_b)) & (upper_a >= np.fmin.reduce(lower_b))).all(axis=1))
    columns = np.flatnonzero(((lower_b <= np.fmax.reduce(upper_a)) & (upper_b >= np.fmin.reduce(lower_a))).all(axis=1))
    # an axis a row, so that each comparison runs along the memory
    lower, upper = (np.ascontiguousarray(corner[columns].T) for corner in (lower_b, upper_b))
    step = max(1, PAIRS_AT_ONCE // max(1, len(columns)))
    blocks = [np.zeros((0, 2), dtype=np.int64)]
    for start in range(0, len(rows), step):
        block = rows[start : start + step]
        near = np.ones((len(block), len(columns)), dtype=np.bool_)
        for axis in range(3):
            near &= lower_a[block, axis, None] <= upper[axis]
            near &= lower[axis] <= upper_a[block, axis, None]
        i, j = np.nonzero(near)
        blocks.append(np.stack([block[i], columns[j]], axis=1))
    return np.concatenate(blocks)
