"""Distances from points to triangles: of pairs, and to the nearest of many; each kernel beside its slow reference."""

from __future__ import annotations

from math import inf, sqrt

import numpy as np

from cdcore.kernels.compiling import INTERPRETED, hot_kernel, kernel
from cdcore.kernels.vectors import Vector, between, beyond, cross, dot, vector_at
from cdcore.numerics import FloatArray, IntArray

AT_ONCE = 32
"""Points whose distances the slow reference computes together."""


def distance_to_triangles(points: FloatArray, triangles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Metres from each point (n, 3) to its triangle (n, 3, 3), (n,), and the nearest point of that triangle (n, 3)."""
    if INTERPRETED:
        return distance_to_triangles_slowly(points, triangles)
    distance, closest = np.empty(len(points)), np.empty((len(points), 3))
    fill_distances(np.ascontiguousarray(points), triangles.reshape(-1, 9), distance, closest)
    return distance, closest


def nearest_triangles(
    points: FloatArray, triangles: FloatArray, middles: FloatArray, radii: FloatArray
) -> tuple[FloatArray, IntArray]:
    """Metres from points (k, 3) to the nearest of triangles (n, 3, 3), (k,), and the number of that one, (k,).

    ``middles`` (n, 3) of the triangles, ``radii`` (n,) metres from there to their farthest corners.
    """
    if INTERPRETED:
        return nearest_triangles_slowly(points, triangles, middles, radii)
    distance, nearest = np.empty(len(points)), np.empty(len(points), dtype=np.int64)
    candidates = np.empty(len(triangles), dtype=np.int64)
    points = np.ascontiguousarray(points)
    fill_nearest(points, triangles.reshape(-1, 9), middles, radii, candidates, distance, nearest)
    return distance, nearest


def largest_distance(
    points: FloatArray, triangles: FloatArray, middles: FloatArray, radii: FloatArray, least: float = 0.0
) -> float:
    """Metres from the surface of ``nearest_triangles`` to the farthest of the points (k, 3), at least ``least``.

    Cost: a fifth of ``nearest_triangles``, since a point is left once a triangle is as near as the largest so far.
    Source: Taha and Hanbury 2015, the early break.
    """
    if INTERPRETED:
        return max(least, float(nearest_triangles_slowly(points, triangles, middles, radii)[0].max()))
    candidates, points = np.empty(len(triangles), dtype=np.int64), np.ascontiguousarray(points)
    return float(largest_of_nearest(points, triangles.reshape(-1, 9), middles, radii, candidates, least))


@hot_kernel
def nearest_on_edge(p: Vector, start: Vector, end: Vector) -> Vector:
    """The point of an edge that is nearest to a point."""
    edge = between(start, end)
    along = dot(between(start, p), edge) / max(dot(edge, edge), 1e-300)
    return beyond(start, min(1.0, max(0.0, along)), edge)


@hot_kernel
def nearest_on_face(p: Vector, a: Vector, b: Vector, c: Vector) -> Vector:
    """The point of a triangle that is nearest to a point."""
    normal = cross(between(a, b), between(a, c))
    squared = dot(normal, normal)
    if squared > 0.0:
        foot = beyond(p, -dot(between(a, p), normal) / squared, normal)
        within = (
            dot(cross(between(a, b), between(a, foot)), normal) >= 0.0
            and dot(cross(between(b, c), between(b, foot)), normal) >= 0.0
            and dot(cross(between(c, a), between(c, foot)), normal) >= 0.0
        )
        if within:
            return foot
    best, least = a, inf
    for edge in range(3):
        if edge == 0:
            candidate = nearest_on_edge(p, a, b)
        elif edge == 1:
            candidate = nearest_on_edge(p, b, c)
        else:
            candidate = nearest_on_edge(p, c, a)
        away = between(p, candidate)
        if dot(away, away) < least:
            best, least = candidate, dot(away, away)
    return best


@kernel
def fill_distances(points: FloatArray, corners: FloatArray, distance: FloatArray, closest: FloatArray) -> None:
    """Fill the distances (n,) and nearest points (n, 3) of points (n, 3) and triangles by corners (n, 9)."""
    for k in range(len(points)):
        p, nine = vector_at(points[k], 0), corners[k]
        q = nearest_on_face(p, vector_at(nine, 0), vector_at(nine, 3), vector_at(nine, 6))
        closest[k, 0], closest[k, 1], closest[k, 2] = q
        away = between(p, q)
        distance[k] = sqrt(dot(away, away))


@hot_kernel
def select_candidates(points: FloatArray, middles: FloatArray, radii: FloatArray, candidates: IntArray) -> int:
    """Fill in the numbers of triangles that can be nearest to any of the points; how many there are.

    No point is farther than ``radius`` from the first one, so its nearest triangle begins no farther from there than
    the nearest middle plus twice that. Points of a small region leave 200 of 3,000 triangles.
    """
    if not len(points):
        return 0
    first, squared = vector_at(points[0], 0), 0.0
    for k in range(1, len(points)):
        away = between(first, vector_at(points[k], 0))
        squared = max(squared, dot(away, away))
    least = inf
    for n in range(len(middles)):
        away = between(first, vector_at(middles[n], 0))
        least = min(least, dot(away, away))
    reach = (sqrt(least) + 2.0 * sqrt(squared)) * (1.0 + 1e-9)
    count = 0
    for n in range(len(middles)):
        away = between(first, vector_at(middles[n], 0))
        if dot(away, away) <= (reach + radii[n]) * (reach + radii[n]):
            candidates[count] = n
            count += 1
    return count


@kernel
def fill_nearest(
    points: FloatArray,
    corners: FloatArray,
    middles: FloatArray,
    radii: FloatArray,
    candidates: IntArray,
    distance: FloatArray,
    nearest: IntArray,
) -> None:
    """Fill the distance (k,) and number (k,) of the nearest of triangles by corners (n, 9), for points (k, 3).

    ``candidates`` (n,) is scratch: the triangles that can be nearest to any of the points.
    """
    count = select_candidates(points, middles, radii, candidates)
    if not count:
        return
    chosen = candidates[0]
    for k in range(len(points)):
        p, best = vector_at(points[k], 0), inf
        # The triangle nearest to the point before comes first: neighbours are often nearest to the same one.
        for row in range(-1, count):
            n = chosen if row < 0 else candidates[row]
            away, reach = between(p, vector_at(middles[n], 0)), best * (1.0 + 1e-12) + radii[n]
            if dot(away, away) > reach * reach:
                continue
            nine = corners[n]
            q = nearest_on_face(p, vector_at(nine, 0), vector_at(nine, 3), vector_at(nine, 6))
            away = between(p, q)
            metres = sqrt(dot(away, away))
            # Of triangles equally near it is the first.
            if metres < best or (metres == best and n < chosen):
                best, chosen = metres, n
        distance[k], nearest[k] = best, chosen


@kernel
def largest_of_nearest(
    points: FloatArray,
    corners: FloatArray,
    middles: FloatArray,
    radii: FloatArray,
    candidates: IntArray,
    least: float,
) -> float:
    """The largest distance, at least ``least``, of points (k, 3) to the nearest of triangles by corners (n, 9).

    ``candidates`` (n,) is scratch.
    """
    count = select_candidates(points, middles, radii, candidates)
    largest, nearest = least, 0
    for k in range(len(points)):
        p = vector_at(points[k], 0)
        metres = inf
        # The triangle nearest to the point before comes first: neighbours are often nearest to the same one.
        for row in range(-1, count):
            n = nearest if row < 0 else candidates[row]
            away, reach = between(p, vector_at(middles[n], 0)), metres + radii[n]
            if dot(away, away) > reach * reach:
                continue
            nine = corners[n]
            q = nearest_on_face(p, vector_at(nine, 0), vector_at(nine, 3), vector_at(nine, 6))
            away = between(p, q)
            distance = sqrt(dot(away, away))
            if distance < metres:
                metres, nearest = distance, n
                if metres <= largest:
                    break
        largest = max(largest, metres)
    return largest


def distance_to_triangles_slowly(points: FloatArray, triangles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """``distance_to_triangles`` without a kernel."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    normal = np.cross(b - a, c - a)
    squared = np.einsum("nd,nd->n", normal, normal)
    height = np.einsum("nd,nd->n", points - a, normal) / np.maximum(squared, 1e-300)
    closest = points - height[:, None] * normal
    inside = squared > 0.0
    distance = np.full(len(points), np.inf)
    on_edge = np.empty_like(closest)
    for first, second in ((a, b), (b, c), (c, a)):
        edge = second - first
        inside &= np.einsum("nd,nd->n", np.cross(edge, closest - first), normal) >= 0.0
        length = np.maximum(np.einsum("nd,nd->n", edge, edge), 1e-300)
        along = np.clip(np.einsum("nd,nd->n", points - first, edge) / length, 0.0, 1.0)
        foot = first + along[:, None] * edge
        away = np.linalg.norm(points - foot, axis=1)
        nearer = away < distance
        distance = np.where(nearer, away, distance)
        on_edge[nearer] = foot[nearer]
    return np.where(inside, np.abs(height) * np.sqrt(squared), distance), np.where(inside[:, None], closest, on_edge)


def nearest_triangles_slowly(
    points: FloatArray, triangles: FloatArray, middles: FloatArray, radii: FloatArray
) -> tuple[FloatArray, IntArray]:
    """``nearest_triangles`` without a kernel."""
    distance, nearest = np.empty(len(points)), np.empty(len(points), dtype=np.int64)
    along = np.argsort(points[:, int(np.ptp(points, axis=0).argmax())], kind="stable")
    for start in range(0, len(points), AT_ONCE):
        rows = along[start : start + AT_ONCE]
        block = points[rows]
        middle = block.mean(axis=0)
        radius = float(np.linalg.norm(block - middle, axis=1).max())
        away = np.linalg.norm(middles - middle, axis=1)
        # A middle is a point of its triangle: no nearest triangle begins farther away than the nearest middle.
        slack = 1e-6 * (1.0 + np.abs(block).max())
        near = np.flatnonzero(away - radii <= away.min() + 2.0 * radius + slack)
        near_middles, near_radii = middles[near], radii[near]
        squared = (block**2).sum(axis=1)[:, None] + (near_middles**2).sum(axis=1) - 2.0 * block @ near_middles.T
        distances = np.sqrt(np.maximum(squared, 0.0))
        point, column = np.nonzero(distances - near_radii <= distances.min(axis=1, keepdims=True) + slack)
        triangle = near[column]
        exact = distance_to_triangles_slowly(block[point], triangles[triangle])[0]
        order = np.lexsort((exact, point))
        first = order[np.searchsorted(point[order], np.arange(len(block)))]
        distance[rows], nearest[rows] = exact[first], triangle[first]
    return distance, nearest
