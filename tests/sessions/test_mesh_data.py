"""A mesh keeps its numbers, names the first wrong row, and knows its area, volume and winding."""

import numpy as np
import pytest
from support.small_worlds import cube

from sessions.errors import MeshFileError
from sessions.mesh_data import MeshData, concatenated_meshes, has_consistent_winding, least_area

TRIANGLE = [[0, 0, 0], [3, 0, 0], [0, 4, 0]]


def test_negative_zeros_become_zeros():
    """A triangle has the coordinate -0.0 in each vertex; no coordinate of its mesh has a minus sign."""
    vertices = MeshData([[-0.0, 0, 0], [3, -0.0, 0], [0, 4, -0.0]], [[0, 1, 2]]).vertices
    assert not np.signbit(vertices).any()


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (TRIANGLE, [[0, 1, 2], [0, 1, 3]], "face 1 names vertices"),
        (TRIANGLE, [[0, 1, -1]], "face 0 names vertices"),
        ([*TRIANGLE, [0, np.nan, 0]], [[0, 1, 2]], "vertex 3 is"),
        ([*TRIANGLE, [0, 1e39, 0]], [[0, 1, 2]], "vertex 3 is"),
        (TRIANGLE, [[0.0, 1.0, 2.0]], "faces must be whole numbers"),
        (TRIANGLE, np.zeros((0, 3), int), "at least one row"),
        ([[0, 0], [3, 0]], [[0, 1, 1]], r"vertices must be an array of shape \(v, 3\)"),
        (TRIANGLE[0], [[0, 0, 0]], "vertices must be an array of shape"),
    ],
)
def test_wrong_row_of_a_mesh_is_named(vertices, faces, message):
    """TRIANGLE has the vertices 0 to 2; a coordinate of 1e39 does not fit single precision."""
    with pytest.raises(MeshFileError, match=message):
        MeshData(vertices, faces)


def test_smallest_face_and_bounds_of_its_faces():
    """Right triangles with legs of 3 and 4 m, and of 3 and 0.5 m, have their right angle at (1, 2, 3).

    The smaller has 0.75 m2. A fifth vertex, at (10, 11, 12), is of no face and does not count for the bounds.
    """
    vertices = np.add([*TRIANGLE, [0, 0, 0.5], [9, 9, 9]], [1, 2, 3])
    mesh = MeshData(vertices, [[0, 1, 2], [0, 1, 3]])
    assert least_area(mesh) == pytest.approx(3.0 * 0.5 / 2)
    assert mesh.bounds.tolist() == [[1, 2, 3], [4, 6, 3.5]]


@pytest.mark.parametrize("factor", [2.0, -2.0])
def test_stretched_or_mirrored_mesh_still_faces_outwards(factor):
    """A cube of 1 m3 is stretched by 2 along X, or mirrored too, and moved by 3.3 km.

    The volume doubles, and stays positive, as of faces that look outwards.
    """
    unit, matrix = cube(), np.diag([factor, 1.0, 1.0, 1.0])
    offset = np.array([1e4, -5.0, 7.0]) / 3.0
    matrix[:3, 3] = offset
    moved = unit.transformed(matrix)
    np.testing.assert_allclose(moved.vertices, unit.vertices * [factor, 1, 1] + offset)
    assert moved.volume == pytest.approx(2.0, rel=1e-9)
    assert has_consistent_winding(moved)


def test_joined_meshes_keep_their_faces_in_order():
    """A closed cube and a single triangle, which leaves the whole open, are joined."""
    closed, single = cube(), MeshData(TRIANGLE, [[0, 1, 2]])
    both = concatenated_meshes([closed, single])
    np.testing.assert_array_equal(both.triangles, [*closed.triangles, *single.triangles])
    assert has_consistent_winding(closed)
    assert not has_consistent_winding(both)


def test_volume_is_kept_far_from_the_origin():
    """A cube of 1 m, 3,333 km from the origin in each direction, where doubles are half a nanometre apart."""
    far_cube = MeshData(cube().vertices + 1e7 / 3, cube().faces)
    assert far_cube.volume == pytest.approx(1.0, rel=1e-6)
