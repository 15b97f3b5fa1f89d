"""The convex hull of a mesh. Sessions, which do not import the core, have theirs in `sessions.meshes.hull`."""

import numpy as np

from cdcore.mesh import TriangleMesh, once_a_mesh
from cdcore.numerics import FloatArray


def hull_collider(mesh: TriangleMesh) -> TriangleMesh:
    """The convex hull, closed; of a flat mesh the mesh itself, which has no inside."""
    return _hull_of_mesh(mesh) or mesh


@once_a_mesh
def _hull_of_mesh(mesh: TriangleMesh) -> TriangleMesh | None:
    """Keep ``hull_of`` by mesh: an audit asks hulls at the detector's rate and at every frame, and each has its own
    tree.
    """
    return hull_of(mesh.referenced_vertices)


def hull_of(points: FloatArray) -> TriangleMesh | None:
    """The convex hull of points (n, 3), closed; ``None`` of flat ones.

    Source: Qhull by way of ``scipy.spatial.ConvexHull`` (Barber, Dobkin, Huhdanpaa 1996).
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):
        return None
    used, numbers = np.unique(hull.simplices, return_inverse=True)
    faces = numbers.reshape(hull.simplices.shape)
    corners = points[used]
    a, b, c = (corners[faces[:, k]] for k in range(3))
    inward = (np.cross(b - a, c - a) * hull.equations[:, :3]).sum(axis=1) < 0
    faces[inward] = faces[inward][:, ::-1]
    return TriangleMesh(corners, faces)
