"""Sums of products of doubles without any rounding, and their sign: every product is added to a row of integer digits.

A product of two doubles is two doubles (its rounded value and the error), a product of three is four; every one of
them is added to 32-bit digits kept in 64-bit integers, so that hundreds fit before carries need to be resolved.
Nothing rounds as long as no product under- or overflows, which the callers guarantee by
:func:`exponents_are_moderate`.

Source: T. J. Dekker, A floating-point technique for extending the available precision (1971), for exact products;
U. Kulisch, Computer Arithmetic and Validity (2008), for the long accumulator.
Differs: floating-point expansions (Shewchuk 1997) were as fast and took three times as long to compile (2026-11).
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types

from cdcore.kernels.compiling import always_inlined, hot_kernel, machine_operation, never_inlined
from cdcore.kernels.memory import Memory
from cdcore.numerics import IntArray

SPLITTER = 134217729.0
"""2^27 + 1: cuts a double into two halves of 26 bits whose products are exact (Dekker)."""

SMALLEST_EXACT = 2.0**-200
"""A nonzero coordinate of at least this size has its last bit at or above 2^-252; every part of a product of three
differences is then a multiple of 2^-756, far from the subnormal range below 2^-1022 where a product would lose bits."""

LARGEST_EXACT = 2.0**200
"""Products of three differences of such coordinates stay below 2^604, far from overflow at 2^1024."""

LOWEST_BIT = -800
"""The first digit counts 2^-800: below every bit that can occur."""
DIGITS = 48
"""48 x 32 bits reach from 2^-800 to 2^736: above every sum that can occur, its carry included."""


def _bits_of(_context: Any, _number: Any) -> Any:
    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], ir.IntType(64))

    return types.int64(types.float64), generate


bits_of: Callable[[float], int] = machine_operation(_bits_of, lambda number: int(np.float64(number).view(np.int64)))
"""The 64 bits of a double as an integer."""


@hot_kernel
def two_sum(a: float, b: float) -> tuple[float, float]:
    """a + b as (rounded sum, error); exact for any finite operands without overflow."""
    total = a + b
    b_virtual = total - a
    a_virtual = total - b_virtual
    return total, (a - a_virtual) + (b - b_virtual)


@hot_kernel
def two_product(a: float, b: float) -> tuple[float, float]:
    """A product as (rounded product, error); no fused multiply-add, so every machine gives the same bits."""
    product = a * b
    c = SPLITTER * a
    a_upper = c - (c - a)
    a_lower = a - a_upper
    c = SPLITTER * b
    b_upper = c - (c - b)
    b_lower = b - b_upper
    error = ((a_upper * b_upper - product) + a_upper * b_lower + a_lower * b_upper) + a_lower * b_lower
    return product, error


@hot_kernel
def clear_digits(digits: Memory) -> None:
    """Start a sum at zero."""
    always_inlined()
    for k in range(DIGITS):
        digits[k] = 0


@hot_kernel
def add_double(digits: Memory, value: float) -> None:
    """Add one double, exactly."""
    bits = bits_of(value)
    position = ((bits >> 52) & 0x7FF) - 1075 - LOWEST_BIT
    if value == 0.0:
        return
    whole = (bits & 0xFFFFFFFFFFFFF) | 0x10000000000000
    digit, shift = position >> 5, position & 31
    lower = (whole & 0xFFFFFFFF) << shift
    upper = (whole >> 32) << shift
    if bits < 0:
        digits[digit] -= lower & 0xFFFFFFFF
        digits[digit + 1] -= (lower >> 32) + (upper & 0xFFFFFFFF)
        digits[digit + 2] -= upper >> 32
    else:
        digits[digit] += lower & 0xFFFFFFFF
        digits[digit + 1] += (lower >> 32) + (upper & 0xFFFFFFFF)
        digits[digit + 2] += upper >> 32


@hot_kernel
def add_product(digits: Memory, a: float, b: float) -> None:
    """Add a b, exactly."""
    product, error = two_product(a, b)
    add_double(digits, product)
    add_double(digits, error)


@hot_kernel
def sign_of_digits(digits: Memory) -> int:
    """-1, 0 or 1: the sign of the sum; the digits are spent."""
    carry = 0
    any_left = False
    for k in range(DIGITS):
        value = digits[k] + carry
        carry = value >> 32
        any_left |= (value & 0xFFFFFFFF) != 0
    if carry < 0:
        return -1
    return 1 if any_left or carry > 0 else 0


@hot_kernel
def exponents_are_moderate(points: Memory, count: int) -> bool:
    """True where exact arithmetic on these ``count`` coordinates can neither underflow nor overflow."""
    never_inlined()
    moderate = True
    for k in range(count):
        size = abs(points[k])
        moderate &= size <= LARGEST_EXACT and (size >= SMALLEST_EXACT or size == 0.0)
    return moderate


def new_digits() -> IntArray:
    """Room for one sum; one for each thread."""
    return np.zeros(DIGITS, dtype=np.int64)
