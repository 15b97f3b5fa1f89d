"""Meshes as picture and page draw them: normals, smooth surfaces, and edges at which faces meet."""

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from cdcore import TriangleMesh
from cdcore.mesh import once_a_mesh
from cdcore.numerics import BoolArray, FloatArray, IntArray

CREASE_COSINE: Final = float(np.cos(np.radians(40.0)))
"""Faces that meet at more than 40 degrees keep an edge; shared normals would draw gradients over a bench."""


LID_FRACTION: Final = 0.03
"""Share of the cage's size by which a face is away from the mesh where it closes a hollow."""


def face_normals(triangles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Normals of triangles (f, 3, 3), each (f, 3): as long as twice the area, and of unit length (0 without area)."""
    area_vectors: FloatArray = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(area_vectors, axis=1, keepdims=True)
    return area_vectors, np.divide(area_vectors, length, out=np.zeros_like(area_vectors), where=length > 0)


@once_a_mesh
def edges_of(mesh: TriangleMesh) -> tuple[FloatArray, IntArray]:
    """Edges (e, 2, 3) that two faces share, and those faces (e, 2); an edge of one face, or of many, is left out."""
    sorted_ends = np.sort(mesh.merged_faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    points = mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2, 3)
    # One number an edge: rows are sorted ten times as slowly.
    edge_numbers = sorted_ends[:, 0] * len(mesh.vertices) + sorted_ends[:, 1]
    _, first_rows, edge_of_row, faces_of_edge = np.unique(
        edge_numbers, return_index=True, return_inverse=True, return_counts=True
    )
    edge_order = np.argsort(edge_of_row.ravel(), kind="stable")
    first_of_shared = (np.cumsum(faces_of_edge) - faces_of_edge)[faces_of_edge == 2]
    return points[first_rows[faces_of_edge == 2]], np.stack(
        [edge_order[first_of_shared], edge_order[first_of_shared + 1]], axis=1
    ) // 3


def bend_cosines(normals: FloatArray, faces: IntArray) -> FloatArray:
    """Cosine of the angle at which the two faces of each edge meet, from unit normals (f, 3)."""
    cosines: FloatArray = (normals[faces[:, 0]] * normals[faces[:, 1]]).sum(axis=1)
    return cosines


@once_a_mesh
def shaded_mesh(mesh: TriangleMesh) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint32]]:
    """Vertices, unit normals (v, 3) and faces (f, 3) to draw: smooth over gentle edges, flat across sharp ones."""
    area_vectors, unit_normals = face_normals(mesh.triangles)
    faces = edges_of(mesh)[1]
    left_faces, right_faces = faces[bend_cosines(unit_normals, faces) >= CREASE_COSINE].T
    links = coo_array(
        (np.ones(len(left_faces)), (left_faces, right_faces)), shape=(len(unit_normals), len(unit_normals))
    )
    smooth_patch = connected_components(links, directed=False)[1]
    corners = mesh.merged_faces.reshape(-1) * len(unit_normals) + np.repeat(smooth_patch, 3)
    _, first_corner, vertex_of_corner = np.unique(corners, return_index=True, return_inverse=True)
    summed_normals = np.stack(
        [np.bincount(vertex_of_corner, np.repeat(area_vectors[:, k], 3)) for k in range(3)], axis=1
    )
    length = np.linalg.norm(summed_normals, axis=1, keepdims=True)
    normals = np.divide(summed_normals, length, out=np.repeat(unit_normals, 3, axis=0)[first_corner], where=length > 0)
    vertices = mesh.triangles.reshape(-1, 3)[first_corner]
    return vertices.astype(np.float32), normals.astype(np.float32), vertex_of_corner.reshape(-1, 3).astype(np.uint32)


def spans_hollow(solid: TriangleMesh, mesh: TriangleMesh) -> BoolArray:
    """Faces of a solid that span a hollow of the mesh: the middle of an edge is far from every vertex."""
    from scipy.spatial import KDTree

    corners = solid.triangles
    middles = (corners + np.roll(corners, 1, axis=1)) / 2
    away = KDTree(mesh.vertices).query(middles.reshape(-1, 3))[0].reshape(-1, 3).max(axis=1)
    spans: BoolArray = away > LID_FRACTION * np.linalg.norm(np.ptp(solid.vertices, axis=0))
    return spans
