"""Closed triangle against closed triangle with exact signs, degenerate ones included, for moderate exponents.

A pair is one array (6, 3): rows 0-2 are the first triangle, rows 3-5 the second. A triangle of zero area is its edges.
"""

from cdcore.kernels.compiling import hot_kernel, never_inlined
from cdcore.kernels.memory import Memory
from cdcore.triangles.orientation import cross_sign, orientation_sign


@hot_kernel
def projection_axis(p: Memory, a: int, b: int, c: int, d: int, w: Memory) -> int:
    """An axis along which (b - a) x (d - c) is not zero, the float64 largest first; -1 where the product is zero."""
    never_inlined()
    ux, uy, uz = p[3 * b] - p[3 * a], p[3 * b + 1] - p[3 * a + 1], p[3 * b + 2] - p[3 * a + 2]
    vx, vy, vz = p[3 * d] - p[3 * c], p[3 * d + 1] - p[3 * c + 1], p[3 * d + 2] - p[3 * c + 2]
    x, y, z = abs(uy * vz - uz * vy), abs(uz * vx - ux * vz), abs(ux * vy - uy * vx)
    first = 2
    if x > y and x > z:
        first = 0
    elif y > z:
        first = 1
    for step in range(3):
        axis = (first + step) % 3
        if cross_sign(p, a, b, c, d, axis, w) != 0:
            return axis
    return -1


@hot_kernel
def ranges_separated(p: Memory, a: int, b: int, c: int, d: int, k: int) -> bool:
    """Along one coordinate, all of segment ab lies before or behind all of segment cd."""
    never_inlined()
    a_k, b_k, c_k, d_k = p[3 * a + k], p[3 * b + k], p[3 * c + k], p[3 * d + k]
    return max(a_k, b_k) < min(c_k, d_k) or max(c_k, d_k) < min(a_k, b_k)


@hot_kernel
def segments_meet_2d(p: Memory, a: int, b: int, c: int, d: int, axis: int, w: Memory) -> bool:
    """Closed segments ab and cd seen along ``axis``; either may be a point.

    They meet where their boxes do and the line of neither has the whole other segment on one side.
    """
    never_inlined()
    for step in range(1, 3):
        if ranges_separated(p, a, b, c, d, (axis + step) % 3):
            return False
    if cross_sign(p, a, b, a, c, axis, w) * cross_sign(p, a, b, a, d, axis, w) > 0:
        return False
    return cross_sign(p, c, d, c, a, axis, w) * cross_sign(p, c, d, c, b, axis, w) <= 0


@hot_kernel
def segment_meets_triangle_2d(p: Memory, a: int, b: int, t: int, axis: int, w: Memory) -> bool:
    """Segment ab and proper triangle t..t+2 of one plane that ``axis`` does not lie in."""
    left, right = False, False
    for k in range(3):
        if segments_meet_2d(p, a, b, t + k, t + (k + 1) % 3, axis, w):
            return True
        side = cross_sign(p, t + k, t + (k + 1) % 3, t + k, a, axis, w)
        left, right = left or side > 0, right or side < 0
    return not (left and right)


@hot_kernel
def passes_inside(p: Memory, a: int, b: int, t: int, w: Memory) -> bool:
    """The line of ab, which crosses the plane of the proper triangle t..t+2, crosses it in the closed triangle."""
    left, right = False, False
    for k in range(3):
        side = orientation_sign(p, a, b, t + k, t + (k + 1) % 3, w)
        left, right = left or side > 0, right or side < 0
    return not (left and right)


@hot_kernel
def segment_meets_triangle(p: Memory, a: int, b: int, a_side: int, b_side: int, t: int, axis: int, w: Memory) -> bool:
    """Segment ab, whose ends lie on the given sides of the plane, and the proper triangle t..t+2."""
    never_inlined()
    if a_side * b_side > 0:
        return False
    if a_side == 0 and b_side == 0:
        return segment_meets_triangle_2d(p, a, b, t, axis, w)
    return passes_inside(p, a, b, t, w)


@hot_kernel
def collinear(p: Memory, a: int, b: int, c: int, w: Memory) -> bool:
    """Rows a, b, c exactly collinear."""
    return projection_axis(p, a, b, a, c, w) < 0


@hot_kernel
def segments_meet(p: Memory, a: int, b: int, c: int, d: int, w: Memory) -> bool:
    """Closed segments ab and cd in space; either may be a point."""
    never_inlined()
    if orientation_sign(p, a, b, c, d, w) != 0:
        return False
    axis = projection_axis(p, a, b, c, d, w)
    if axis >= 0:
        return segments_meet_2d(p, a, b, c, d, axis, w)
    if not (collinear(p, a, b, c, w) and collinear(p, c, d, a, w)):
        return False
    separated = False
    for k in range(3):
        separated = separated or ranges_separated(p, a, b, c, d, k)
    return not separated


@hot_kernel
def edges_meet(p: Memory, s: int, t: int, w: Memory) -> bool:
    """An edge of rows s..s+2 meets one of rows t..t+2: triangles of zero area are the segments that their edges are."""
    for i in range(3):
        for j in range(3):
            if segments_meet(p, s + i, s + (i + 1) % 3, t + j, t + (j + 1) % 3, w):
                return True
    return False


@hot_kernel
def edges_meet_triangle(p: Memory, s: int, t: int, axis: int, w: Memory) -> int:
    """1: an edge of rows s..s+2 meets the proper triangle t..t+2; -1: s is wholly on one side; 0: neither."""
    never_inlined()
    first = orientation_sign(p, t, t + 1, t + 2, s, w)
    before, same_side = first, True
    for k in range(3):
        after = orientation_sign(p, t, t + 1, t + 2, s + k + 1, w) if k < 2 else first
        if segment_meets_triangle(p, s + k, s + (k + 1) % 3, before, after, t, axis, w):
            return 1
        same_side = same_side and before * after > 0
        before = after
    return -1 if same_side else 0


@hot_kernel
def boxes_separated(p: Memory) -> bool:
    """The axis-aligned boxes of the two triangles are disjoint; comparisons do not round."""
    for k in range(3):
        if max(max(p[k], p[3 + k]), p[6 + k]) < min(min(p[9 + k], p[12 + k]), p[15 + k]):
            return True
        if max(max(p[9 + k], p[12 + k]), p[15 + k]) < min(min(p[k], p[3 + k]), p[6 + k]):
            return True
    return False


@hot_kernel
def pair_intersects_exact(p: Memory, w: Memory) -> bool:
    """Exact answer for one pair of moderate exponents; ``w`` are the digits of an exact sum.

    It is right, and slow, where ``boxes_separated`` answers as well.
    """
    never_inlined()
    first_axis = projection_axis(p, 0, 1, 0, 2, w)
    second_axis = projection_axis(p, 3, 4, 3, 5, w)
    if first_axis < 0 and second_axis < 0:
        return edges_meet(p, 0, 3, w)
    if first_axis < 0:
        return edges_meet_triangle(p, 0, 3, second_axis, w) == 1
    if second_axis < 0:
        return edges_meet_triangle(p, 3, 0, first_axis, w) == 1
    answer = edges_meet_triangle(p, 0, 3, second_axis, w)
    if answer == 0:
        answer = edges_meet_triangle(p, 3, 0, first_axis, w)
    return answer == 1
