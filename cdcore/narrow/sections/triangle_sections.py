"""Where two triangles meet: a segment whose ends are decided by exact signs, its coordinates rounded to float64.

Rounding never decides which edges pierce which faces; it only moves the point where they do.
"""

import numpy as np
from numpy.typing import ArrayLike

from cdcore.kernels.compiling import hot_kernel, kernel, runtime_int, stay_one_function
from cdcore.kernels.memory import Memory, doubles_at, row_of, words_at
from cdcore.narrow.triangles.exact import (
    lexicographic_ends,
    on_one_line,
    passes_inside,
    point_in_triangle_2d,
    projection_axis,
    within_box_2d,
)
from cdcore.narrow.triangles.orientation import cross_sign, orientation_sign
from cdcore.narrow.triangles.predicates import checked_triangles
from cdcore.narrow.triangles.sums import LARGEST_EXACT, SMALLEST_EXACT, new_digits
from cdcore.numerics import FloatArray

MOST_POINTS = 64
"""Room for the candidate ends of one pair: nine edge pairs of one plane give at most 36, six corners six more."""


def triangle_pair_sections(triangles: ArrayLike) -> FloatArray:
    """The ends (n, 2, 3) of the segments in which the ``triangles`` (n, 2, 3, 3) of each pair meet, in their frame.

    Of a coplanar overlap, which is a polygon, this is the polygon's longest chord between corners. A single common
    point gives a segment with equal ends. Pairs that do not meet give NaN. InvalidTrianglesError for a wrong shape, or
    a coordinate that is not finite.
    """
    pairs = checked_triangles(triangles).reshape(-1, 6, 3)
    segments = np.full((len(pairs), 2, 3), np.nan)
    if len(pairs) == 0:
        return segments
    scale = _scales(pairs)
    scaled, digits, room = np.ascontiguousarray(pairs * scale), new_digits(), np.empty((MOST_POINTS, 3))
    fill_sections(row_of([scaled, segments, digits, room]), len(pairs))
    return segments / scale


def _scales(pairs: FloatArray) -> FloatArray:
    """Powers of two (n, 1, 1) that bring each pair into the range of exact arithmetic; 1 where it is there already."""
    size = np.abs(pairs)
    largest = size.max(axis=(1, 2), keepdims=True)
    smallest = np.where(size > 0, size, np.inf).min(axis=(1, 2), keepdims=True)
    outside = (largest > LARGEST_EXACT) | (smallest < SMALLEST_EXACT)
    _, exponent = np.frexp(largest)
    return np.where(outside & (largest > 0), np.ldexp(1.0, np.clip(-exponent, -1000, 1000)), 1.0)


@hot_kernel
def add_corner(p: Memory, q: int, out: Memory, count: int) -> int:
    """Row q of p is one candidate end."""
    for k in range(3):
        out[3 * count + k] = p[3 * q + k]
    return count + 1


@hot_kernel
def add_between(p: Memory, a: int, b: int, from_a: float, from_b: float, out: Memory, count: int) -> int:
    """The point of segment ab that divides it as the signed distances ``from_a`` and ``from_b`` do."""
    whole = from_a - from_b
    share = 0.5 if whole == 0.0 else min(max(from_a / whole, 0.0), 1.0)
    for k in range(3):
        out[3 * count + k] = p[3 * a + k] + share * (p[3 * b + k] - p[3 * a + k])
    return count + 1


@hot_kernel
def signed_volume(p: Memory, a: int, b: int, c: int, d: int) -> float:
    """Rounded volume whose exact sign is ``orientation_sign``."""
    x, y, z = p[3 * d] - p[3 * a], p[3 * d + 1] - p[3 * a + 1], p[3 * d + 2] - p[3 * a + 2]
    ux, uy, uz = p[3 * b] - p[3 * a], p[3 * b + 1] - p[3 * a + 1], p[3 * b + 2] - p[3 * a + 2]
    vx, vy, vz = p[3 * c] - p[3 * a], p[3 * c + 1] - p[3 * a + 1], p[3 * c + 2] - p[3 * a + 2]
    return x * (uy * vz - uz * vy) + y * (uz * vx - ux * vz) + z * (ux * vy - uy * vx)


@hot_kernel
def signed_area(p: Memory, a: int, b: int, c: int, axis: int) -> float:
    """Rounded area whose exact sign is that of the turn a, b, c seen along ``axis``."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    a_i, a_j = p[3 * a + i], p[3 * a + j]
    return (p[3 * b + i] - a_i) * (p[3 * c + j] - a_j) - (p[3 * b + j] - a_j) * (p[3 * c + i] - a_i)


@hot_kernel
def add_meeting_in_plane(
    p: Memory, a: int, b: int, c: int, d: int, axis: int, w: Memory, out: Memory, count: int
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


@hot_kernel
def add_edge_in_triangle(p: Memory, a: int, b: int, t: int, axis: int, w: Memory, out: Memory, count: int) -> int:
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


@hot_kernel
def within_box(p: Memory, q: int, a: int, b: int) -> bool:
    """Row q in the closed box of rows a and b."""
    inside = True
    for k in range(3):
        inside = inside and min(p[3 * a + k], p[3 * b + k]) <= p[3 * q + k] <= max(p[3 * a + k], p[3 * b + k])
    return inside


@hot_kernel
def add_segments(p: Memory, a: int, b: int, c: int, d: int, w: Memory, out: Memory, count: int) -> int:
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


@hot_kernel
def candidate_ends(p: Memory, w: Memory, out: Memory) -> int:
    """Write every possible end of the common segment to ``out``; returns how many there are."""
    stay_one_function()
    o = runtime_int(0)
    t = o + 3
    count = runtime_int(0)
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
def fill_sections(row: Memory, count: int) -> None:
    """For each pair the two candidate ends farthest apart.

    ``row`` holds addresses: of the pairs (n, 18), the segments (n, 6), the digits of an exact sum, and room for
    MOST_POINTS points.
    """
    digits, out = words_at(row[2]), doubles_at(row[3])
    for k in range(count):
        segment, farthest = doubles_at(row[1] + 48 * k), -1.0
        ends = candidate_ends(doubles_at(row[0] + 144 * k), digits, out)
        for i in range(0, 3 * ends, 3):
            for j in range(i, 3 * ends, 3):
                x, y, z = out[i] - out[j], out[i + 1] - out[j + 1], out[i + 2] - out[j + 2]
                apart = x * x + y * y + z * z
                if apart > farthest:
                    farthest = apart
                    segment[0], segment[1], segment[2] = out[i], out[i + 1], out[i + 2]
                    segment[3], segment[4], segment[5] = out[j], out[j + 1], out[j + 2]
