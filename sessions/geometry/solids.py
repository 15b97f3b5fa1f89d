"""Polyhedra whose outermost points along the axes are exact: where motion runs along an axis, so is the truth.

Sizes that are sums of few powers of two (1/32 m, 1/256 m) also survive the rounding of a mesh file to float32.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.geometry.rotations import Array
from sessions.mesh_data import MeshData


def box(extents: ArrayLike, centre: ArrayLike = (0.0, 0.0, 0.0)) -> MeshData:
    """An axis-parallel box of 12 faces; ``extents`` are its sizes along x, y, z."""
    half = np.asarray(extents, dtype=np.float64) / 2.0
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half + np.asarray(centre)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return MeshData(corners, [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))])


def pointed_ball(radius: float, splits: int = 3) -> MeshData:
    """A ball of 8 * 4^splits faces inscribed in its sphere, with one vertex exactly on each half axis."""
    points = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.float64)
    faces = np.array(
        [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]], dtype=np.int64
    )
    for _ in range(splits):
        points, faces = _split(points, faces)
    return MeshData(radius * points, faces)


def _split(points: Array, faces: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    unique, edge_index = np.unique(edges, axis=0, return_inverse=True)
    middle = points[unique].sum(axis=1)
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    a, b, c = faces.T
    ab, bc, ca = edge_index.reshape(-1, 3).T + len(points)
    quarters = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    return np.concatenate([points, middle]), np.concatenate([np.stack(quarter, axis=1) for quarter in quarters])
