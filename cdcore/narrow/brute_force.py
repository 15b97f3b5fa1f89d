"""Brute force: every face of one mesh against every face of another, the reference and the last resort."""

import numpy as np

from cdcore.narrow.triangles.predicates import triangles_intersect
from cdcore.numerics import BoolArray, FloatArray, IntArray

PAIRS_AT_ONCE = 1 << 20
"""Keeps each array of comparisons at a mebibyte, which stays in the processor's cache."""


def meeting_faces_exhaustive(first: FloatArray, second: FloatArray) -> IntArray:
    """Face pairs (k, 2) that meet among placed triangles (f, 3, 3) and (g, 3, 3), sorted; f g comparisons of boxes.

    Choose it for tests and for coordinates so large that the bounds of the trees no longer hold.
    """
    boxes_a, boxes_b = _boxes(first), _boxes(second)
    if not _overlapping(_whole(boxes_a), _whole(boxes_b)):
        return np.zeros((0, 2), dtype=np.int64)
    rows = max(1, PAIRS_AT_ONCE // max(1, len(second)))
    found = [np.zeros((0, 2), dtype=np.int64)]
    for start in range(0, len(first), rows):
        part = slice(start, start + rows)
        pairs = np.argwhere(_overlapping(boxes_a[:, :, part], boxes_b))
        pairs[:, 0] += start
        meet = triangles_intersect(np.stack([first[pairs[:, 0]], second[pairs[:, 1]]], axis=1))
        found.append(pairs[meet])
    return np.concatenate(found)


def _boxes(triangles: FloatArray) -> FloatArray:
    """Lowest and highest coordinates (2, 3, f), an axis a row, so that each comparison runs along the memory."""
    return np.ascontiguousarray(np.stack([triangles.min(axis=1).T, triangles.max(axis=1).T]))


def _whole(boxes: FloatArray) -> FloatArray:
    """The box (2, 3, 1) of boxes (2, 3, f), of which some may be no numbers."""
    return np.stack([np.fmin.reduce(boxes[0], axis=1), np.fmax.reduce(boxes[1], axis=1)])[:, :, None]


def _overlapping(first: FloatArray, second: FloatArray) -> BoolArray:
    """Which boxes (2, 3, f) share a point with which boxes (2, 3, g): (f, g)."""
    near = np.ones((first.shape[2], second.shape[2]), dtype=np.bool_)
    for axis in range(3):
        near &= first[0, axis, :, None] <= second[1, axis]
        near &= second[0, axis] <= first[1, axis, :, None]
    return near
