"""Sums and products of doubles without any rounding: every result is a list of components whose exact sum is the
answer.

An expansion lies in a workspace ``w`` at an offset and has a length; its components do not overlap and grow in size,
so the sign of the sum is the sign of its last component. The functions are exact as long as no product underflows or
overflows, which the callers guarantee by :func:`exponents_are_moderate`.

Source: J. R. Shewchuk, Adaptive precision floating-point arithmetic and fast robust geometric predicates (1997),
figures 6-13.
"""

from __future__ import annotations

from numba import njit

from cdcore.narrow.compiling import stay_one_function
from cdcore.numerics import FloatArray

SPLITTER = 134217729.0
"""2^27 + 1: cuts a double into two halves of 26 bits whose products are exact (Dekker)."""

SMALLEST_EXACT = 2.0**-200
"""A nonzero coordinate of at least this size has its last bit at or above 2^-252; products of three differences then
end above 2^-756, far from the subnormal range below 2^-1022 where a product would lose bits."""

LARGEST_EXACT = 2.0**200
"""Products of three differences of such coordinates stay below 2^604, far from overflow at 2^1024."""


@njit(cache=True)
def two_sum(a: float, b: float) -> tuple[float, float]:
    """a + b as (rounded sum, error); exact for any finite operands without overflow."""
    total = a + b
    b_virtual = total - a
    a_virtual = total - b_virtual
    return total, (a - a_virtual) + (b - b_virtual)


@njit(cache=True)
def two_product(a: float, b: float) -> tuple[float, float]:
    """A product as (rounded product, error); no fused multiply-add, so every machine gives the same bits."""
    product = a * b
    c = SPLITTER * a
    a_high = c - (c - a)
    a_low = a - a_high
    c = SPLITTER * b
    b_high = c - (c - b)
    b_low = b - b_high
    error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    return product, error


@njit(cache=True)
def expansion_sum(w: FloatArray, e: int, e_length: int, f: int, f_length: int, h: int) -> int:
    """Write the sum of the expansions at e and f to h (not overlapping them) without zeros; returns its length, at
    least 1.
    """
    stay_one_function()
    i, j, length = 0, 0, 0
    total = 0.0
    first = True
    while i < e_length or j < f_length:
        if j >= f_length or (i < e_length and abs(w[e + i]) < abs(w[f + j])):
            component = w[e + i]
            i += 1
        else:
            component = w[f + j]
            j += 1
        if first:
            total = component
            first = False
            continue
        total, error = two_sum(total, component)
        if error != 0.0:
            w[h + length] = error
            length += 1
    if total != 0.0 or length == 0:
        w[h + length] = total
        length += 1
    return length


@njit(cache=True)
def expansion_scale(w: FloatArray, e: int, e_length: int, b: float, h: int) -> int:
    """Write the expansion at e times the double b to h (not overlapping e) without zeros; returns its length, at
    least 1.
    """
    stay_one_function()
    length = 0
    total, error = two_product(w[e], b)
    if error != 0.0:
        w[h] = error
        length = 1
    for i in range(1, e_length):
        high, low = two_product(w[e + i], b)
        middle, error = two_sum(total, low)
        if error != 0.0:
            w[h + length] = error
            length += 1
        total, error = two_sum(high, middle)
        if error != 0.0:
            w[h + length] = error
            length += 1
    if total != 0.0 or length == 0:
        w[h + length] = total
        length += 1
    return length


@njit(cache=True)
def expansion_times_pair(w: FloatArray, e: int, e_length: int, head: float, tail: float, scratch: int, h: int) -> int:
    """Write the expansion at e times (head + tail) to h; ``scratch`` needs room for 4 e_length components."""
    stay_one_function()
    if tail == 0.0:
        return expansion_scale(w, e, e_length, head, h)
    low = expansion_scale(w, e, e_length, tail, scratch)
    high = expansion_scale(w, e, e_length, head, scratch + 2 * e_length)
    return expansion_sum(w, scratch, low, scratch + 2 * e_length, high, h)


@njit(cache=True)
def minor_expansion(
    w: FloatArray,
    ah: float,
    at: float,
    bh: float,
    bt: float,
    ch: float,
    ct: float,
    dh: float,
    dt: float,
    scratch: int,
    h: int,
) -> int:
    """Write (ah + at)(bh + bt) - (ch + ct)(dh + dt) to h, at most 16 components; ``scratch`` needs room for 32."""
    stay_one_function()
    w[scratch] = at
    w[scratch + 1] = ah
    skip = 1 if at == 0.0 else 0
    first = expansion_times_pair(w, scratch + skip, 2 - skip, bh, bt, scratch + 2, scratch + 16)
    w[scratch] = -ct
    w[scratch + 1] = -ch
    skip = 1 if ct == 0.0 else 0
    second = expansion_times_pair(w, scratch + skip, 2 - skip, dh, dt, scratch + 2, scratch + 24)
    return expansion_sum(w, scratch + 16, first, scratch + 24, second, h)


@njit(cache=True)
def expansion_sign(w: FloatArray, e: int, length: int) -> int:
    """-1, 0 or 1: the sign of the exact sum."""
    last = w[e + length - 1]
    if last > 0.0:
        return 1
    if last < 0.0:
        return -1
    return 0


@njit(cache=True)
def exponents_are_moderate(points: FloatArray) -> bool:
    """True where exact arithmetic on these coordinates (n, 3) can neither underflow nor overflow."""
    for i in range(points.shape[0]):
        for k in range(3):
            size = abs(points[i, k])
            if size > LARGEST_EXACT or (size < SMALLEST_EXACT and size != 0.0):
                return False
    return True
