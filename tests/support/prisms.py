"""Prisms whose outermost points along X are exact."""

import numpy as np

from sessions.geometry.rotations import Array
from sessions.mesh_data import MeshData


def prism(sides: int, radius: float, length: float) -> MeshData:
    """A regular prism along Y about the origin; of its ``sides``, an even number, one corner lies on +X, one on -X."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    outline = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    outline[0], outline[sides // 2] = (radius, 0.0), (-radius, 0.0)
    half, ends = length / 2.0, [[0.0, -length / 2.0, 0.0], [0.0, length / 2.0, 0.0]]
    points = np.concatenate([_level(outline, -half), _level(outline, half), ends])
    i = np.arange(sides)
    j = (i + 1) % sides
    low, high = np.full(sides, 2 * sides), np.full(sides, 2 * sides + 1)
    faces = [[i, j, j + sides], [i, j + sides, i + sides], [low, j, i], [high, i + sides, j + sides]]
    return MeshData(points, np.concatenate([np.stack(face, axis=1) for face in faces]))


def _level(outline: Array, height: float) -> Array:
    return np.column_stack([outline[:, 0], np.full(len(outline), height), -outline[:, 1]])
