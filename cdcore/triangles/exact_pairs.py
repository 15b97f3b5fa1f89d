"""Closed triangle against closed triangle with exact signs, degenerate ones included, for moderate exponents.

A pair is one array (6, 3): rows 0-2 are the first triangle, rows 3-5 the second. A triangle of zero area is its edges.
A sign is that of a small determinant of rows, -1, 0 or 1: a bound first, then an exact sum; ``w`` are its digits.

Source: J. R. Shewchuk, Adaptive precision floating-point arithmetic and fast robust geometric predicates (1997),
section 4, for the bounds.
"""

from cdcore.kernels.compiling import hot_kernel, never_inlined
from cdcore.kernels.memory import Memory
from cdcore.triangles.sums import add_product, clear_digits, sign_of_digits, two_product, two_sum

ROUNDOFF = 2.0**-53
ORIENT3D_BOUND = 8.0 * ROUNDOFF
"""Relative to the permanent: above the (7 + 56 u) u of Shewchuk for the 3 x 3 determinant of rounded differences."""
CROSS2_BOUND = 4.0 * ROUNDOFF
"""The same for the 2 x 2 determinant: above (3 + 16 u) u."""
UNDERFLOW_GUARD = 1e-250
"""A determinant below this may have lost terms to underflow, which the relative bounds do not cover."""
OVERFLOW_GUARD = 1e300
"""A permanent above this may hide an overflowed term."""


@hot_kernel
def orientation_filtered(p: Memory, a: int, b: int, c: int, d: int) -> int:
    """Sign of the volume (a-d) x (b-d) . (c-d) of rows a, b, c, d of p; 2 when the float64 bound cannot tell."""
    ax, ay, az = p[3 * a] - p[3 * d], p[3 * a + 1] - p[3 * d + 1], p[3 * a + 2] - p[3 * d + 2]
    bx, by, bz = p[3 * b] - p[3 * d], p[3 * b + 1] - p[3 * d + 1], p[3 * b + 2] - p[3 * d + 2]
    cx, cy, cz = p[3 * c] - p[3 * d], p[3 * c + 1] - p[3 * d + 1], p[3 * c + 2] - p[3 * d + 2]
    bxcy, cxby = bx * cy, cx * by
    cxay, axcy = cx * ay, ax * cy
    axby, bxay = ax * by, bx * ay
    determinant = az * (bxcy - cxby) + bz * (cxay - axcy) + cz * (axby - bxay)
    permanent = (
        (abs(bxcy) + abs(cxby)) * abs(az) + (abs(cxay) + abs(axcy)) * abs(bz) + (abs(axby) + abs(bxay)) * abs(cz)
    )
    size = abs(determinant)
    if size > ORIENT3D_BOUND * permanent and size > UNDERFLOW_GUARD and permanent < OVERFLOW_GUARD:
        return 1 if determinant > 0.0 else -1
    return 2


@hot_kernel
def orientation_exact(p: Memory, a: int, b: int, c: int, d: int, w: Memory) -> int:
    """The same sign by an exact sum, never undecided; needs moderate exponents."""
    clear_digits(w)
    q, r, s = a, b, c
    for _ in range(3):
        # the determinant by its last column: z of each row times the minor of the other two in cyclic order
        r_x, r_y = two_sum(p[3 * r], -p[3 * d]), two_sum(p[3 * r + 1], -p[3 * d + 1])
        s_x, s_y = two_sum(p[3 * s], -p[3 * d]), two_sum(p[3 * s + 1], -p[3 * d + 1])
        for z in two_sum(p[3 * q + 2], -p[3 * d + 2]):
            if z != 0.0:
                for x in r_x:
                    for y in s_y:
                        add_triple(w, z, x, y)
                for x in s_x:
                    for y in r_y:
                        add_triple(w, -z, x, y)
        q, r, s = r, s, q
    return sign_of_digits(w)


@hot_kernel
def add_triple(w: Memory, x: float, y: float, z: float) -> None:
    """Add x y z, exactly."""
    never_inlined()
    if y == 0.0 or z == 0.0:
        return
    product, error = two_product(y, z)
    add_product(w, product, x)
    if error != 0.0:
        add_product(w, error, x)


@hot_kernel
def orientation_sign(p: Memory, a: int, b: int, c: int, d: int, w: Memory) -> int:
    """Exact sign of the volume of rows a, b, c, d of p."""
    never_inlined()
    sign = orientation_filtered(p, a, b, c, d)
    if sign == 2:
        sign = orientation_exact(p, a, b, c, d, w)
    return sign


@hot_kernel
def cross_sign(p: Memory, a: int, b: int, c: int, d: int, axis: int, w: Memory) -> int:
    """Exact sign of (b - a) x (d - c) seen along ``axis`` (0, 1, 2): turn to the left is 1."""
    never_inlined()
    i = (axis + 1) % 3
    j = (axis + 2) % 3
    left = (p[3 * b + i] - p[3 * a + i]) * (p[3 * d + j] - p[3 * c + j])
    right = (p[3 * b + j] - p[3 * a + j]) * (p[3 * d + i] - p[3 * c + i])
    determinant = left - right
    permanent = abs(left) + abs(right)
    size = abs(determinant)
    if size > CROSS2_BOUND * permanent and size > UNDERFLOW_GUARD and permanent < OVERFLOW_GUARD:
        return 1 if determinant > 0.0 else -1
    clear_digits(w)
    for x in two_sum(p[3 * b + i], -p[3 * a + i]):
        for y in two_sum(p[3 * d + j], -p[3 * c + j]):
            add_product(w, x, y)
    for x in two_sum(p[3 * b + j], -p[3 * a + j]):
        for y in two_sum(p[3 * d + i], -p[3 * c + i]):
            add_product(w, -x, y)
    return sign_of_digits(w)


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
        other = (k + 1) % 3
        if segments_meet_2d(p, a, b, t + k, t + other, axis, w):
            return True
        side = cross_sign(p, t + k, t + other, t + k, a, axis, w)
        left, right = left or side > 0, right or side < 0
    return not (left and right)


@hot_kernel
def passes_inside(p: Memory, a: int, b: int, t: int, w: Memory) -> bool:
    """The line of ab, which crosses the plane of the proper triangle t..t+2, crosses it in the closed triangle."""
    left, right = False, False
    for k in range(3):
        other = (k + 1) % 3
        side = orientation_sign(p, a, b, t + k, t + other, w)
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
