"""The generalised winding number of a surface, open or closed: how often it goes round a point.

Inside a sound solid it is 1, outside 0, in the common of two crossing shells 2. At a point near a hole it lies between:
it differs from a whole number by the solid angle of the hole, as a share of the whole sphere.

``winding_number`` sums solid angles of all faces: the reference, which tests compare everything with. Where caps close
the holes of a surface, the sum over surface and caps is a whole number, which one ray counts (``ray_crossings``); so
the winding number of the surface alone is that number less the solid angle of the few faces of the caps.

Source: A. Jacobson, L. Kavan, O. Sorkine-Hornung, Robust inside-outside segmentation using generalized winding numbers,
ACM Transactions on Graphics 32(4), 2013; A. Van Oosterom, J. Strackee, The solid angle of a plane triangle, IEEE
Transactions on Biomedical Engineering 30(2), 1983.
"""

from __future__ import annotations

from math import atan2, pi, sqrt
from typing import Final

import numpy as np

from cdcore.containment.ray_parity import UNCERTAIN, InsideGrid, triangle_crossed
from cdcore.kernels.compiling import hot_kernel, kernel, never_inlined
from cdcore.numerics import FloatArray, IntArray

RAY_UNCERTAIN: Final = -1
"""What ``ray_crossings`` returns where the margin leaves a crossing open."""


def winding_number(points: FloatArray, triangles: FloatArray) -> FloatArray:
    """The generalised winding number of triangles (f, 3, 3) at points (n, 3), (n,): a sum of solid angles.

    The slow reference. Cost: n f, in memory too.
    """
    a, b, c = np.moveaxis(triangles[None] - points[:, None, None], 2, 0)
    length_a, length_b, length_c = (np.linalg.norm(corner, axis=-1) for corner in (a, b, c))
    volume = np.einsum("nfk,nfk->nf", a, np.cross(b, c))
    dot_ab, dot_bc, dot_ca = (np.einsum("nfk,nfk->nf", p, q) for p, q in ((a, b), (b, c), (c, a)))
    below = length_a * length_b * length_c + dot_ab * length_c + dot_bc * length_a + dot_ca * length_b
    total: FloatArray = np.arctan2(volume, below).sum(axis=1) / (2.0 * np.pi)
    return total


@kernel
def winding_numbers(points: FloatArray, triangles: FloatArray) -> FloatArray:
    """``winding_number`` face by face, in no more memory than the answer (n,)."""
    numbers = np.empty(len(points))
    for n in range(len(points)):
        numbers[n] = winding_number_at(points[n], triangles, 0, len(triangles))
    return numbers


@hot_kernel
def winding_number_at(point: FloatArray, triangles: FloatArray, first: int, stop: int) -> float:
    """The generalised winding number of triangles ``first`` to ``stop`` of (f, 3, 3) at a point (3,)."""
    never_inlined()
    total = 0.0
    for f in range(first, stop):
        ax, ay, az = triangles[f, 0, 0] - point[0], triangles[f, 0, 1] - point[1], triangles[f, 0, 2] - point[2]
        bx, by, bz = triangles[f, 1, 0] - point[0], triangles[f, 1, 1] - point[1], triangles[f, 1, 2] - point[2]
        cx, cy, cz = triangles[f, 2, 0] - point[0], triangles[f, 2, 1] - point[1], triangles[f, 2, 2] - point[2]
        volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
        length_a = sqrt(ax * ax + ay * ay + az * az)
        length_b = sqrt(bx * bx + by * by + bz * bz)
        length_c = sqrt(cx * cx + cy * cy + cz * cz)
        below = length_a * length_b * length_c
        below += (ax * bx + ay * by + az * bz) * length_c
        below += (bx * cx + by * cy + bz * cz) * length_a
        below += (cx * ax + cy * ay + cz * az) * length_b
        total += atan2(volume, below)
    return total / (2.0 * pi)


@hot_kernel
def ray_crossings(grid: InsideGrid, component: IntArray, point: FloatArray, margin: float, crossings: IntArray) -> int:
    """Count how often each closed part goes round a point (3,), by a ray along +x.

    ``component`` (f,) is the part of each triangle of the grid; ``crossings`` (K,) gets the whole winding number of
    each. Returns 0, or ``RAY_UNCERTAIN`` where moving every point by the margin could change a crossing.
    """
    never_inlined()
    crossings[:] = 0
    for i in range(3):
        if point[i] < grid.box[0, i] - margin or point[i] > grid.box[1, i] + margin:
            return 0
    y, z = (point[1] - grid.box[0, 1]) * grid.scale, (point[2] - grid.box[0, 2]) * grid.scale
    # Asked this way round, what is not a number is uncertain.
    if not (0.0 <= y < grid.cells and 0.0 <= z < grid.cells and margin < grid.overlap):
        return RAY_UNCERTAIN
    cell, reach = int(y) * grid.cells + int(z), 2.0 * margin
    for k in range(grid.start[cell], grid.start[cell + 1]):
        face = grid.items[k]
        beside = point[0] > grid.upper[face, 0] + reach
        for i in (1, 2):
            beside |= point[i] < grid.lower[face, i] - reach or point[i] > grid.upper[face, i] + reach
        if beside:
            continue
        state = triangle_crossed(grid.triangles[face], point, margin)
        if state == UNCERTAIN:
            return RAY_UNCERTAIN
        if state:
            crossings[component[face]] += facing_sign(grid.triangles[face])
    return 0


@hot_kernel
def facing_sign(corners: FloatArray) -> int:
    """1 where the normal of a triangle (3, 3) points along +x, so that a ray leaves through it; -1 where it enters."""
    never_inlined()
    e, f = corners[1, 1] - corners[0, 1], corners[1, 2] - corners[0, 2]
    r, s = corners[2, 1] - corners[0, 1], corners[2, 2] - corners[0, 2]
    return 1 if e * s - f * r > 0.0 else -1
