"""Compiled ray parity against a closed mesh: certain answers only, *uncertain* where rounding could matter.

The ray starts at a point in the mesh's own frame and runs along one of its axes. ``margin`` bounds how far every
point may be from where the points that count put it; an answer is certain if moving all points by that much changes
no crossing.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cdcore.numerics import FloatArray, IntArray

OUTSIDE, INSIDE, UNCERTAIN = 0, 1, 2


@njit(cache=True)
def cell_range(
    triangle: FloatArray, u: int, v: int, low: FloatArray, scale: FloatArray, grow: float, cells: int, out: IntArray
) -> None:
    """``out`` (4,): first and last cell along u and v that a triangle's projection, grown by ``grow``, touches."""
    for k in range(2):
        axis = u if k == 0 else v
        least = min(triangle[0, axis], triangle[1, axis], triangle[2, axis]) - grow
        most = max(triangle[0, axis], triangle[1, axis], triangle[2, axis]) + grow
        out[2 * k] = min(max(int((least - low[k]) * scale[k]), 0), cells - 1)
        out[2 * k + 1] = min(max(int((most - low[k]) * scale[k]), 0), cells - 1)


@njit(cache=True)
def count_cells(
    triangles: FloatArray, u: int, v: int, low: FloatArray, scale: FloatArray, grow: float, cells: int, start: IntArray
) -> int:
    """Write to ``start`` (cells^2 + 1,) where the triangles of each cell begin; returns their number."""
    span = np.empty(4, dtype=np.int64)
    start[:] = 0
    for f in range(len(triangles)):
        cell_range(triangles[f], u, v, low, scale, grow, cells, span)
        for i in range(span[0], span[1] + 1):
            for j in range(span[2], span[3] + 1):
                start[i * cells + j + 1] += 1
    for c in range(cells * cells):
        start[c + 1] += start[c]
    return int(start[cells * cells])


@njit(cache=True)
def fill_cells(
    triangles: FloatArray,
    u: int,
    v: int,
    low: FloatArray,
    scale: FloatArray,
    grow: float,
    cells: int,
    start: IntArray,
    items: NDArray[np.int32],
) -> None:
    """Write the triangle numbers of every cell to ``items``."""
    span = np.empty(4, dtype=np.int64)
    place = start[:-1].copy()
    for f in range(len(triangles)):
        cell_range(triangles[f], u, v, low, scale, grow, cells, span)
        for i in range(span[0], span[1] + 1):
            for j in range(span[2], span[3] + 1):
                items[place[i * cells + j]] = f
                place[i * cells + j] += 1


@njit(cache=True)
def edge_side(a: FloatArray, b: FloatArray, p: FloatArray, u: int, v: int, margin: float) -> int:
    """1 or -1: on which side of edge ab the point lies in the projection; 0 if the margin leaves it open."""
    eu, ev = b[u] - a[u], b[v] - a[v]
    pu, pv = p[u] - a[u], p[v] - a[v]
    cross = eu * pv - ev * pu
    bound = 2.0 * margin * (abs(eu) + abs(ev) + abs(pu) + abs(pv) + 4.0 * margin)
    if cross > bound:
        return 1
    if cross < -bound:
        return -1
    return 0


@njit(cache=True)
def below(p: FloatArray, t: FloatArray, axis: int, margin: float) -> bool:
    """Whether the point is certainly below the whole triangle along an axis."""
    return bool(p[axis] < min(t[0, axis], t[1, axis], t[2, axis]) - 2.0 * margin)


@njit(cache=True)
def above(p: FloatArray, t: FloatArray, axis: int, margin: float) -> bool:
    """Whether the point is certainly above the whole triangle along an axis."""
    return bool(p[axis] > max(t[0, axis], t[1, axis], t[2, axis]) + 2.0 * margin)


@njit(cache=True)
def triangle_crossed(t: FloatArray, p: FloatArray, u: int, v: int, w: int, margin: float) -> int:
    """Whether the ray from p along +w crosses the triangle: OUTSIDE (no), INSIDE (yes) or UNCERTAIN."""
    if below(p, t, u, margin) or above(p, t, u, margin) or below(p, t, v, margin) or above(p, t, v, margin):
        return OUTSIDE
    if above(p, t, w, margin):
        return OUTSIDE
    first = edge_side(t[0], t[1], p, u, v, margin)
    second = edge_side(t[1], t[2], p, u, v, margin)
    third = edge_side(t[2], t[0], p, u, v, margin)
    if min(first, second, third) < 0 < max(first, second, third):
        return OUTSIDE
    if first * second * third == 0:
        return UNCERTAIN
    if below(p, t, w, margin):
        return INSIDE
    return triangle_ahead(t, p, first, margin)


@njit(cache=True)
def triangle_ahead(t: FloatArray, p: FloatArray, turn: int, margin: float) -> int:
    """For a point within the triangle's projection: whether the triangle lies ahead of it (INSIDE), or UNCERTAIN."""
    volume = 0.0
    size_e = size_f = size_r = 0.0
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        volume += ((t[1, i] - t[0, i]) * (t[2, j] - t[0, j]) - (t[1, j] - t[0, j]) * (t[2, i] - t[0, i])) * (
            p[k] - t[0, k]
        )
        size_e += abs(t[1, k] - t[0, k]) + 2.0 * margin
        size_f += abs(t[2, k] - t[0, k]) + 2.0 * margin
        size_r += abs(p[k] - t[0, k]) + 2.0 * margin
    if abs(volume) <= 4.0 * margin * (size_e * size_f + size_f * size_r + size_r * size_e):
        return UNCERTAIN
    return INSIDE if (volume > 0.0) != (turn > 0) else OUTSIDE


@njit(cache=True)
def ray_parity(
    p: FloatArray,
    triangles: FloatArray,
    w: int,
    low: FloatArray,
    scale: FloatArray,
    grow: float,
    cells: int,
    start: IntArray,
    items: NDArray[np.int32],
    margin: float,
) -> int:
    """Parity of the crossings of one ray: OUTSIDE, INSIDE or UNCERTAIN."""
    if not margin < grow:
        return UNCERTAIN
    u, v = (w + 1) % 3, (w + 2) % 3
    x, y = (p[u] - low[0]) * scale[0], (p[v] - low[1]) * scale[1]
    if not (0.0 <= x < cells and 0.0 <= y < cells):
        return UNCERTAIN
    cell = int(x) * cells + int(y)
    parity = 0
    for k in range(start[cell], start[cell + 1]):
        crossed = triangle_crossed(triangles[items[k]], p, u, v, w, margin)
        if crossed == UNCERTAIN:
            return UNCERTAIN
        parity ^= crossed
    return parity


@njit(cache=True)
def point_seen_from(
    point: FloatArray, ra: FloatArray, ta: FloatArray, rb: FloatArray, tb: FloatArray, out: FloatArray
) -> None:
    """``out`` (3,): a point of body A in the frame of body B."""
    x = ra[0, 0] * point[0] + ra[0, 1] * point[1] + ra[0, 2] * point[2] + (ta[0] - tb[0])
    y = ra[1, 0] * point[0] + ra[1, 1] * point[1] + ra[1, 2] * point[2] + (ta[1] - tb[1])
    z = ra[2, 0] * point[0] + ra[2, 1] * point[1] + ra[2, 2] * point[2] + (ta[2] - tb[2])
    for k in range(3):
        out[k] = rb[0, k] * x + rb[1, k] * y + rb[2, k] * z


@njit(cache=True)
def points_in_box(
    points: FloatArray, ra: FloatArray, ta: FloatArray, rb: FloatArray, tb: FloatArray, box: FloatArray, margin: float
) -> bool:
    """Whether all points (E, 3) of body A may lie in the box (2, 3) of body B."""
    seen = np.empty(3)
    for e in range(len(points)):
        point_seen_from(points[e], ra, ta, rb, tb, seen)
        for axis in range(3):
            if seen[axis] < box[0, axis] - margin or seen[axis] > box[1, axis] + margin:
                return False
    return True


@njit(cache=True)
def component_inside(
    probes: FloatArray,
    ra: FloatArray,
    ta: FloatArray,
    rb: FloatArray,
    tb: FloatArray,
    triangles: FloatArray,
    low: FloatArray,
    scale: FloatArray,
    grow: float,
    cells: int,
    start: IntArray,
    items: NDArray[np.int32],
    margin: float,
) -> int:
    """Whether a component that does not meet the mesh lies inside: any of its vertices along any axis tells."""
    point = np.empty(3)
    for k in range(len(probes)):
        point_seen_from(probes[k], ra, ta, rb, tb, point)
        for w in range(3):
            parity = ray_parity(point, triangles, w, low[w], scale[w], grow, cells, start[w], items[w], margin)
            if parity != UNCERTAIN:
                return parity
    return UNCERTAIN


@njit(cache=True)
def contained_states(
    rotation_a: FloatArray,
    translation_a: FloatArray,
    rotation_b: FloatArray,
    translation_b: FloatArray,
    extremes: FloatArray,
    probes: FloatArray,
    box: FloatArray,
    triangles: FloatArray,
    low: FloatArray,
    scale: FloatArray,
    grow: float,
    cells: int,
    start: IntArray,
    items: NDArray[np.int32],
    size: float,
    pad: float,
    states: NDArray[np.int8],
) -> None:
    """Fill ``states`` (K,): whether A lies wholly inside the closed mesh B whose surface it does not meet.

    ``extremes`` (E, 3) of A must lie in B's box (2, 3) first; ``probes`` (C, V, 3): vertices of each component of A.
    """
    for k in range(len(states)):
        ra, ta, rb, tb = rotation_a[k], translation_a[k], rotation_b[k], translation_b[k]
        margin = pad * (size + max(abs(ta[0]), abs(ta[1]), abs(ta[2])) + max(abs(tb[0]), abs(tb[1]), abs(tb[2])))
        states[k] = INSIDE if points_in_box(extremes, ra, ta, rb, tb, box, margin) else OUTSIDE
        if states[k] == OUTSIDE:
            continue
        for c in range(len(probes)):
            state = component_inside(
                probes[c], ra, ta, rb, tb, triangles, low, scale, grow, cells, start, items, margin
            )
            if state == OUTSIDE:
                states[k] = OUTSIDE
                break
            if state == UNCERTAIN:
                states[k] = UNCERTAIN
