"""Whether a moving box certainly stays clear of a resting one.

An axis must separate them at both ends of a part of the motion, by more than the motion can leave its chord.
"""

from __future__ import annotations

import numpy as np

from cdcore.kernels.compiling import hot_kernel, stay_one_function
from cdcore.numerics import FloatArray


@hot_kernel
def boxes_stay_apart(
    box_a: FloatArray, box_b: FloatArray, before: FloatArray, after: FloatArray, chord: float, margin: float,
    scratch: FloatArray,
) -> bool:  # fmt: skip
    """Whether node boxes (16,) of A and B are certainly apart while A goes from pose ``before`` to ``after`` (12,).

    ``chord`` bounds the norm of the difference of both rotations: turned, a box reaches further by at most that times
    its half diagonal. ``scratch`` (15,).
    """
    stay_one_function()
    wide = margin + chord * box_a[15]
    centre_ways(box_a, box_b, before, after, scratch)
    for k in range(3):
        x, y, z = box_b[3 + 3 * k], box_b[4 + 3 * k], box_b[5 + 3 * k]
        reach = box_b[12 + k] + wide
        for n in range(3):
            m = 6 + 3 * n
            reach += box_a[12 + n] * abs(x * scratch[m] + y * scratch[m + 1] + z * scratch[m + 2])
        if apart_along(x, y, z, reach, scratch):
            return True
    for n in range(3):
        x, y, z = scratch[6 + 3 * n], scratch[7 + 3 * n], scratch[8 + 3 * n]
        reach = box_a[12 + n] + wide
        for k in range(3):
            m = 3 + 3 * k
            reach += box_b[12 + k] * abs(x * box_b[m] + y * box_b[m + 1] + z * box_b[m + 2])
        if apart_along(x, y, z, reach, scratch):
            return True
    return False


@hot_kernel
def centre_ways(box_a: FloatArray, box_b: FloatArray, before: FloatArray, after: FloatArray, ways: FloatArray) -> None:
    """From B's centre to A's at both ends, ``ways[0:6]``, and A's axes seen from B at the first, ``ways[6:15]``."""
    for k in range(3):
        c = ((before[3 * k] * box_a[0] + before[3 * k + 1] * box_a[1]) + before[3 * k + 2] * box_a[2]) + before[9 + k]
        d = ((after[3 * k] * box_a[0] + after[3 * k + 1] * box_a[1]) + after[3 * k + 2] * box_a[2]) + after[9 + k]
        ways[k], ways[3 + k] = c - box_b[k], d - box_b[k]
    for n in range(3):
        for k in range(3):
            axis = 3 + 3 * n
            ways[6 + 3 * n + k] = (
                before[3 * k] * box_a[axis] + before[3 * k + 1] * box_a[axis + 1] + before[3 * k + 2] * box_a[axis + 2]
            )


@hot_kernel
def apart_along(x: float, y: float, z: float, reach: float, ways: FloatArray) -> bool:
    """Whether both ways between the centres, ``ways[0:3]`` and ``ways[3:6]``, go beyond ``reach`` on one side."""
    first = x * ways[0] + y * ways[1] + z * ways[2]
    second = x * ways[3] + y * ways[4] + z * ways[5]
    return bool(min(first, second) > reach or max(first, second) < -reach)


@hot_kernel
def turned_between(before: FloatArray, after: FloatArray) -> float:
    """Bound of the norm of the difference of two rotations (first 9 of each): the Frobenius norm, rounded up."""
    total = 0.0
    for k in range(9):
        total += (after[k] - before[k]) ** 2
    norm: float = np.sqrt(total) * (1.0 + 2.0**-40)
    return norm
