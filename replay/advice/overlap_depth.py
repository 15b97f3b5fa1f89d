"""Depth of overlaps of two bodies: how far a vertex of one lies below the surface of the other.

An estimate from points on the surfaces, good to some millimetres on bench glass: enough to tell a body that rests from
one that stands in another. Open surfaces have no inside, and no depth.
"""

from functools import cached_property
from typing import Final

import numpy as np
from scipy.spatial import KDTree

from cdcore import Motion, TriangleMesh
from cdcore.numerics import FloatArray
from cdcore.poses import place_points
from replay.cutting.convex_solids import volume_of
from sessions.mesh_data import MeshData, has_consistent_winding

SURFACE_POINTS: Final = 4000
"""Points on each surface: 2 mm apart on a beaker of 250 ml."""

MOST_VERTICES: Final = 1500
"""Vertices of each body that are looked up; of more, evenly chosen ones."""

LEAF_POINTS: Final = 64
"""Surface points in a leaf of their tree: of points within a solid many are about equally near, and with SciPy's 10 a
search for the nearest took 2.7 times as long."""


class SampledSurface:
    """Points on the surface of a body with their outward normals, in its own frame."""

    def __init__(self, mesh: TriangleMesh, seed: int = 0) -> None:
        self._mesh = mesh
        self._seed = seed

    @cached_property
    def vertices(self) -> FloatArray:
        """Vertices (n, 3) and the points on the surface, which stand for large faces."""
        vertex_step = max(1, len(self._mesh.vertices) // MOST_VERTICES)
        return np.concatenate([self._mesh.vertices[::vertex_step], self._points[0][::4]])

    @cached_property
    def _points(self) -> tuple[FloatArray, FloatArray]:
        corners = self._mesh.triangles
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        doubled_areas = np.linalg.norm(normals, axis=1)
        total_area = float(doubled_areas.sum())
        if total_area == 0.0:
            return corners[:, 0], np.zeros_like(corners[:, 0])
        rng = np.random.default_rng(self._seed)
        face_of_point = rng.choice(len(corners), SURFACE_POINTS, p=doubled_areas / total_area)
        first, second = np.sqrt(rng.random(SURFACE_POINTS)), rng.random(SURFACE_POINTS)
        weights = np.stack([1.0 - first, first * (1.0 - second), first * second], axis=1)
        points = np.einsum("nk,nkd->nd", weights, corners[face_of_point])
        outward_normals = normals[face_of_point] / doubled_areas[face_of_point][:, None]
        return points, outward_normals if volume_of(self._mesh) > 0.0 else -outward_normals

    @cached_property
    def has_consistent_winding(self) -> bool:
        """Whether it is closed and every edge has two faces that wind alike."""
        return has_consistent_winding(MeshData(self._mesh.vertices, self._mesh.faces))

    @cached_property
    def _tree(self) -> KDTree:
        return KDTree(self._points[0], leafsize=LEAF_POINTS)

    def depth_of(self, points: FloatArray) -> float:
        """Metres that the deepest of the points (n, 3), in the body's frame, lies below the surface; 0: none does."""
        if not self.has_consistent_winding:
            return 0.0
        inside_box = ((points > self._mesh.vertices.min(axis=0)) & (points < self._mesh.vertices.max(axis=0))).all(
            axis=1
        )
        if not inside_box.any():
            return 0.0
        points_in_box = points[inside_box]
        distance, index = self._tree.query(points_in_box)
        outward_offsets = ((points_in_box - self._points[0][index]) * self._points[1][index]).sum(axis=1)
        # Of a point beside the sampled one most of the distance is along the surface.
        is_below = outward_offsets < 0.0
        return float(np.minimum(distance, -outward_offsets)[is_below].max(initial=0.0))


def overlap_depth(
    first: SampledSurface, second: SampledSurface, motion: Motion, frame: int, bodies: tuple[int, int]
) -> float:
    """Returns the metres that two bodies stand in each other in a frame of a motion; 0 where they do not."""
    depth = 0.0
    for inner, outer, (a, b) in ((first, second, bodies), (second, first, bodies[::-1])):
        world_points = place_points(inner.vertices, motion.rotations[frame, a], motion.translations[frame, a])
        local_points = (world_points - motion.translations[frame, b]) @ motion.rotations[frame, b]
        depth = max(depth, outer.depth_of(local_points))
    return depth
