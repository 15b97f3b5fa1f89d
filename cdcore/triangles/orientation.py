"""Signs of small determinants of points of moderate exponent: a bound first, then exact sums.

Every function takes the points as rows of one array and returns -1, 0 or 1; ``w`` are the digits of an exact sum.

Source: J. R. Shewchuk, Adaptive precision floating-point arithmetic and fast robust geometric predicates (1997),
section 4, for the bounds.
"""

from cdcore.kernels.compiling import hot_kernel, never_inlined
from cdcore.kernels.memory import Memory
from cdcore.triangles.sums import add_product, clear_digits, sign_of_digits, two_product, two_sum

ROUNDOFF = 2.0**-53
ORIENT3D_BOUND = (7.0 + 56.0 * ROUNDOFF) * ROUNDOFF
"""Relative to the permanent: what Shewchuk proves for the 3 x 3 determinant of rounded differences."""
CROSS2_BOUND = (3.0 + 16.0 * ROUNDOFF) * ROUNDOFF
"""The same for the 2 x 2 determinant."""
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
