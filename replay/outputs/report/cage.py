"""A convex collider as a wire cage: its outline, its sharp edges, and the lid over a hollow."""

from typing import Final

import numpy as np

from cdcore import TriangleMesh
from cdcore.numerics import BoolArray, FloatArray, IntArray, place_points
from replay.outputs.report.rasteriser import Colour, Lines, Shape, View

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
    points = place_points(solid.vertices, *pose)
    corners = points[solid.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-30)[:, None]
    outward = (normals * (corners.mean(axis=1) - points.mean(axis=0))).sum(axis=1) < 0
    normals[outward] *= -1
    front = (normals * (view.position - corners.mean(axis=1))).sum(axis=1) > 0
    walls = Shape(corners, colour, np.where(_lid(solid, mesh), LID_ALPHA, WALL_ALPHA))
    edges, left, right = _edges(solid.faces.astype(np.int64))
    outline = front[left] != front[right]
    sharp = (normals[left] * normals[right]).sum(axis=1) < np.cos(np.radians(SHARP_DEG))
    seen = front[left] | front[right]
    thick = 2 if view.size[1] > MANY_ROWS else 1
    groups = [(sharp & ~seen, 0.35, 1), (sharp & seen, 0.95, thick), (outline, 1.0, thick + 1)]
    return walls, [Lines(points[edges[some]], colour, alpha, width) for some, alpha, width in groups]


def _edges(faces: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Edges (e, 2) of vertices, and the two faces of each; an edge of one face, or of many, is left out."""
    pairs = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, place, count = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(place.ravel(), kind="stable")
    first = np.concatenate([[0], np.cumsum(count)[:-1]])[count == 2]
    return edges[count == 2], order[first] // 3, order[first + 1] // 3


def _lid(solid: TriangleMesh, mesh: TriangleMesh) -> BoolArray:
    """Faces of a solid that span a hollow of the mesh: the middle of an edge is far from every vertex."""
    from scipy.spatial import KDTree

    corners = solid.triangles
    middles = (corners + np.roll(corners, 1, axis=1)) / 2
    away = KDTree(mesh.vertices).query(middles.reshape(-1, 3))[0].reshape(-1, 3).max(axis=1)
    spans: BoolArray = away > LID * np.linalg.norm(np.ptp(solid.vertices, axis=0))
    return spans
