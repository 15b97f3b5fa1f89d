"""Where two triangles meet: a segment whose existence and ends are decided by exact signs, its coordinates rounded to
float64.

Which edges pierce which faces is never a matter of rounding; only the printed position of a piercing point is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from cdcore.narrow.compiling import kernel, stay_one_function
from cdcore.narrow.exact_sums import LARGEST_EXACT, SMALLEST_EXACT, new_digits
from cdcore.narrow.orientation import cross_sign, orientation_sign
from cdcore.narrow.predicates import checked_triangles
from cdcore.narrow.triangle_exact import (
    lexicographic_ends,
    on_one_line,
    passes_inside,
    point_in_triangle_2d,
    projection_axis,
    within_box_2d,
)
from cdcore.numerics import FloatArray, IntArray

MOST_POINTS = 64
"""Room for the candidate ends of one pair: nine edge pairs of one plane give at most 36, six corners six more."""


def triangle_pair_sections(triangles: ArrayLike) -> FloatArray:
    """The segment in which the two triangles of each pair meet.

    Of a coplanar overlap, which is a polygon, this is the polygon's longest chord between corners. A single common
    point gives a segment with equal ends. Pairs that do not meet give NaN.

    Parameters
    ----------
    triangles : (n, 2, 3, 3) finite numbers.

    Returns
    -------
    (n, 2, 3) ends of the segments, in the frame of the triangles.

    Raises
    ------
    InvalidTrianglesError
        Wrong shape, or a coordinate that is not finite.
    """
    pairs = checked_triangles(triangles).reshape(-1, 6, 3)
    segments = np.full((len(pairs), 2, 3), np.nan)
    if len(pairs) == 0:
        return segments
    scale = _scales(pairs)
    fill_sections(pairs * scale, segments, new_digits())
    return segments / scale


def _scales(pairs: FloatArray) -> FloatArray:
    """Powers of two (n, 1, 1) that bring each pair into the range of exact arithmetic; 1 where it is there already."""
    size = np.abs(pairs)
    largest = size.max(axis=(1, 2), keepdims=True)
    smallest = np.where(size > 0, size, np.inf).min(axis=(1, 2), keepdims=True)
    outside = (largest > LARGEST_EXACT) | (smallest < SMALLEST_EXACT)
    _, exponent = np.frexp(largest)
    return np.where(outside & (largest > 0), np.ldexp(1.0, np.clip(-exponent, -1000, 1000)), 1.0)


@kernel
def add_corner(p: FloatArray, q: int, out: FloatArray, count: int) -> int:
    """Row q of p is one candidate end."""
    for k in range(3):
        out[count, k] = p[q, k]
    return count + 1


@kernel
def add_between(p: FloatArray, a: int, b: int, from_a: float, from_b: float, out: FloatArray, count: int) -> int:
    """The point of segment ab that divides it as the signed distances ``from_a`` and ``from_b`` do."""
    whole = from_a - from_b
    share = 0.5 if whole == 0.0 else min(max(from_a / whole, 0.0), 1.0)
    for k in range(3):
        out[count, k] = p[a, k] + share * (p[b, k] - p[a, k])
    return count + 1


@kernel
def signed_volume(p: FloatArray, a: int, b: int, c: int, d: int) -> float:
    """Rounded volume whose exact sign is ``orientation_sign``."""
    x, y, z = p[d, 0] - p[a, 0], p[d, 1] - p[a, 1], p[d, 2] - p[a, 2]
    ux, uy, uz = p[b, 0] - p[a, 0], p[b, 1] - p[a, 1], p[b, 2] - p[a, 2]
    vx, vy, vz = p[c, 0] - p[a, 0], p[c, 1] - p[a, 1], p[c, 2] - p[a, 2]
    volume: float = x * (uy * vz - uz * vy) + y * (uz * vx - ux * vz) + z * (ux * vy - uy * vx)
    return volume


@kernel
def signed_area(p: FloatArray, a: int, b: int, c: int, axis: int) -> float:
    """Rounded area whose exact sign is that of the turn a, b, c seen along ``axis``."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    area: float = (p[b, i] - p[a, i]) * (p[c, j] - p[a, j]) - (p[b, j] - p[a, j]) * (p[c, i] - p[a, i])
    return area


@kernel
def add_meeting_in_plane(
    p: FloatArray, a: int, b: int, c: int, d: int, axis: int, w: IntArray, out: FloatArray, count: int
) -> int:
    """Common points of segments ab and cd of one plane: the crossing, or those ends that lie on the other segment."""
    stay_one_function()
    c_side = cross_sign(p, a, b, a, c, axis, w)
    d_side = cross_sign(p, a, b, a, d, axis, w)
    a_side = cross_sign(p, c, d, c, a, axis, w)
    b_side = cross_sign(p, c, d, c, b, axis, w)
    if c_side * d_side < 0 and a_side * b_side < 0:
        return add_between(p, a, b, signed_area(p, c, d, a, axis), signed_area(p, c, d, b, axis), out, count)
    if c_side == 0 and within_box_2d(p, c, a, b, axis):
        count = add_corner(p, c, out, count)
    if d_side == 0 and within_box_2d(p, d, a, b, axis):
        count = add_corner(p, d, out, count)
    if a_side == 0 and within_box_2d(p, a, c, d, axis):
        count = add_corner(p, a, out, count)
    if b_side == 0 and within_box_2d(p, b, c, d, axis):
        count = add_corner(p, b, out, count)
    return count


@kernel
def add_edge_in_triangle(
    p: FloatArray, a: int, b: int, t: int, axis: int, w: IntArray, out: FloatArray, count: int
) -> int:
    """Ends of what segment ab and the proper triangle t..t+2 have in common."""
    stay_one_function()
    a_side = orientation_sign(p, t, t + 1, t + 2, a, w)
    b_side = orientation_sign(p, t, t + 1, t + 2, b, w)
    if a_side * b_side > 0:
        return count
    if a_side == 0 and point_in_triangle_2d(p, a, t, axis, w):
        count = add_corner(p, a, out, count)
    if b_side == 0 and point_in_triangle_2d(p, b, t, axis, w):
        count = add_corner(p, b, out, count)
    if a_side == 0 and b_side == 0:
        for k in range(3):
            count = add_meeting_in_plane(p, a, b, t + k, t + (k + 1) % 3, axis, w, out, count)
    if a_side * b_side < 0 and passes_inside(p, a, b, t, w):
        from_a = signed_volume(p, t, t + 1, t + 2, a)
        count = add_between(p, a, b, from_a, signed_volume(p, t, t + 1, t + 2, b), out, count)
    return count


@kernel
def within_box(p: FloatArray, q: int, a: int, b: int) -> bool:
    """Row q in the closed box of rows a and b."""
    inside = True
    for k in range(3):
        inside = inside and min(p[a, k], p[b, k]) <= p[q, k] <= max(p[a, k], p[b, k])
    return inside


@kernel
def add_segments(p: FloatArray, a: int, b: int, c: int, d: int, w: IntArray, out: FloatArray, count: int) -> int:
    """Ends of what two segments in space have in common."""
    stay_one_function()
    if orientation_sign(p, a, b, c, d, w) != 0:
        return count
    axis = projection_axis(p, a, b, c, d, w)
    if axis >= 0:
        return add_meeting_in_plane(p, a, b, c, d, axis, w, out, count)
    if on_one_line(p, a, b, c, w) and on_one_line(p, c, d, a, w):
        for q in (a, b):
            if within_box(p, q, c, d):
                count = add_corner(p, q, out, count)
        for q in (c, d):
            if within_box(p, q, a, b):
                count = add_corner(p, q, out, count)
    return count


@kernel
def candidate_ends(p: FloatArray, w: IntArray, out: FloatArray) -> int:
    """Write every possible end of the common segment to ``out``; returns how many there are."""
    stay_one_function()
    o = int(np.int64(0))
    t = o + 3
    count = int(np.int64(0))
    first_axis = projection_axis(p, o, o + 1, o, o + 2, w)
    second_axis = projection_axis(p, t, t + 1, t, t + 2, w)
    a, b = lexicographic_ends(p, o)
    c, d = lexicographic_ends(p, t)
    if first_axis < 0 and second_axis < 0:
        return add_segments(p, a, b, c, d, w, out, count)
    if first_axis < 0:
        return add_edge_in_triangle(p, a, b, t, second_axis, w, out, count)
    if second_axis < 0:
        return add_edge_in_triangle(p, c, d, o, first_axis, w, out, count)
    for k in range(3):
        count = add_edge_in_triangle(p, o + k, o + (k + 1) % 3, t, second_axis, w, out, count)
    for k in range(3):
        count = add_edge_in_triangle(p, t + k, t + (k + 1) % 3, o, first_axis, w, out, count)
    return count


@kernel
def fill_sections(pairs: FloatArray, segments: FloatArray, w: IntArray) -> None:
    """For each pair (n, 6, 3) the two candidate ends farthest apart, into ``segments`` (n, 2, 3)."""
    out = np.empty((MOST_POINTS, 3))
    for row in range(len(pairs)):
        count = candidate_ends(pairs[row], w, out)
        farthest = -1.0
        for i in range(count):
            for j in range(i, count):
                x, y, z = out[i, 0] - out[j, 0], out[i, 1] - out[j, 1], out[i, 2] - out[j, 2]
                apart = x * x + y * y + z * z
                if apart > farthest:
                    farthest = apart
                    segments[row, 0] = out[i]
                    segments[row, 1] = out[j]
