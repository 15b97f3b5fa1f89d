"""A convex collider as a wire cage: its outline, its sharp edges, thin meridians, and the lid over a hollow."""

from typing import Final

import numpy as np

from cdcore import TriangleMesh
from cdcore.numerics import BoolArray, FloatArray, IntArray, place_points
from replay.outputs.report.rasteriser import Colour, Lines, Shape, View

SHARP_DEG: Final = 30.0
"""Faces that meet in a larger angle have an edge between them."""

MERIDIANS: Final = 8
"""Planes through the axis: 16 meridians."""

FEW_FACES: Final = 40
"""A cage of fewer faces, a box, needs no meridians: its edges show it."""

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
    lid = _lid(solid, mesh)
    walls = Shape(corners, colour, np.where(lid, LID_ALPHA, WALL_ALPHA))
    edges, left, right = _edges(solid.faces.astype(np.int64))
    outline = front[left] != front[right]
    sharp = (normals[left] * normals[right]).sum(axis=1) < np.cos(np.radians(SHARP_DEG))
    seen = front[left] | front[right]
    ends, near = (
        _meridians(corners[~lid], front[~lid]) if len(corners) >= FEW_FACES else (np.zeros((0, 2, 3)), front[:0])
    )
    groups = [
        (ends[~near], 0.25, 1), (points[edges[sharp & ~seen]], 0.35, 1), (ends[near], 0.6, 1),
        (points[edges[sharp & seen]], 0.95, 2), (points[edges[outline]], 1.0, 3),
    ]  # fmt: skip
    thick = view.size[1] > MANY_ROWS
    return walls, [Lines(some, colour, alpha, width if thick else (width + 1) // 2) for some, alpha, width in groups]


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


def _meridians(corners: FloatArray, front: BoolArray) -> tuple[FloatArray, BoolArray]:
    """Where planes through the axis cut triangles (n, 3, 3): segments (k, 2, 3), and which face the eye."""
    middle = corners.mean(axis=(0, 1))
    values, axes = np.linalg.eigh(np.cov((corners.reshape(-1, 3) - middle).T))
    # Of a body of revolution two of the three are alike: the third is its axis.
    last = int(values[2] - values[1] > values[1] - values[0]) * 2
    side, other = (axes[:, k] for k in range(3) if k != last)
    ends, near = [], []
    for angle in np.arange(MERIDIANS) * np.pi / MERIDIANS:
        height = (corners - middle) @ (np.cos(angle) * side + np.sin(angle) * other)
        ahead = np.roll(height, -1, axis=1)
        crosses = (height < 0) != (ahead < 0)
        cut = np.flatnonzero(crosses.sum(axis=1) == 2)
        share = (height / np.where(crosses, height - ahead, 1.0))[..., None]
        points = corners + share * (np.roll(corners, -1, axis=1) - corners)
        ends.append(points[cut][crosses[cut]].reshape(-1, 2, 3))
        near.append(front[cut])
    return np.concatenate(ends), np.concatenate(near)
