import numpy as np
import pytest

from sessions.geometry.solids import box
from sessions.mesh_data import MeshData, has_consistent_winding
from sessions.meshes.hull import convex_hull


def test_hull_of_an_l_shape_is_closed_and_convex():
    """An L of boxes of 2 x 1 x 1 and 1 x 2 x 1 has a hull: a box of 2 x 2 x 1, less half a cube at a corner."""
    lying, standing = box((2.0, 1.0, 1.0), (6.0, 5.5, 3.5)), box((1.0, 2.0, 1.0), (5.5, 6.0, 3.5))
    vertices = np.concatenate([lying.vertices, standing.vertices])
    hull = convex_hull(MeshData(vertices, np.concatenate([lying.faces, standing.faces + len(lying.vertices)])))
    assert has_consistent_winding(hull)
    assert hull.volume == pytest.approx(4.0 - 0.5)


def test_flat_mesh_has_no_hull_and_stays_as_it_is():
    """A square at z = 1 has no volume and so no convex hull: the mesh itself is returned."""
    flat = MeshData([[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], [[0, 1, 2], [0, 2, 3]])
    assert convex_hull(flat) is flat
