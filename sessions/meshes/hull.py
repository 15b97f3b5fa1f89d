"""Convex hulls of recorded meshes. The core, which sessions do not import, builds its own in `cdcore.bounding.hull`."""

import numpy as np
from numpy.typing import NDArray

from sessions.mesh_data import MeshData


def convex_hull(mesh: MeshData) -> MeshData:
    """Return the convex hull of the corners of a mesh's faces, closed; a flat mesh, which has none, as it is."""
    return hull_of_points(mesh.vertices[np.unique(mesh.faces)]) or mesh


def hull_of_points(points: NDArray[np.float64]) -> MeshData | None:
    """Return the convex hull of points (n, 3), closed, its faces wound outwards; ``None`` of flat ones.

    Source: Qhull by way of ``scipy.spatial.ConvexHull`` (Barber, Dobkin, Huhdanpaa 1996).
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        solid = ConvexHull(points)
    except (QhullError, ValueError):
        return None
    used, faces = np.unique(solid.simplices, return_inverse=True)
    faces = faces.reshape(solid.simplices.shape)
    corners = points[solid.simplices]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inwards = (normals * solid.equations[:, :3]).sum(axis=1) < 0.0
    faces[inwards] = faces[inwards][:, ::-1]
    return MeshData(points[used], faces)
