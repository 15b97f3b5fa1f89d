"""A convex collider as a wire cage: its outline, its sharp edges, and the lid over a hollow."""

from typing import Final

import numpy as np

from cdcore import TriangleMesh
from cdcore.numerics import BoolArray, FloatArray, place_points
from replay.outputs.report.rasteriser import Colour, Lines, Shape, View
from replay.outputs.shapes import bends, edges_of, face_normals

SHARP_DEG: Final = 30.0
"""Faces that meet in a larger angle have an edge between them."""

LID: Final = 0.06
"""Share of the cage's size by which a face is away from the mesh where it closes a hollow."""

MANY_ROWS: Final = 400
"""In a picture of fewer rows lines are thinner."""

WALL_ALPHA, LID_ALPHA = 0.05, 0.17


def cage(
    solid: TriangleMesh, mesh: TriangleMesh, pose: tuple[FloatArray, FloatArray], view: View, colour: Colour
) -> tuple[Shape, list[Lines]]:
    """Walls and lines of a ``solid`` that stands for a ``mesh`` at a pose (rotation, translation), for this view."""
    normals = face_normals(solid.triangles)[1] @ pose[0].T
    corners = place_points(solid.triangles, *pose)
    edges, faces = edges_of(solid)
    edges = place_points(edges, *pose)
    front = (normals * (view.position - corners.mean(axis=1))).sum(axis=1) > 0
    walls = Shape(corners, colour, np.where(_lid(solid, mesh), LID_ALPHA, WALL_ALPHA))
    outline = front[faces[:, 0]] != front[faces[:, 1]]
    sharp = bends(normals, faces) < np.cos(np.radians(SHARP_DEG))
    seen = front[faces].any(axis=1)
    thick = 2 if view.size[1] > MANY_ROWS else 1
    groups = [(sharp & ~seen, 0.35, 1), (sharp & seen, 0.95, thick), (outline, 1.0, thick + 1)]
    return walls, [Lines(edges[some], colour, alpha, width) for some, alpha, width in groups]


def _lid(solid: TriangleMesh, mesh: TriangleMesh) -> BoolArray:
    """Faces of a solid that span a hollow of the mesh: the middle of an edge is far from every vertex."""
    from scipy.spatial import KDTree

    corners = solid.triangles
    middles = (corners + np.roll(corners, 1, axis=1)) / 2
    away = KDTree(mesh.vertices).query(middles.reshape(-1, 3))[0].reshape(-1, 3).max(axis=1)
    spans: BoolArray = away > LID * np.linalg.norm(np.ptp(solid.vertices, axis=0))
    return spans
