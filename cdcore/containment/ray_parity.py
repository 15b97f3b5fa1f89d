"""Whether points are inside a closed mesh, by ray parity: in floats where they are certain, or exactly.

``point_state`` casts rays in the mesh's own frame along +x. A margin bounds how far every point may be
from its placed position; an answer is certain if moving all points, those of the mesh too, by that much changes no
crossing.

``point_inside`` is exact. The half-open rule (an edge belongs to the side of its lower end; a
point on an edge's line counts as above it) moves the ray infinitesimally off every vertex and edge, the same for all
triangles.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from cdcore.kernels.compiling import hot_kernel, kernel, never_inlined
from cdcore.numerics import ByteArray, FloatArray, IntArray
from cdcore.triangles.integers import Vector, difference, dot, integer_points, normal

OUTSIDE: Final = 0
INSIDE: Final = 1
UNCERTAIN: Final = 2

MOST_CELLS: Final = 256
"""Cells per side of the grid over a mesh: finer ones gain nothing below a million faces."""

OVERLAP: Final = 1e-3
"""Cells overlap by this share of the mesh, far above any margin; a larger margin makes every answer uncertain."""


class InsideGrid(NamedTuple):
    """Triangles of a closed mesh, (f, 3, 3), by the cells of their projection along x.

    ``lower``, ``upper`` (f, 3): least and largest coordinates of a triangle; ``box`` (2, 3): of all. ``size``: most
    metres from the origin. There are ``cells`` a side, ``scale`` a metre, each larger by ``overlap``; the triangles of
    a cell begin at ``start`` (cells^2 + 1,) in ``items``.
    """

    triangles: FloatArray
    lower: FloatArray
    upper: FloatArray
    box: FloatArray
    size: float
    cells: int
    scale: float
    overlap: float
    start: IntArray
    items: IntArray


def build_inside_grid(triangles: FloatArray) -> InsideGrid:
    """The grid over the triangles (f, 3, 3) of a closed mesh; of none one empty cell."""
    if not len(triangles):
        nothing, no_number = np.zeros((0, 3)), np.zeros(0, dtype=np.int64)
        return InsideGrid(
            triangles, nothing, nothing, np.zeros((2, 3)), 0.0, 1, 1.0, 0.0, np.zeros(2, np.int64), no_number
        )
    lower, upper = triangles.min(axis=1), triangles.max(axis=1)
    box = np.array([lower.min(axis=0), upper.max(axis=0)])
    extent = float((box[1] - box[0]).max())
    cells, overlap = int(min(max(np.sqrt(len(triangles) / 2), 1), MOST_CELLS)), OVERLAP * extent
    # A closed mesh has a size; the guard is for the smallest of doubles.
    scale = cells / max(extent, float(np.finfo(np.float64).tiny))
    first, last = (
        np.clip(((ends - box[0])[:, 1:] * scale).astype(np.int64), 0, cells - 1)
        for ends in (lower - overlap, upper + overlap)
    )
    rows, columns = (last - first + 1).T
    count = rows * columns
    triangle = np.repeat(np.arange(len(triangles)), count)
    row, column = np.divmod(np.arange(len(triangle)) - np.repeat(np.cumsum(count) - count, count), columns[triangle])
    cell = (first[triangle, 0] + row) * cells + first[triangle, 1] + column
    start = np.searchsorted(np.sort(cell), np.arange(cells**2 + 1))
    items = triangle[np.argsort(cell, kind="stable")]
    size = float(np.abs(triangles).sum(axis=2).max())
    return InsideGrid(triangles, lower, upper, box, size, cells, scale, overlap, start, items)


@kernel
def point_state(grid: InsideGrid, point: FloatArray, margin: float) -> int:
    """OUTSIDE, INSIDE or UNCERTAIN for a point (3,) with a margin, by a ray along +x."""
    never_inlined()
    y, z = (point[1] - grid.box[0, 1]) * grid.scale, (point[2] - grid.box[0, 2]) * grid.scale
    # Asked this way round, what is not a number is uncertain.
    if not (0.0 <= y < grid.cells and 0.0 <= z < grid.cells and margin < grid.overlap):
        return UNCERTAIN
    cell, reach, crossings = int(y) * grid.cells + int(z), 2.0 * margin, 0
    for index in range(grid.start[cell], grid.start[cell + 1]):
        face = grid.items[index]
        beside = point[0] > grid.upper[face, 0] + reach
        for k in (1, 2):
            beside |= point[k] < grid.lower[face, k] - reach or point[k] > grid.upper[face, k] + reach
        if not beside:
            state = triangle_crossed(grid.triangles[face], point, margin)
            if state == UNCERTAIN:
                return UNCERTAIN
            crossings += state
    return crossings & 1


@kernel
def states_of_points(grid: InsideGrid, points: FloatArray, margin: float) -> ByteArray:
    """The ``point_state`` of each of points (n, 3); a call for each would take longer than the answers."""
    states = np.empty(len(points), dtype=np.uint8)
    for k in range(len(points)):
        states[k] = point_state(grid, points[k], margin)
    return states


@hot_kernel
def triangle_crossed(corners: FloatArray, point: FloatArray, margin: float) -> int:
    """Whether a ray from a point (3,) along +x crosses a triangle (3, 3): INSIDE, OUTSIDE or UNCERTAIN."""
    never_inlined()
    least, most, opened = 1, -1, False
    for k in range(3):
        side = edge_side(corners, k, (k + 1) % 3, point, margin)
        least, most, opened = min(least, side), max(most, side), opened or side == 0
    if least < 0 and most > 0:
        return OUTSIDE
    if opened:
        return UNCERTAIN
    if point[0] < min(corners[0, 0], corners[1, 0], corners[2, 0]) - 2.0 * margin:
        return INSIDE
    side = plane_side(corners, point, margin)
    if side == 0:
        return UNCERTAIN
    return INSIDE if side == -least else OUTSIDE


@hot_kernel
def edge_side(corners: FloatArray, start: int, end: int, point: FloatArray, margin: float) -> int:
    """1 or -1: on which side of an edge the point lies in the projection; 0 if the margin leaves it open.

    With every coordinate off by the margin m, the cross product changes by at most 2 m (|e|_1 + |r|_1 + 4 m).
    """
    never_inlined()
    e, f = corners[end, 1] - corners[start, 1], corners[end, 2] - corners[start, 2]
    r, s = point[1] - corners[start, 1], point[2] - corners[start, 2]
    bound = 2.0 * margin * (abs(e) + abs(f) + abs(r) + abs(s) + 4.0 * margin)
    cross = e * s - f * r
    return 1 if cross > bound else -1 if cross < -bound else 0


@hot_kernel
def plane_side(corners: FloatArray, point: FloatArray, margin: float) -> int:
    """1 or -1: on which side of the triangle's plane the point lies; 0 if the margin leaves it open."""
    never_inlined()
    volume, size_e, size_f, size_r = 0.0, 6.0 * margin, 6.0 * margin, 6.0 * margin
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        e, g = corners[1, j] - corners[0, j], corners[1, k] - corners[0, k]
        f, h = corners[2, j] - corners[0, j], corners[2, k] - corners[0, k]
        r = point[i] - corners[0, i]
        volume += (e * h - g * f) * r
        size_e, size_f, size_r = size_e + abs(e), size_f + abs(f), size_r + abs(r)
    bound = 4.0 * margin * (size_e * size_f + size_f * size_r + size_r * size_e)
    return 1 if volume > bound else -1 if volume < -bound else 0


def point_inside(point: FloatArray, triangles: FloatArray) -> bool:
    """Whether a point (3,) is inside the surface of triangles (n, 3, 3) that is closed and does not hold the point.

    Exact for the numbers given. Source: parity of crossings.
    """
    return len(crossed_faces(point, triangles)[0]) % 2 == 1


def crossed_faces(point: FloatArray, triangles: FloatArray) -> tuple[list[int], list[int]]:
    """Numbers of the triangles (n, 3, 3) that a ray from a point (3,) along +x crosses, and 1 or -1 for each.

    1 where the normal points along the ray, so that the ray leaves there. Exact for the numbers given: floats decide
    what can be decided by comparing them, integers the rest. Source: the half-open rule is the usual one of polygon
    filling.
    """
    lower, upper = triangles.min(axis=1), triangles.max(axis=1)
    column = (lower[:, 1:] <= point[1:]).all(axis=1) & (upper[:, 1:] >= point[1:]).all(axis=1)
    column &= upper[:, 0] >= point[0]
    (start, *corners), _ = integer_points(np.concatenate([point[None], triangles[column].reshape(-1, 3)]))
    numbers, facings = [], []
    for face, a, b, c in zip(np.flatnonzero(column).tolist(), corners[::3], corners[1::3], corners[2::3], strict=True):
        if _passes_above(a, b, start) ^ _passes_above(b, c, start) ^ _passes_above(c, a, start):
            # whether the plane of the triangle lies beyond the point along +x
            upright = normal((a, b, c))
            if dot(upright, difference(start, a)) * upright[0] < 0:
                numbers.append(face)
                facings.append(1 if upright[0] > 0 else -1)
    return numbers, facings


def _passes_above(a: Vector, b: Vector, p: Vector) -> bool:
    """Whether the projection of edge ab along x passes above p (larger z at p's y), half open."""
    if (a[1] > p[1]) == (b[1] > p[1]):
        return False
    side = normal((a, b, p))[0]
    return side < 0 if a[1] < b[1] else side > 0
