"""Whether a moving box or face certainly stays clear of a resting one.

A direction must separate them at both ends of a part of the motion, by more than the motion can leave its chord. Each
direction is measured on the corners at both ends, however it was found.
"""

from __future__ import annotations

import numpy as np

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel, runtime_int, stay_one_function
from cdcore.numerics import FloatArray

CORNERS = 27
"""Doubles of the corners of one face pair: A's at the start 9 and at the end 9, B's 9."""


@hot_kernel
def separates(c: FloatArray, x: float, y: float, z: float, margin: float) -> bool:
    """Whether the direction keeps the corners ``c`` (27,) apart by more than ``margin`` at both ends.

    Compared as squares, so that no direction need be divided by its length; where a square underflows, the answer is
    False or right.
    """
    a0, a1, a2 = along(c, 0, x, y, z), along(c, 3, x, y, z), along(c, 6, x, y, z)
    a3, a4, a5 = along(c, 9, x, y, z), along(c, 12, x, y, z), along(c, 15, x, y, z)
    b0, b1, b2 = along(c, 18, x, y, z), along(c, 21, x, y, z), along(c, 24, x, y, z)
    above = min(min(min(a0, a1), min(a2, a3)), min(a4, a5)) - max(max(b0, b1), b2)
    below = min(min(b0, b1), b2) - max(max(max(a0, a1), max(a2, a3)), max(a4, a5))
    gap = max(above, below)
    if gap * gap == np.inf:
        longest = max(abs(x), max(abs(y), abs(z)))
        x, y, z, gap = x / longest, y / longest, z / longest, gap / longest
    return bool(gap > 0.0 and gap * gap > margin * margin * (x * x + y * y + z * z))


@hot_kernel
def along(c: FloatArray, k: int, x: float, y: float, z: float) -> float:
    """Corner ``c[k:k + 3]`` along a direction."""
    become_part_of_caller()
    length: float = x * c[k] + y * c[k + 1] + z * c[k + 2]
    return length


@hot_kernel
def edge(p: FloatArray, first: int, k: int, out: FloatArray, at: int) -> None:
    """Edge ``k`` of the face whose corners start at ``p[first]``, to ``out[at:at + 3]``."""
    i, j = first + 3 * k, first + 3 * ((k + 1) % 3)
    for n in range(3):
        out[at + n] = p[j + n] - p[i + n]


@hot_kernel
def faces_stay_apart(c: FloatArray, margin: float, scratch: FloatArray) -> bool:
    """Whether the faces with corners ``c`` (27,) are certainly apart all the way; ``scratch`` (32,).

    Directions are those of the middle of the way: both planes, pairs of edges, the nearest points of edges.
    """
    stay_one_function()
    # scratch: corners of A in the middle 9, edges of A 9, of B 9, a direction 3
    o = runtime_int(0)
    for k in range(3):
        edge(c, 18, k, scratch, 18 + 3 * k)
    if cross_separates(c, scratch, o + 18, o + 21, margin):
        return True
    for k in range(9):
        scratch[k] = 0.5 * (c[k] + c[9 + k])
    for k in range(3):
        edge(scratch, 0, k, scratch, 9 + 3 * k)
    if cross_separates(c, scratch, o + 9, o + 12, margin):
        return True
    for i in range(9, 18, 3):
        for j in range(18, 27, 3):
            if cross_separates(c, scratch, i, j, margin):
                return True
    way_between_edges(scratch, 0, c, 18, scratch[27:30])
    return bool(separates(c, scratch[27], scratch[28], scratch[29], margin))


@hot_kernel
def way_between_edges(p: FloatArray, a: int, q: FloatArray, b: int, way: FloatArray) -> None:
    """The way (3,) between the nearest points of the edges of two faces, corners ``p[a:a + 9]`` and ``q[b:b + 9]``, to
    the first. An edge may be a point.

    Source: C. Ericson, Real-Time Collision Detection, 2005, section 5.1.
    """
    stay_one_function()
    best = np.inf
    for i in range(3):
        i0, i1 = a + 3 * i, a + 3 * ((i + 1) % 3)
        ux, uy, uz = p[i1] - p[i0], p[i1 + 1] - p[i0 + 1], p[i1 + 2] - p[i0 + 2]
        uu = ux * ux + uy * uy + uz * uz
        for j in range(3):
            j0, j1 = b + 3 * j, b + 3 * ((j + 1) % 3)
            vx, vy, vz = q[j1] - q[j0], q[j1 + 1] - q[j0 + 1], q[j1 + 2] - q[j0 + 2]
            wx, wy, wz = p[i0] - q[j0], p[i0 + 1] - q[j0 + 1], p[i0 + 2] - q[j0 + 2]
            vv, uv = vx * vx + vy * vy + vz * vz, ux * vx + uy * vy + uz * vz
            uw, vw = ux * wx + uy * wy + uz * wz, vx * wx + vy * wy + vz * wz
            spread = uu * vv - uv * uv
            s = min(1.0, max(0.0, (uv * vw - vv * uw) / spread)) if spread > 0.0 else 0.0
            t = (uv * s + vw) / vv if vv > 0.0 else 0.0
            if t < 0.0 or t > 1.0 or vv == 0.0:
                t = min(1.0, max(0.0, t))
                s = min(1.0, max(0.0, (uv * t - uw) / uu)) if uu > 0.0 else 0.0
            dx, dy, dz = wx + s * ux - t * vx, wy + s * uy - t * vy, wz + s * uz - t * vz
            distance = dx * dx + dy * dy + dz * dz
            if distance < best:
                best = distance
                way[0], way[1], way[2] = dx, dy, dz


@hot_kernel
def cross_separates(c: FloatArray, e: FloatArray, i: int, j: int, margin: float) -> bool:
    """Whether the direction perpendicular to ``e[i:i + 3]`` and ``e[j:j + 3]`` separates the corners."""
    become_part_of_caller()
    x, y = e[i + 1] * e[j + 2] - e[i + 2] * e[j + 1], e[i + 2] * e[j] - e[i] * e[j + 2]
    return bool(separates(c, x, y, e[i] * e[j + 1] - e[i + 1] * e[j], margin))


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
        x, y, z = box_b[3 + k], box_b[6 + k], box_b[9 + k]
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
            reach += box_b[12 + k] * abs(x * box_b[3 + k] + y * box_b[6 + k] + z * box_b[9 + k])
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
            ways[6 + 3 * n + k] = (
                before[3 * k] * box_a[3 + n] + before[3 * k + 1] * box_a[6 + n] + before[3 * k + 2] * box_a[9 + n]
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
