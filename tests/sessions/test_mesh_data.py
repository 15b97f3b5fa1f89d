import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sessions.errors import MeshFileError
from sessions.mesh_data import MeshData, concatenated, is_closed

TETRAHEDRON = ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


@given(st.lists(st.floats(-1e30, 1e30), min_size=9, max_size=9))
def test_every_vertex_keeps_its_bits_and_negative_zeros_become_zeros(numbers):
    mesh = MeshData(np.reshape(numbers, (3, 3)), [[0, 1, 2]])
    assert mesh.vertices.dtype == np.float64
    assert mesh.vertices.tobytes() == (np.reshape(numbers, (3, 3)) + 0.0).tobytes()


def test_arrays_are_read_only_copies():
    vertices, faces = np.array(TETRAHEDRON[0], dtype=float), np.array(TETRAHEDRON[1])
    mesh = MeshData(vertices, faces)
    vertices[0], faces[0] = 7, 1
    assert mesh.vertices[0].tolist() == [0, 0, 0]
    assert mesh.faces[0].tolist() == [0, 2, 1]
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0, 0] = 1
    with pytest.raises(ValueError, match="read-only"):
        mesh.faces[0, 0] = 1


def test_volume_is_signed_and_bounds_are_the_corners():
    mesh = MeshData(*TETRAHEDRON)
    assert mesh.volume == pytest.approx(1 / 6, rel=1e-12)
    assert MeshData(mesh.vertices, mesh.faces[:, ::-1]).volume == pytest.approx(-1 / 6, rel=1e-12)
    assert mesh.bounds.tolist() == [[0, 0, 0], [1, 1, 1]]


def test_a_mirror_keeps_the_volume_positive():
    mirrored = MeshData(*TETRAHEDRON).transformed(np.diag([1, 1, -1, 1]))
    assert mirrored.volume == pytest.approx(1 / 6)
    assert is_closed(mirrored)


def test_concatenation_keeps_every_face_in_order():
    mesh = MeshData(*TETRAHEDRON)
    both = concatenated([mesh, mesh.transformed([[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])])
    assert np.array_equal(both.triangles[:4], mesh.triangles)
    assert np.array_equal(both.triangles[4:], mesh.triangles + np.array([5, 0, 0]))
    assert is_closed(both)


@pytest.mark.parametrize(
    "faces",
    [TETRAHEDRON[1][:3], [[0, 1, 2], *TETRAHEDRON[1][1:]], TETRAHEDRON[1] * 2],
    ids=["open", "one face turned", "every face twice"],
)
def test_open_turned_or_doubled_faces_are_not_closed(faces):
    assert is_closed(MeshData(*TETRAHEDRON))
    assert not is_closed(MeshData(TETRAHEDRON[0], faces))


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        ([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]], r"vertices must be .*\(3, 2\)"),
        (np.zeros((0, 3)), [[0, 1, 2]], r"at least one row"),
        (TETRAHEDRON[0], np.zeros((0, 3), int), r"faces must be .*at least one row"),
        (TETRAHEDRON[0], [[0, 1, 4]], r"face 0 names vertices \[0, 1, 4\] of a mesh with 4 vertices"),
        (TETRAHEDRON[0], [[0, 1, 2], [0, -1, 2]], r"face 1 "),
        (TETRAHEDRON[0], [[0.0, 1.0, 2.0]], r"whole numbers"),
        ([[0, 0, 0], [np.nan, 0, 0], [0, 1, 0]], [[0, 1, 2]], r"vertex 1 is \[nan"),
        ([[0, 0, 0], [0, 0, 0], [0, 1e39, 0]], [[0, 1, 2]], r"vertex 2 .*float32"),
    ],
)
def test_what_is_no_mesh_is_named(vertices, faces, message):
    with pytest.raises(MeshFileError, match=message):
        MeshData(vertices, faces)
