"""Prisms and rings whose outermost points along the axes are exact, and how far facets lie inside a ball."""

import numpy as np

from sessions.geometry.rotations import Array
from sessions.mesh_data import MeshData


def prism(sides: int, radius: float, length: float, *, hole: float = 0.0) -> MeshData:
    """A regular prism along Y about the origin, or a ring with a hole of inradius ``hole``.

    Without a hole ``radius`` is that of the corners, one of which lies on +X (and on -X when ``sides`` is even). With
    one, flats face both ways along X: ``hole`` and ``radius`` are distances of flats from the axis. ``sides`` are even.
    """
    half = length / 2.0
    angle = 2.0 * np.pi * np.arange(sides) / sides
    if hole == 0.0:
        outline = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
        outline[0], outline[sides // 2] = (radius, 0.0), (-radius, 0.0)
        return _capped(outline, half)
    # A half step turns a flat towards +X; its two corners then get that flat's exact x.
    outer, inner = (_flat_polygon(sides, size) for size in (radius, hole))
    return _ring(outer, inner, half)


def inscribed_depth(mesh: MeshData) -> float:
    """How far the flattest face of a convex mesh about the origin lies inside the sphere through its corners."""
    corners = mesh.triangles
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    distance = np.einsum("ij,ij->i", normal, corners[:, 0])
    return float(np.linalg.norm(mesh.vertices, axis=1).max() - distance.min())


def _flat_polygon(sides: int, inradius: float) -> Array:
    angle = 2.0 * np.pi * (np.arange(sides) + 0.5) / sides
    outline: Array = inradius / np.cos(np.pi / sides) * np.column_stack([np.cos(angle), np.sin(angle)])
    outline[[0, -1], 0] = inradius
    outline[[sides // 2 - 1, sides // 2], 0] = -inradius
    return outline


def _level(outline: Array, height: float) -> Array:
    return np.column_stack([outline[:, 0], np.full(len(outline), height), -outline[:, 1]])


def _capped(outline: Array, half: float) -> MeshData:
    n = len(outline)
    points = np.concatenate([_level(outline, -half), _level(outline, half), [[0.0, -half, 0.0], [0.0, half, 0.0]]])
    i = np.arange(n)
    j = (i + 1) % n
    low, high = np.full(n, 2 * n), np.full(n, 2 * n + 1)
    faces = [[i, j, j + n], [i, j + n, i + n], [low, j, i], [high, i + n, j + n]]
    return MeshData(points, np.concatenate([np.stack(face, axis=1) for face in faces]))


def _ring(outer: Array, inner: Array, half: float) -> MeshData:
    n = len(outer)
    points = np.concatenate([_level(line, y) for line in (outer, inner) for y in (-half, half)])
    i = np.arange(n)
    j = (i + 1) % n
    out_low, out_high, in_low, in_high = (i + k * n for k in range(4))
    j_out_low, j_out_high, j_in_low, j_in_high = (j + k * n for k in range(4))
    quads = [
        [out_low, j_out_low, j_out_high, out_high],
        [out_high, j_out_high, j_in_high, in_high],
        [in_high, j_in_high, j_in_low, in_low],
        [in_low, j_in_low, j_out_low, out_low],
    ]
    faces = [np.stack([a, b, c], axis=1) for p, q, r, s in quads for a, b, c in ((p, q, r), (p, r, s))]
    return MeshData(points, np.concatenate(faces))
