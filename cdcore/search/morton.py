"""The order of points along a Morton curve, in which those near each other in space mostly are near in memory."""

from typing import Final

import numpy as np

from cdcore.numerics import FloatArray, IntArray

MORTON_BITS: Final = 10


def morton_codes(points: FloatArray) -> IntArray:
    """Place of each point (n, 3) along a Morton curve: 10 bits per axis, scaled by the longest side of their box."""
    lower, upper = points.min(axis=0), points.max(axis=0)
    half_side = float((upper / 2.0 - lower / 2.0).max())
    code = np.zeros(len(points), dtype=np.int64)
    if half_side == 0.0:
        return code
    fraction = (points / 2.0 - lower / 2.0) / half_side
    cell = np.minimum((fraction * 2.0**MORTON_BITS).astype(np.int64), 2**MORTON_BITS - 1)
    for bit in range(MORTON_BITS):
        for axis in range(3):
            code |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    return code
