"""Distances from points to the surface of a mesh, and the point of a solid that is farthest from such a surface.

The distance to one triangle is a convex function of the point: on a triangle or a box it is greatest at a corner, which
bounds it from above, and its tangent plane bounds it from below. So the farthest point is searched by branch and bound,
and a linear programme places it exactly where several triangles are equally near.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np

from cdcore.mesh import distinct_rows
from cdcore.numerics import BoolArray, FloatArray, IntArray

RELATIVE_PRECISION: Final = 2e-7
"""Relative gain of a depth that is none."""

MOST_LEVELS: Final = 8
"""Halvings of a triangle before the search ends."""

FINE_TRIANGLES: Final = 600
"""Triangles of a surface from which on a single level is searched: the farthest points are near corners and middles of
so fine a region, and the search takes a third of the time."""

STALE_ROUNDS: Final = 2
"""Levels without a gain after which the search ends: what is left is bounded loosely, along a ridge of equal depth."""

POLISHED_TRIANGLES: Final = 2
"""Triangles of a level in which the farthest point is placed by linear programmes."""

MOST_TRIANGLES: Final = 120
"""Of a level: those with the greatest bounds."""

ASCENT_STEPS: Final = 12
"""Linear programmes a point; each is right but for triangles that were farther before."""

NEAREST_TRIANGLES: Final = 48
"""Triangles whose tangents a step begins with."""

MOST_ADDED_TRIANGLES: Final = 12
"""Triangles that a step takes in at most."""

GRID_POINTS_PER_SIDE: Final = 5
"""Points a side of the grid from which a farthest point within a solid is searched."""

MOST_SAMPLE_HALVINGS: Final = 16
"""Of a triangle that is sampled, at most."""

SAMPLES_PER_SIZE: Final = 32
"""Edges of triangles that are sampled are at most this part of the size of a surface."""

TRIANGLES_BESIDE: Final = 8
"""Small triangles whose middles are nearest to a point: the nearest triangle is among them, as a rule."""

POINTS_AT_ONCE: Final = 4
"""Points of which it is asked together whether they are within a solid."""

NARROW_FRACTION: Final = 0.05
"""Fraction of the room at its start below which an ascent within a solid ends: it arrives at the surface."""


def _kernels() -> Any:
    """Distances to triangles; a run without a contact asks none and loads no compiler."""
    from cdcore.narrow import surface_distance

    return surface_distance


@dataclass(frozen=True, eq=False)
class Surface:
    """The triangles (n, 3, 3) of a surface, for many questions."""

    triangles: FloatArray

    def __post_init__(self) -> None:
        # For an array that cannot be written numba compiles the kernels once more.
        object.__setattr__(self, "triangles", np.require(self.triangles, requirements=["C", "W"]))

    @cached_property
    def triangle_middles(self) -> FloatArray:
        """Middles (n, 3) of the triangles."""
        a, b, c = self.triangles[:, 0], self.triangles[:, 1], self.triangles[:, 2]
        return np.asarray((a + b + c) / 3.0)

    @cached_property
    def radii(self) -> FloatArray:
        """Metres from the middle of each triangle to its farthest corner, (n,)."""
        squared_distances = [
            ((self.triangles[:, corner] - self.triangle_middles) ** 2) @ np.ones(3) for corner in range(3)
        ]
        return np.asarray(np.sqrt(np.maximum.reduce(squared_distances)))

    def subset_near(self, points: FloatArray) -> Surface:
        """The triangles among which the nearest of any point within the convex hull of the points (n, 3) is."""
        points_middle = points.mean(axis=0)
        radius = float(np.linalg.norm(points - points_middle, axis=1).max())
        middle_distances = np.linalg.norm(self.triangle_middles - points_middle, axis=1) - self.radii
        # A point of the hull is nearer to the surface than the middle is, plus the radius.
        nearest_distance = float(self.distances(points_middle[None])[0][0])
        return Surface(self.triangles[middle_distances <= nearest_distance + 2.0 * radius + RELATIVE_PRECISION])

    def distances(self, points: FloatArray) -> tuple[FloatArray, IntArray]:
        """Metres from points (k, 3) to the surface, (k,), and the triangle that is nearest to each, (k,)."""
        return _kernels().nearest_triangles(points, self.triangles, self.triangle_middles, self.radii)

    def largest_distance(self, points: FloatArray, least_distance: float) -> float:
        """Metres from the surface to the farthest of points (k, 3), at least ``least_distance``."""
        return float(
            _kernels().largest_distance(points, self.triangles, self.triangle_middles, self.radii, least_distance)
        )


def is_outside(points: FloatArray, triangles: FloatArray) -> BoolArray:
    """Whether points (n, 3) are outside a closed surface, (n,): its winding number there is less than a half."""
    from cdcore.containment.winding_number import winding_numbers

    writable = np.require(triangles, requirements=["C", "W"])
    return np.asarray(np.abs(winding_numbers(np.ascontiguousarray(points), writable)) < 0.5)


def farthest_on(region: FloatArray, surface: Surface, least_distance: float = 0.0, *, thorough: bool = False) -> float:
    """Metres from the surface to the point of triangles (n, 3, 3) farthest from it, at least ``least_distance``.

    ``thorough``: all levels are searched on a fine surface too.
    """
    corners, numbers = distinct_rows(region.reshape(-1, 3))
    surface = surface.subset_near(corners)
    at_corners, _ = surface.distances(corners)
    largest_distance = max(least_distance, float(at_corners.max()))
    # Nowhere on a triangle is it farther than at a corner, plus the longer edge from there.
    edges = np.linalg.norm(region - np.roll(region, 1, axis=1), axis=2)
    longest = np.maximum(edges, np.roll(edges, -1, axis=1))
    upper_bounds = (at_corners[numbers.reshape(-1, 3)] + longest).min(axis=1)
    bound_order = np.argsort(-upper_bounds, kind="stable")
    triangles, stale_rounds = (
        region[bound_order[upper_bounds[bound_order] > largest_distance * (1.0 + RELATIVE_PRECISION)][:MOST_TRIANGLES]],
        0,
    )
    for _ in range(MOST_LEVELS if thorough or len(surface.triangles) < FINE_TRIANGLES else 1):
        if not len(triangles) or stale_rounds >= STALE_ROUNDS:
            break
        distance_bounds, at_middles = _distance_bounds(triangles, surface)
        previous_distance, largest_distance = largest_distance, max(largest_distance, at_middles)
        bound_order = np.argsort(-distance_bounds, kind="stable")
        for index in bound_order[:POLISHED_TRIANGLES].tolist():
            if distance_bounds[index] > largest_distance * (1.0 + RELATIVE_PRECISION):
                largest_distance = max(largest_distance, _farthest_on_triangle(triangles[index], surface))
        bound_order = bound_order[distance_bounds[bound_order] > largest_distance * (1.0 + RELATIVE_PRECISION)][
            :MOST_TRIANGLES
        ]
        stale_rounds = 0 if largest_distance > previous_distance * (1.0 + RELATIVE_PRECISION) else stale_rounds + 1
        triangles = _quartered_triangles(triangles[bound_order])
    return largest_distance


def refined_triangles(triangles: FloatArray, longest: float) -> FloatArray:
    """Triangles (n, 3, 3) halved at their longest edge until no edge is longer, or ``MOST_SAMPLE_HALVINGS`` times."""
    short_enough = []
    for _ in range(MOST_SAMPLE_HALVINGS):
        is_long = _edge_lengths(triangles).max(axis=1) > longest
        short_enough.append(triangles[~is_long])
        triangles = _halved_triangles(triangles[is_long])
        if not len(triangles):
            break
    return np.concatenate([*short_enough, triangles])


class SampledSurface:
    """Distances from many points to a surface (n, 3, 3), each to the nearest of a few small triangles beside it.

    A distance may be too large by a fraction of the size of those triangles: it finds where to search, and colours.
    """

    def __init__(self, triangles: FloatArray) -> None:
        from scipy.spatial import KDTree

        self.size = float(np.ptp(triangles.reshape(-1, 3), axis=0).max())
        self._triangles = refined_triangles(triangles, self.size / SAMPLES_PER_SIZE)
        self._tree = KDTree(self._triangles.mean(axis=1))

    def distances(self, points: FloatArray) -> FloatArray:
        """Metres from points (k, 3) to the surface, (k,)."""
        neighbour_count = min(TRIANGLES_BESIDE, len(self._triangles))
        _, nearest_triangles = self._tree.query(points, k=range(1, neighbour_count + 1))
        distance, _ = _kernels().distance_to_triangles(
            np.repeat(points, neighbour_count, axis=0), self._triangles[nearest_triangles.ravel()]
        )
        return np.asarray(distance.reshape(-1, neighbour_count).min(axis=1))


def farthest_triangles(region: FloatArray, surface: FloatArray) -> FloatArray:
    """Small triangles of a region (n, 3, 3) that hold the points farthest from a surface (m, 3, 3), as sampled.

    Bounds of long triangles are loose: many of them along a wall hid the lid of a vessel from ``farthest_on``.
    """
    sampled_surface = SampledSurface(surface)
    largest_distance, triangles, small_triangles = 0.0, region, []
    for _ in range(MOST_SAMPLE_HALVINGS):
        middles = triangles.mean(axis=1)
        at_middles = sampled_surface.distances(middles)
        largest_distance = max(largest_distance, float(at_middles.max(initial=0.0)))
        # Nowhere on a triangle is it farther than at its middle, plus the way from there to its farthest corner.
        distance_bounds = at_middles + np.linalg.norm(triangles - middles[:, None], axis=2).max(axis=1)
        promising_triangles, distance_bounds = (
            triangles[distance_bounds > largest_distance],
            distance_bounds[distance_bounds > largest_distance],
        )
        is_small = _edge_lengths(promising_triangles).max(axis=1) <= sampled_surface.size / SAMPLES_PER_SIZE
        small_triangles += list(zip(distance_bounds[is_small].tolist(), promising_triangles[is_small], strict=True))
        triangles = _halved_triangles(promising_triangles[~is_small])
        if not len(triangles):
            break
    small_triangles.sort(key=lambda bounded: -bounded[0])
    return np.array(
        [triangle for bound, triangle in small_triangles[:MOST_TRIANGLES] if bound > largest_distance] or region[:1]
    )


def _edge_lengths(triangles: FloatArray) -> FloatArray:
    """Lengths (n, 3) of the edges of triangles, from each corner to the next."""
    return np.asarray(np.linalg.norm(np.roll(triangles, -1, axis=1) - triangles, axis=2))


def _halved_triangles(triangles: FloatArray) -> FloatArray:
    """Triangles (n, 3, 3) halved at their longest edges, (2 n, 3, 3)."""
    longest_edge = _edge_lengths(triangles).argmax(axis=1)
    a, b, c = (triangles[np.arange(len(longest_edge)), (longest_edge + step) % 3] for step in range(3))
    midpoints = 0.5 * (a + b)
    return np.concatenate([np.stack([a, midpoints, c], axis=1), np.stack([midpoints, b, c], axis=1)])


def farthest_within(region: FloatArray, surface: Surface, least_distance: float) -> float:
    """Metres from the surface to the farthest point within a closed region (n, 3, 3), at least ``least_distance``.

    It begins at points of a grid, so that of several farthest points it may find another than the farthest.
    """
    corners = region.reshape(-1, 3)
    surface = surface.subset_near(corners)
    lower, upper = corners.min(axis=0), corners.max(axis=0)
    cell_size = (upper - lower) / GRID_POINTS_PER_SIDE
    points = lower + (np.indices((GRID_POINTS_PER_SIDE,) * 3).reshape(3, -1).T + 0.5) * cell_size
    depths, nearest = surface.distances(points)
    # In the cell of a point it is nowhere farther than at a corner of the cell from the triangle nearest to the point.
    cell_corners = points[:, None] + (np.indices((2,) * 3).reshape(3, -1).T - 0.5) * cell_size
    distance_bounds = _kernels().distance_to_triangles(
        cell_corners.reshape(-1, 3), np.repeat(surface.triangles[nearest], 8, axis=0)
    )[0]
    is_deep_cell = distance_bounds.reshape(-1, 8).max(axis=1) > least_distance * (1.0 + RELATIVE_PRECISION)
    points, depths = points[is_deep_cell], depths[is_deep_cell]
    deepest = _deepest_inside(points, depths, region)
    if deepest is None or (len(surface.triangles) >= FINE_TRIANGLES and depths[deepest] <= least_distance):
        return least_distance
    return max(least_distance, _farthest_by_ascent(points[deepest], surface, Surface(region)))


def _deepest_inside(points: FloatArray, depths: FloatArray, region: FloatArray) -> int | None:
    """Number of the point (n, 3) with the greatest of the depths (n,) that is within a region; ``None``: none is."""
    depth_order = np.argsort(-depths, kind="stable")
    # The first of them mostly is, and a winding number takes as long as the distance.
    for start in range(0, len(depth_order), POINTS_AT_ONCE):
        block = depth_order[start : start + POINTS_AT_ONCE]
        is_inside = ~is_outside(points[block], region)
        if is_inside.any():
            return int(block[is_inside.argmax()])
    return None


def _distance_bounds(triangles: FloatArray, surface: Surface) -> tuple[FloatArray, float]:
    """Bounds (n,) of the distance on each triangle from above, and the greatest distance of a middle."""
    distance, nearest = surface.distances(triangles.mean(axis=1))
    nearest_triangles = surface.triangles[nearest]
    bounds = np.max([_kernels().distance_to_triangles(triangles[:, k], nearest_triangles)[0] for k in range(3)], axis=0)
    return bounds, float(distance.max())


def _quartered_triangles(triangles: FloatArray) -> FloatArray:
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    quarters = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
    return np.concatenate([np.stack(corners_of_quarter, axis=1) for corners_of_quarter in quarters])


def _farthest_on_triangle(triangle: FloatArray, surface: Surface) -> float:
    """Metres to the farthest point of one triangle (3, 3), as far as ascent from its middle leads."""
    axes = triangle[1:] - triangle[0]
    weights = np.full(2, 1.0 / 3.0)
    distance = float(surface.distances(triangle.mean(axis=0)[None])[0][0])
    side_normals = np.array([[-1.0, 0.0], [0.0, -1.0], [1.0, 1.0]])
    for _ in range(ASCENT_STEPS):
        point = triangle[0] + weights @ axes
        side_distances = np.array([weights[0], weights[1], 1.0 - weights.sum()])
        ascent = _best_step(point, distance, surface, axes, (side_normals, side_distances)) if distance > 0.0 else None
        if ascent is None:
            break
        step, distance = ascent
        weights = weights + step
    return distance


def _farthest_by_ascent(point: FloatArray, surface: Surface, boundary: Surface) -> float:
    """Metres to the farthest point to which ascent from a point within a region leads without leaving it."""
    distance = float(surface.distances(point[None])[0][0])
    boundary_distance = start = float(boundary.distances(point[None])[0][0])
    side_normals = np.concatenate([np.eye(3), -np.eye(3)])
    for _ in range(2 * ASCENT_STEPS if len(surface.triangles) < FINE_TRIANGLES else ASCENT_STEPS // 2):
        if boundary_distance <= NARROW_FRACTION * start:
            break
        ascent = _best_step(
            point, distance, surface, np.eye(3), (side_normals, np.full(6, boundary_distance / np.sqrt(3.0)))
        )
        if ascent is None:
            break
        step, distance = ascent
        point = point + step
        boundary_distance = float(boundary.distances(point[None])[0][0])
    return distance


def _best_step(
    point: FloatArray,
    distance_to_beat: float,
    surface: Surface,
    axes: FloatArray,
    side_limits: tuple[FloatArray, FloatArray],
) -> tuple[FloatArray, float] | None:
    """A step (k,) along axes (k, 3) within ``side_limits`` (rows, right side), and the distance of its end point.

    The step leads to the greatest of the tangents of the distances to single triangles. They are right on the near side
    of each, so that the true distance is no less: where it is, a triangle was left out, and is taken in. ``None``: the
    step leads to no greater distance.
    """
    from cdcore.narrow.greatest_minimum import greatest_minimum

    lower_distances = np.sqrt(((surface.triangle_middles - point) ** 2) @ np.ones(3)) - surface.radii
    nearby_triangles = (
        np.argpartition(lower_distances, NEAREST_TRIANGLES)[:NEAREST_TRIANGLES]
        if len(lower_distances) > NEAREST_TRIANGLES
        else np.arange(len(lower_distances))
    )
    step = np.zeros(len(axes))
    for _ in range(MOST_ADDED_TRIANGLES):
        distance, closest_points = _kernels().distance_to_triangles(
            np.broadcast_to(point, (len(nearby_triangles), 3)), surface.triangles[nearby_triangles]
        )
        gradients = (point - closest_points) / np.maximum(distance, 1e-300)[:, None]
        highest = greatest_minimum(gradients @ axes.T, distance, *side_limits)
        if highest is None:
            return None
        step = highest
        promised_distance = float((distance + gradients @ axes.T @ step).min())
        if promised_distance <= distance_to_beat * (1.0 + RELATIVE_PRECISION):
            return None
        moved_point = point + step @ axes
        reached_distances, nearest = surface.distances(moved_point[None])
        if reached_distances[0] >= promised_distance * (1.0 - RELATIVE_PRECISION) or nearest[0] in nearby_triangles:
            break
        nearby_triangles = np.append(nearby_triangles, nearest[0])
    return (
        (step, float(reached_distances[0]))
        if reached_distances[0] > distance_to_beat * (1.0 + RELATIVE_PRECISION)
        else None
    )
