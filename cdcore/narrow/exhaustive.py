"""Every face of one mesh against every face of another: the slow reference, and the answer where nothing faster
applies.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cdcore.narrow.predicates import triangles_intersect
from cdcore.numerics import FloatArray

PAIRS_AT_ONCE = 1 << 20
"""Keeps the arrays of comparisons below some 50 MB."""


def meeting_faces_exhaustive(first: FloatArray, second: FloatArray) -> NDArray[np.int64]:
    """Face pairs (k, 2) that meet among placed triangles (f, 3, 3) and (g, 3, 3), sorted; f g comparisons of boxes.

    Choose it for tests and for coordinates so large that the bounds of the trees no longer hold.
    """
    low_a, high_a = first.min(axis=1), first.max(axis=1)
    low_b, high_b = second.min(axis=1), second.max(axis=1)
    rows = max(1, PAIRS_AT_ONCE // max(1, len(second)))
    found = [np.zeros((0, 2), dtype=np.int64)]
    for start in range(0, len(first), rows):
        part = slice(start, start + rows)
        near = (low_a[part, None] <= high_b).all(axis=2) & (low_b <= high_a[part, None]).all(axis=2)
        pairs = np.argwhere(near)
        pairs[:, 0] += start
        meet = triangles_intersect(np.stack([first[pairs[:, 0]], second[pairs[:, 1]]], axis=1))
        found.append(pairs[meet])
    return np.concatenate(found)
