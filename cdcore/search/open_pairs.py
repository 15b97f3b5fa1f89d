"""Pairs of faces that the filter of the triangle test left open, decided by the exact predicate."""

from __future__ import annotations

import numpy as np

from cdcore.narrow.predicates import triangles_intersect
from cdcore.numerics import FloatArray, IntArray, place_points
from cdcore.search.features import CORNERS, Features
from cdcore.search.state import WORLD_A, WORLD_B


def meeting_pairs(first: Features, second: Features, pose: FloatArray, pairs: IntArray) -> IntArray:
    """Those of the pairs (k, 2), places of faces, that meet at the points that count; order kept."""
    meeting: IntArray = pairs[triangles_intersect(placed_pairs(first, second, pose, pairs))]
    return meeting


def placed_pairs(first: Features, second: Features, pose: FloatArray, pairs: IntArray) -> FloatArray:
    """World corners (k, 2, 3, 3) of pairs of faces."""
    placed = np.empty((len(pairs), 2, 3, 3))
    for side, (features, at) in enumerate(((first, WORLD_A), (second, WORLD_B))):
        corners = features.rows[pairs[:, side], CORNERS:].reshape(-1, 3, 3)
        placed[:, side] = place_points(corners, pose[at : at + 9].reshape(3, 3), pose[at + 9 : at + 12])
    return placed
