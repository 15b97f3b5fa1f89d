"""Signs of small determinants of points, right for any coordinates of moderate exponent: a bound first, expansions
where it is not enough.

Every function takes the points as rows of one array and returns -1, 0 or 1.

Source: J. R. Shewchuk, Adaptive precision floating-point arithmetic and fast robust geometric predicates (1997),
section 4.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdcore.narrow.compiling import stay_one_function
from cdcore.narrow.expansions import expansion_sign, expansion_sum, expansion_times_pair, minor_expansion, two_sum
from cdcore.numerics import FloatArray

ROUNDOFF = 2.0**-53
ORIENT3D_BOUND = (7.0 + 56.0 * ROUNDOFF) * ROUNDOFF
"""Relative to the permanent: what Shewchuk proves for the 3 x 3 determinant of rounded differences."""
CROSS2_BOUND = (3.0 + 16.0 * ROUNDOFF) * ROUNDOFF
"""The same for the 2 x 2 determinant."""
UNDERFLOW_GUARD = 1e-250
"""A determinant below this may have lost terms to underflow, which the relative bounds do not cover."""
OVERFLOW_GUARD = 1e300
"""A permanent above this may hide an overflowed term."""
WORKSPACE = 1024
"""Doubles that :func:`orientation_sign` needs: 3 x (16 + 64) for the terms, 192 + 192 for their sums, scratch
between.
"""


@njit(cache=True)
def orientation_filtered(p: FloatArray, a: int, b: int, c: int, d: int) -> int:
    """Sign of the volume (a-d) x (b-d) . (c-d) of rows a, b, c, d of p; 2 when the float64 bound cannot tell."""
    ax, ay, az = p[a, 0] - p[d, 0], p[a, 1] - p[d, 1], p[a, 2] - p[d, 2]
    bx, by, bz = p[b, 0] - p[d, 0], p[b, 1] - p[d, 1], p[b, 2] - p[d, 2]
    cx, cy, cz = p[c, 0] - p[d, 0], p[c, 1] - p[d, 1], p[c, 2] - p[d, 2]
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


@njit(cache=True)
def orientation_exact(p: FloatArray, a: int, b: int, c: int, d: int, w: FloatArray) -> int:
    """The same sign by expansions, never undecided; needs moderate exponents and a workspace of WORKSPACE doubles."""
    stay_one_function()
    axh, axt = two_sum(p[a, 0], -p[d, 0])
    ayh, ayt = two_sum(p[a, 1], -p[d, 1])
    azh, azt = two_sum(p[a, 2], -p[d, 2])
    bxh, bxt = two_sum(p[b, 0], -p[d, 0])
    byh, byt = two_sum(p[b, 1], -p[d, 1])
    bzh, bzt = two_sum(p[b, 2], -p[d, 2])
    cxh, cxt = two_sum(p[c, 0], -p[d, 0])
    cyh, cyt = two_sum(p[c, 1], -p[d, 1])
    czh, czt = two_sum(p[c, 2], -p[d, 2])
    # layout: 0 minor (16), 16 scratch (64), 80 / 144 / 208 the three terms (64 each), 272 sum of two (128), 400 all
    # (192)
    o = int(np.int64(0))
    s = o + 16
    length = minor_expansion(w, bxh, bxt, cyh, cyt, cxh, cxt, byh, byt, s, o)
    first = expansion_times_pair(w, o, length, azh, azt, s, o + 80)
    length = minor_expansion(w, cxh, cxt, ayh, ayt, axh, axt, cyh, cyt, s, o)
    second = expansion_times_pair(w, o, length, bzh, bzt, s, o + 144)
    length = minor_expansion(w, axh, axt, byh, byt, bxh, bxt, ayh, ayt, s, o)
    third = expansion_times_pair(w, o, length, czh, czt, s, o + 208)
    both = expansion_sum(w, o + 80, first, o + 144, second, o + 272)
    total = expansion_sum(w, o + 272, both, o + 208, third, o + 400)
    return expansion_sign(w, o + 400, total)


@njit(cache=True)
def orientation_sign(p: FloatArray, a: int, b: int, c: int, d: int, w: FloatArray) -> int:
    """Exact sign of the volume of rows a, b, c, d of p."""
    stay_one_function()
    sign = orientation_filtered(p, a, b, c, d)
    if sign == 2:
        sign = orientation_exact(p, a, b, c, d, w)
    return sign


@njit(cache=True)
def cross_sign(p: FloatArray, a: int, b: int, c: int, d: int, axis: int, w: FloatArray) -> int:
    """Exact sign of (b - a) x (d - c) seen along ``axis`` (0, 1, 2): turn to the left is 1."""
    stay_one_function()
    i = (axis + 1) % 3
    j = (axis + 2) % 3
    ux, uy = p[b, i] - p[a, i], p[b, j] - p[a, j]
    vx, vy = p[d, i] - p[c, i], p[d, j] - p[c, j]
    left, right = ux * vy, uy * vx
    determinant = left - right
    permanent = abs(left) + abs(right)
    size = abs(determinant)
    if size > CROSS2_BOUND * permanent and size > UNDERFLOW_GUARD and permanent < OVERFLOW_GUARD:
        return 1 if determinant > 0.0 else -1
    uxh, uxt = two_sum(p[b, i], -p[a, i])
    uyh, uyt = two_sum(p[b, j], -p[a, j])
    vxh, vxt = two_sum(p[d, i], -p[c, i])
    vyh, vyt = two_sum(p[d, j], -p[c, j])
    o = int(np.int64(0))
    length = minor_expansion(w, uxh, uxt, vyh, vyt, uyh, uyt, vxh, vxt, o + 16, o)
    return expansion_sign(w, o, length)


def new_workspace() -> FloatArray:
    """A workspace for one thread."""
    return np.empty(WORKSPACE)
