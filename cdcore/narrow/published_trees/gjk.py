"""Two triangles apart for certain, or not: GJK searches an axis along which they keep a distance, the last one first.

An axis found for one pair of faces mostly separates the next: bodies move little from leaf to leaf and frame to frame.
The inner step finds the point of a simplex nearest to the origin, and the corners it needs.

Source: G. van den Bergen, A fast and robust GJK implementation for collision detection of convex objects (1999),
section 4, for the search of a separating axis and its caching; C. Ericson, Real-Time Collision Detection (2005),
section 5.1, for the regions of a triangle. Differs: GJK as published finds the nearest point with Johnson's recursion.
"""

from typing import Final

import numpy as np

from cdcore.kernels.compiling import hot_kernel, stay_one_function
from cdcore.numerics import FloatArray

MOST_STEPS: Final = 16
"""Triangles settle in five steps or so; those that go on are within rounding of touching and are asked exactly."""

NO_PROGRESS: Final = 1e-12
"""A step that brings the axis closer to the origin by less than this share is the last."""

MEETING: Final = -1
"""No separating axis was found: the faces meet, or are too close for floats to tell."""


@hot_kernel
def dot(a: FloatArray, b: FloatArray) -> float:
    """a . b"""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@hot_kernel
def put(to: FloatArray, source: FloatArray) -> None:
    """Copy a point; assigning a slice would need the memory manager, which hot kernels go without."""
    for k in range(3):
        to[k] = source[k]


@hot_kernel
def nearest_on_segment(y: FloatArray, v: FloatArray) -> int:
    """Nearest point of rows 0 and 1 in ``v``; the rows it needs, moved to the front, are counted."""
    stay_one_function()
    along, length = 0.0, 0.0
    for k in range(3):
        edge = y[1, k] - y[0, k]
        along -= edge * y[0, k]
        length += edge * edge
    if along <= 0.0:
        put(v, y[0])
        return 1
    if along >= length:
        put(y[0], y[1])
        put(v, y[0])
        return 1
    for k in range(3):
        v[k] = y[0, k] + along / length * (y[1, k] - y[0, k])
    return 2


@hot_kernel
def nearest_on_triangle(y: FloatArray, v: FloatArray) -> int:
    """Nearest point of rows 0, 1 and 2 in ``v``; the rows it needs, moved to the front, are counted."""
    stay_one_function()
    d1, d2, d3, d4, d5, d6 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        ab, ac = y[1, k] - y[0, k], y[2, k] - y[0, k]
        d1 -= ab * y[0, k]
        d2 -= ac * y[0, k]
        d3 -= ab * y[1, k]
        d4 -= ac * y[1, k]
        d5 -= ab * y[2, k]
        d6 -= ac * y[2, k]
    if d1 <= 0.0 and d2 <= 0.0:
        put(v, y[0])
        return 1
    if d3 >= 0.0 and d4 <= d3:
        put(y[0], y[1])
        put(v, y[0])
        return 1
    if d6 >= 0.0 and d5 <= d6:
        put(y[0], y[2])
        put(v, y[0])
        return 1
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return nearest_on_segment(y, v)
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        put(y[1], y[2])
        return nearest_on_segment(y, v)
    if va <= 0.0 and d4 >= d3 and d5 >= d6:
        put(y[0], y[2])
        return nearest_on_segment(y, v)
    total = va + vb + vc
    if total <= 0.0:
        return nearest_on_segment(y, v)
    for k in range(3):
        v[k] = (va * y[0, k] + vb * y[1, k] + vc * y[2, k]) / total
    return 3


@hot_kernel
def origin_is_beyond(y: FloatArray, i: int, j: int, k: int, other: int) -> bool:
    """Whether the plane of rows i, j, k keeps the origin from row ``other``."""
    ux, uy, uz = y[j, 0] - y[i, 0], y[j, 1] - y[i, 1], y[j, 2] - y[i, 2]
    vx, vy, vz = y[k, 0] - y[i, 0], y[k, 1] - y[i, 1], y[k, 2] - y[i, 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    here = -(nx * y[i, 0] + ny * y[i, 1] + nz * y[i, 2])
    there = nx * (y[other, 0] - y[i, 0]) + ny * (y[other, 1] - y[i, 1]) + nz * (y[other, 2] - y[i, 2])
    return bool(here * there <= 0.0)


@hot_kernel
def nearest_on_tetrahedron(y: FloatArray, v: FloatArray, side: FloatArray, best: FloatArray) -> int:
    """Nearest point of four rows in ``v``; 0 where the origin is inside."""
    stay_one_function()
    least, count = -1.0, 0
    for left_out in range(4):
        i, j, k = (left_out + 1) % 4, (left_out + 2) % 4, (left_out + 3) % 4
        if not origin_is_beyond(y, i, j, k, left_out):
            continue
        put(side[0], y[i])
        put(side[1], y[j])
        put(side[2], y[k])
        used = nearest_on_triangle(side, side[3])
        distance = dot(side[3], side[3])
        if count == 0 or distance < least:
            least, count = distance, used
            for row in range(4):
                put(best[row], side[row])
    if count > 0:
        put(v, best[3])
        for row in range(3):
            put(y[row], best[row])
    return count


@hot_kernel
def nearest_on_simplex(y: FloatArray, count: int, v: FloatArray, side: FloatArray, best: FloatArray) -> int:
    """Nearest point of the first ``count`` rows of ``y`` (4, 3) in ``v``; returns how many rows it needs, 0: inside."""
    stay_one_function()
    if count == 1:
        put(v, y[0])
        return 1
    if count == 2:
        return nearest_on_segment(y, v)
    if count == 3:
        return nearest_on_triangle(y, v)
    return nearest_on_tetrahedron(y, v, side, best)


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
