"""Separating axes of two boxes: fifteen for oriented ones, or the six face normals alone.

``m[i, j]`` is the dot product of axis i of A and axis j of B, ``d`` the way from A's centre to B's in A's axes. Boxes
closer than ``pad`` along every axis asked about are not apart.

Source: S. Gottschalk, M. C. Lin, D. Manocha, OBBTree (1996); G. van den Bergen, Efficient collision detection of
complex deformable models using AABB trees (1997), for the six-axis form.
"""

import numpy as np

from cdcore.kernels.compiling import hot_kernel, never_inlined
from cdcore.numerics import FloatArray


@hot_kernel
def separated_on_face_axes(m: FloatArray, d: FloatArray, half_a: FloatArray, half_b: FloatArray, pad: float) -> bool:
    """Whether one of the six face normals keeps the boxes apart; it may leave boxes together that are not."""
    never_inlined()
    for i in range(3):
        reach = abs(m[i, 0]) * half_b[0] + abs(m[i, 1]) * half_b[1] + abs(m[i, 2]) * half_b[2]
        if abs(d[i]) > half_a[i] + reach + pad:
            return True
    for j in range(3):
        reach = abs(m[0, j]) * half_a[0] + abs(m[1, j]) * half_a[1] + abs(m[2, j]) * half_a[2]
        if abs(d[0] * m[0, j] + d[1] * m[1, j] + d[2] * m[2, j]) > half_b[j] + reach + pad:
            return True
    return False


@hot_kernel
def gap_on_face_axes(m: FloatArray, d: FloatArray, half_a: FloatArray, half_b: FloatArray) -> float:
    """A distance that the boxes certainly keep: the longest gap along a face normal; not positive without one."""
    never_inlined()
    longest = -np.inf
    for i in range(3):
        gap = abs(d[i]) - half_a[i]
        gap -= abs(m[i, 0]) * half_b[0] + abs(m[i, 1]) * half_b[1] + abs(m[i, 2]) * half_b[2]
        if gap > longest:
            longest = gap
    for j in range(3):
        gap = abs(d[0] * m[0, j] + d[1] * m[1, j] + d[2] * m[2, j]) - half_b[j]
        gap -= abs(m[0, j]) * half_a[0] + abs(m[1, j]) * half_a[1] + abs(m[2, j]) * half_a[2]
        if gap > longest:
            longest = gap
    return longest


@hot_kernel
def separated_on_all_axes(m: FloatArray, d: FloatArray, half_a: FloatArray, half_b: FloatArray, pad: float) -> bool:
    """Whether one of the six face normals or nine products of edges keeps the boxes apart."""
    never_inlined()
    if separated_on_face_axes(m, d, half_a, half_b, pad):
        return True
    for i in range(3):
        u, v = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            p, q = (j + 1) % 3, (j + 2) % 3
            reach = half_a[u] * abs(m[v, j]) + half_a[v] * abs(m[u, j])
            reach += half_b[p] * abs(m[i, q]) + half_b[q] * abs(m[i, p])
            if abs(d[v] * m[u, j] - d[u] * m[v, j]) > reach + pad:
                return True
    return False


@hot_kernel
def relative_box(
    centre_a: FloatArray,
    axes_a: FloatArray,
    centre_b: FloatArray,
    axes_b: FloatArray,
    rotation: FloatArray,
    move: FloatArray,
    m: FloatArray,
    d: FloatArray,
) -> None:
    """``m`` and ``d`` of two boxes whose axes are the rows of ``axes``, with B's pose in A's frame."""
    never_inlined()
    for i in range(3):
        placed = rotation[i, 0] * centre_b[0] + rotation[i, 1] * centre_b[1] + rotation[i, 2] * centre_b[2]
        d[i] = placed + move[i] - centre_a[i]
    offset_x, offset_y, offset_z = d[0], d[1], d[2]
    for i in range(3):
        x, y, z = axes_a[i, 0], axes_a[i, 1], axes_a[i, 2]
        d[i] = x * offset_x + y * offset_y + z * offset_z
        u = x * rotation[0, 0] + y * rotation[1, 0] + z * rotation[2, 0]
        v = x * rotation[0, 1] + y * rotation[1, 1] + z * rotation[2, 1]
        w = x * rotation[0, 2] + y * rotation[1, 2] + z * rotation[2, 2]
        for j in range(3):
            m[i, j] = u * axes_b[j, 0] + v * axes_b[j, 1] + w * axes_b[j, 2]
