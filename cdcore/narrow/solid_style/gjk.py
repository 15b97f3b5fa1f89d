"""Two triangles apart for certain, or not: GJK looks for an axis along which they keep a distance, the last one first.

An axis found for one pair of faces mostly separates the next: bodies move little from leaf to leaf and frame to frame.

Source: G. van den Bergen, A fast and robust GJK implementation for collision detection of convex objects (1999),
section 4, for the search of a separating axis and its caching.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from cdcore.kernels.compiling import hot_kernel, stay_one_function
from cdcore.narrow.solid_style.closest import dot, nearest_on_simplex, put
from cdcore.numerics import FloatArray

MOST_STEPS: Final = 16
"""Triangles settle in five steps or so; those that go on are within rounding of touching and are asked exactly."""

NO_PROGRESS: Final = 1e-12
"""A step that brings the axis closer to the origin by less than this share is the last."""

MEETING: Final = -1
"""No separating axis was found: the faces meet, or are too close for floats to tell."""


@hot_kernel
def least_difference(points: FloatArray, v: FloatArray, w: FloatArray) -> float:
    """Point p - q of least ``v . (p - q)`` in ``w``, p of rows 0-2 and q of rows 3-5; returns that product."""
    stay_one_function()
    p, q = 0, 3
    low, high = dot(v, points[0]), dot(v, points[3])
    for k in range(1, 3):
        along = dot(v, points[k])
        if along < low:
            p, low = k, along
        along = dot(v, points[3 + k])
        if along > high:
            q, high = 3 + k, along
    for k in range(3):
        w[k] = points[p, k] - points[q, k]
    return dot(v, w)


@hot_kernel
def steps_to_separate(points: FloatArray, axis: FloatArray, pad: float, room: FloatArray) -> int:
    """Steps it took to find an axis along which rows 0-2 and 3-5 are further apart than ``pad``; MEETING for none.

    0 steps: ``axis`` (3,), as it came, does it. The axis found is left there. ``room`` is (14, 3), for scratch.
    """
    stay_one_function()
    v, w, y, side, best = room[0], room[1], room[2:6], room[6:10], room[10:14]
    ahead = least_difference(points, axis, w)
    if ahead > pad * np.sqrt(dot(axis, axis)):
        return 0
    count = 0
    for step in range(1, MOST_STEPS + 1):
        put(y[count], w)
        count = nearest_on_simplex(y, count + 1, v, side, best)
        far = dot(v, v)
        if count == 0 or far <= 0.0:
            return MEETING
        ahead = least_difference(points, v, w)
        if ahead > pad * np.sqrt(far):
            put(axis, v)
            return step
        if far - ahead <= NO_PROGRESS * far or count == 4:
            return MEETING
    return MEETING
