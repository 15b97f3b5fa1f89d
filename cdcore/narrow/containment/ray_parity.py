"""Whether points are inside a closed mesh, by ray parity: many at once in floats, one exactly.

``InsideGrid`` casts rays in the mesh's own frame along one of its axes. A margin bounds how far every point may be from
its placed position; an answer is certain if moving all points, those of the mesh too, by that much changes no crossing.

``point_inside`` is exact. Its ray runs along +x. The half-open rule (an edge belongs to the side of its lower end; a
point on an edge's line counts as above it) moves the ray infinitesimally off every vertex and edge, the same for all
triangles.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdcore.numerics import FloatArray, IntArray

Point = tuple[Fraction, Fraction, Fraction]

OUTSIDE: Final = 0
INSIDE: Final = 1
UNCERTAIN: Final = 2
States = NDArray[np.int8]

MOST_CELLS: Final = 256
"""Cells per side of the grid over a mesh: finer ones gain nothing below a million faces."""

OVERLAP: Final = 1e-3
"""Cells overlap by this share of the mesh, far above any margin; a larger margin makes every answer uncertain."""

MOST_POINTS: Final = 4096
"""Points tested together, so that memory stays at some tens of megabytes."""


class InsideGrid:
    """Triangles of a closed mesh, (f, 3, 3), by the cells of their projection along each axis."""

    def __init__(self, triangles: FloatArray) -> None:
        self._triangles = triangles
        self._low, self._high = triangles.min(axis=1), triangles.max(axis=1)
        corner, extent = self._low.min(axis=0), float((self._high.max(axis=0) - self._low.min(axis=0)).max())
        self._cells = int(min(max(np.sqrt(len(triangles) / 2), 1), MOST_CELLS))
        self._overlap = OVERLAP * extent
        self._corner = corner - 2 * self._overlap
        # A closed mesh has a size; the guard is for the smallest of doubles.
        self._scale = self._cells / max(extent + 4 * self._overlap, np.finfo(np.float64).tiny)
        self._lists = [self._list_along(axis) for axis in range(3)]

    def parity(self, points: FloatArray, margins: FloatArray, axis: int) -> States:
        """OUTSIDE, INSIDE or UNCERTAIN for points (K, 3) with margins (K,), by rays along +``axis``."""
        parts = range(0, len(points), MOST_POINTS)
        states = [self._parity(points[k : k + MOST_POINTS], margins[k : k + MOST_POINTS], axis) for k in parts]
        return np.concatenate(states) if states else np.zeros(0, dtype=np.int8)

    def _parity(self, points: FloatArray, margins: FloatArray, axis: int) -> States:
        start, items = self._lists[axis]
        u, v = (axis + 1) % 3, (axis + 2) % 3
        place = (points[:, [u, v]] - self._corner[[u, v]]) * self._scale
        known = ((place >= 0) & (place < self._cells)).all(axis=1) & (margins < self._overlap)
        cell = np.where(known, place[:, 0].astype(np.int64) * self._cells + place[:, 1].astype(np.int64), 0)
        count = np.where(known, start[cell + 1] - start[cell], 0)
        point, within = _ragged(count)
        triangle = items[start[cell[point]] + within]
        crossed = self._crossed(triangle, points[point], margins[point], axis)
        crossings = np.bincount(point[crossed == INSIDE], minlength=len(points))
        open_ones = np.bincount(point[crossed == UNCERTAIN], minlength=len(points))
        return np.where(known & (open_ones == 0), crossings & 1, UNCERTAIN).astype(np.int8)

    def _crossed(self, triangle: IntArray, points: FloatArray, margins: FloatArray, axis: int) -> States:
        """Whether the ray of each row crosses the triangle of that row."""
        plane = [(axis + 1) % 3, (axis + 2) % 3]
        reach = 2.0 * margins[:, None]
        low, high = self._low[triangle], self._high[triangle]
        beside = ((points < low - reach) | (points > high + reach))[:, plane].any(axis=1)
        beside |= points[:, axis] > high[:, axis] + reach[:, 0]
        crossed = np.zeros(len(points), dtype=np.int8)
        near = np.flatnonzero(~beside)
        crossed[near] = triangles_crossed(self._triangles[triangle[near]], points[near], margins[near], axis)
        return crossed

    def _list_along(self, axis: int) -> tuple[IntArray, IntArray]:
        """Where the triangles of each cell begin, (cells^2 + 1,), and their numbers."""
        plane = [(axis + 1) % 3, (axis + 2) % 3]
        first = self._cell_of(self._low[:, plane] - self._overlap, plane)
        last = self._cell_of(self._high[:, plane] + self._overlap, plane)
        span = last - first + 1
        triangle, within = _ragged(span[:, 0] * span[:, 1])
        row, column = np.divmod(within, span[triangle, 1])
        cell = (first[triangle, 0] + row) * self._cells + first[triangle, 1] + column
        order = np.argsort(cell, kind="stable")
        start = np.zeros(self._cells**2 + 1, dtype=np.int64)
        np.cumsum(np.bincount(cell, minlength=self._cells**2), out=start[1:])
        return start, triangle[order]

    def _cell_of(self, places: FloatArray, plane: list[int]) -> IntArray:
        cell = ((places - self._corner[plane]) * self._scale).astype(np.int64)
        clipped: IntArray = np.clip(cell, 0, self._cells - 1)
        return clipped


def triangles_crossed(triangles: FloatArray, points: FloatArray, margins: FloatArray, axis: int) -> States:
    """Whether rays from points (K, 3) along +``axis`` cross triangles (K, 3, 3), row by row, with margins (K,)."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    sides = np.stack([_edge_side(s, e, points, margins, axis) for s, e in ((a, b), (b, c), (c, a))])
    beside = (sides.min(axis=0) < 0) & (sides.max(axis=0) > 0)
    within = (sides != 0).all(axis=0)
    ahead = np.where(_plane_side(a, b, c, points, margins) == 0, UNCERTAIN, OUTSIDE)
    ahead[_plane_side(a, b, c, points, margins) == -sides[0]] = INSIDE
    ahead[points[:, axis] < triangles[:, :, axis].min(axis=1) - 2.0 * margins] = INSIDE
    return np.where(beside, OUTSIDE, np.where(within, ahead, UNCERTAIN)).astype(np.int8)


def _edge_side(a: FloatArray, b: FloatArray, points: FloatArray, margins: FloatArray, axis: int) -> States:
    """1 or -1: on which side of each edge the point lies in the projection; 0 if the margin leaves it open.

    With every coordinate off by the margin m, the cross product changes by at most 2 m (|e|_1 + |r|_1 + 4 m).
    """
    u, v = (axis + 1) % 3, (axis + 2) % 3
    edge, away = b - a, points - a
    cross = edge[:, u] * away[:, v] - edge[:, v] * away[:, u]
    size = np.abs(edge[:, u]) + np.abs(edge[:, v]) + np.abs(away[:, u]) + np.abs(away[:, v])
    return _sign(cross, 2.0 * margins * (size + 4.0 * margins))


def _plane_side(a: FloatArray, b: FloatArray, c: FloatArray, points: FloatArray, margins: FloatArray) -> States:
    """1 or -1: on which side of the triangle's plane the point lies; 0 if the margin leaves it open."""
    e, f, r = b - a, c - a, points - a
    volume = np.einsum("kd,kd->k", np.cross(e, f), r)
    size_e, size_f, size_r = (np.abs(each).sum(axis=1) + 6.0 * margins for each in (e, f, r))
    return _sign(volume, 4.0 * margins * (size_e * size_f + size_f * size_r + size_r * size_e))


def _sign(values: FloatArray, bounds: FloatArray) -> States:
    return (values > bounds).astype(np.int8) - (values < -bounds).astype(np.int8)


def _ragged(counts: IntArray) -> tuple[IntArray, IntArray]:
    """Row k repeated ``counts[k]`` times, and the number within its row, for all rows."""
    rows = np.repeat(np.arange(len(counts)), counts)
    first = np.cumsum(counts) - counts
    return rows, np.arange(len(rows)) - first[rows]


def point_inside(point: FloatArray, triangles: FloatArray) -> bool:
    """Whether a point (3,) is inside the surface of triangles (n, 3, 3) that is closed and does not hold the point.

    Exact for the numbers given: floats decide what can be decided by comparing them, fractions the rest. Source: parity
    of crossings; the half-open rule is the usual one of polygon filling.
    """
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    column = (low[:, 1:] <= point[1:]).all(axis=1) & (high[:, 1:] >= point[1:]).all(axis=1)
    column &= high[:, 0] >= point[0]
    start = _exact(point)
    inside = False
    for corners in triangles[column]:
        a, b, c = (_exact(corner) for corner in corners)
        if _above(a, b, start) ^ _above(b, c, start) ^ _above(c, a, start):
            inside ^= _lies_ahead(a, b, c, start)
    return inside


def _exact(point: FloatArray) -> Point:
    x, y, z = (Fraction(float(value)) for value in np.asarray(point))
    return x, y, z


def _above(a: Point, b: Point, p: Point) -> bool:
    """Whether the projection of edge ab along x passes above p (larger z at p's y), half open."""
    if (a[1] > p[1]) == (b[1] > p[1]):
        return False
    if a[1] > b[1]:
        a, b = b, a
    return (b[1] - a[1]) * (p[2] - a[2]) < (b[2] - a[2]) * (p[1] - a[1])


def _lies_ahead(a: Point, b: Point, c: Point, p: Point) -> bool:
    """Whether the plane of the triangle lies beyond p along +x."""
    e, f, r = ([q[k] - a[k] for k in range(3)] for q in (b, c, p))
    nx, ny, nz = (e[i] * f[j] - e[j] * f[i] for i, j in ((1, 2), (2, 0), (0, 1)))
    return (nx * r[0] + ny * r[1] + nz * r[2]) * nx < 0
