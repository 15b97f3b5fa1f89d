"""Two triangles apart for certain, or not: GJK searches an axis along which they keep a distance, the last one first.

An axis found for one pair of faces mostly separates the next: bodies move little from leaf to leaf and frame to frame.
The inner step finds the point of a simplex nearest to the origin, and the corners it needs.

Source: G. van den Bergen, A fast and robust GJK implementation for collision detection of convex objects (1999),
section 4, for the search of a separating axis and its caching; C. Ericson, Real-Time Collision Detection (2005),
section 5.1, for the regions of a triangle. Differs: GJK as published finds the nearest point with Johnson's recursion.
"""

from typing import Final

import numpy as np

from cdcore.kernels.compiling import always_inlined, hot_kernel, never_inlined
from cdcore.kernels.vectors import Vector, between, beyond, cross, dot, vector_at
from cdcore.numerics import FloatArray

TOO_MANY_STEPS: Final = 17
"""Triangles settle in five steps or so; those that go on are within rounding of touching and are asked exactly."""

NO_PROGRESS: Final = 1e-12
"""A step that brings the axis closer to the origin by less than this share is the last."""

MEETING: Final = -1
"""No separating axis was found: the faces meet, or are too close for floats to tell."""


@hot_kernel
def put(rows: FloatArray, row: int, point: Vector) -> None:
    """Write a row of ``rows`` (3 n,); assigning a slice would need the memory manager, which hot kernels go without."""
    always_inlined()
    rows[3 * row], rows[3 * row + 1], rows[3 * row + 2] = point


@hot_kernel
def nearest_on_segment(y: FloatArray) -> tuple[int, Vector]:
    """Nearest point of rows 0 and 1, after how many rows it needs; these are moved to the front."""
    never_inlined()
    a, b = vector_at(y, 0), vector_at(y, 3)
    edge = between(a, b)
    along, length = -dot(edge, a), dot(edge, edge)
    if along <= 0.0:
        return 1, a
    if along >= length:
        put(y, 0, b)
        return 1, b
    return 2, beyond(a, along / length, edge)


@hot_kernel
def nearest_on_triangle(y: FloatArray) -> tuple[int, Vector]:
    """Nearest point of rows 0, 1 and 2, after how many rows it needs; these are moved to the front."""
    never_inlined()
    a, b, c = vector_at(y, 0), vector_at(y, 3), vector_at(y, 6)
    ab, ac = between(a, b), between(a, c)
    d1, d2, d3, d4, d5, d6 = -dot(ab, a), -dot(ac, a), -dot(ab, b), -dot(ac, b), -dot(ab, c), -dot(ac, c)
    if d1 <= 0.0 and d2 <= 0.0:
        return 1, a
    if d3 >= 0.0 and d4 <= d3:
        put(y, 0, b)
        return 1, b
    if d6 >= 0.0 and d5 <= d6:
        put(y, 0, c)
        return 1, c
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    total = va + vb + vc
    if not (vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0):
        if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
            put(y, 1, c)
        elif va <= 0.0 and d4 >= d3 and d5 >= d6:
            put(y, 0, c)
        elif total > 0.0:
            nearest_x = (va * a[0] + vb * b[0] + vc * c[0]) / total
            nearest_y = (va * a[1] + vb * b[1] + vc * c[1]) / total
            return 3, (nearest_x, nearest_y, (va * a[2] + vb * b[2] + vc * c[2]) / total)
    return nearest_on_segment(y)


@hot_kernel
def origin_is_beyond(y: FloatArray, i: int, j: int, k: int, other: int) -> bool:
    """Whether the plane of rows i, j, k keeps the origin from row ``other``."""
    corner = vector_at(y, 3 * i)
    normal = cross(between(corner, vector_at(y, 3 * j)), between(corner, vector_at(y, 3 * k)))
    here, beyond_edge = -dot(normal, corner), dot(normal, between(corner, vector_at(y, 3 * other)))
    return bool(here * beyond_edge <= 0.0)


@hot_kernel
def nearest_on_tetrahedron(y: FloatArray, side: FloatArray, best: FloatArray) -> tuple[int, Vector]:
    """Nearest point of four rows, after how many rows it needs; 0 where the origin is inside."""
    never_inlined()
    least, count, nearest = -1.0, 0, (0.0, 0.0, 0.0)
    for left_out in range(4):
        i, j, k = (left_out + 1) % 4, (left_out + 2) % 4, (left_out + 3) % 4
        if not origin_is_beyond(y, i, j, k, left_out):
            continue
        put(side, 0, vector_at(y, 3 * i))
        put(side, 1, vector_at(y, 3 * j))
        put(side, 2, vector_at(y, 3 * k))
        used, point = nearest_on_triangle(side)
        distance = dot(point, point)
        if count == 0 or distance < least:
            least, count, nearest = distance, used, point
            for entry in range(9):
                best[entry] = side[entry]
    if count > 0:
        for entry in range(9):
            y[entry] = best[entry]
    return count, nearest


@hot_kernel
def nearest_on_simplex(room: FloatArray, count: int) -> tuple[int, Vector]:
    """Nearest point of the first ``count`` rows of ``room`` (36,), after how many rows it needs; 0: inside."""
    never_inlined()
    if count == 1:
        return 1, vector_at(room, 0)
    if count == 2:
        return nearest_on_segment(room)
    if count == 3:
        return nearest_on_triangle(room)
    return nearest_on_tetrahedron(room, room[12:24], room[24:36])


@hot_kernel
def least_difference(points: FloatArray, v: Vector) -> tuple[float, Vector]:
    """Point p - q of least ``v . (p - q)``, p of rows 0-2 and q of rows 3-5, after that product."""
    never_inlined()
    p, q = vector_at(points, 0), vector_at(points, 9)
    lower, upper = dot(v, p), dot(v, q)
    for k in range(3, 9, 3):
        along = dot(v, vector_at(points, k))
        if along < lower:
            p, lower = vector_at(points, k), along
        along = dot(v, vector_at(points, 9 + k))
        if along > upper:
            q, upper = vector_at(points, 9 + k), along
    w = between(q, p)
    return dot(v, w), w


@hot_kernel
def steps_to_separate(points: FloatArray, axis: FloatArray, pad: float, room: FloatArray) -> int:
    """Steps it took to find an axis along which rows 0-2 and 3-5 are further apart than ``pad``; MEETING for none.

    ``points`` (18,). 0 steps: ``axis`` (3,), as it came, does it. The axis found is left there. ``room`` is (36,), for
    scratch.
    """
    never_inlined()
    v, count = vector_at(axis, 0), 0
    ahead, w = least_difference(points, v)
    if ahead > pad * np.sqrt(dot(v, v)):
        return 0
    for step in range(1, TOO_MANY_STEPS):
        put(room, count, w)
        count, v = nearest_on_simplex(room, count + 1)
        far = dot(v, v)
        if count == 0 or far <= 0.0:
            return MEETING
        ahead, w = least_difference(points, v)
        if ahead > pad * np.sqrt(far):
            put(axis, 0, v)
            return step
        if far - ahead <= NO_PROGRESS * far or count == 4:
            return MEETING
    return MEETING
