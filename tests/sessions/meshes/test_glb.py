import io

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from sessions.errors import MeshFileError, SessionError
from sessions.mesh_data import MeshData, is_closed
from sessions.meshes.conventions import CONVENTIONS, quaternion_from_euler
from sessions.meshes.glb import mesh_to_glb
from sessions.meshes.mesh_files import mesh_from_bytes


def box(extents=(1, 1, 1)):
    solid = trimesh.creation.box(extents)
    return MeshData(solid.vertices, solid.faces)


def same(a, b):
    return a.vertices.tobytes() == b.vertices.tobytes() and a.faces.tobytes() == b.faces.tobytes()


@given(st.integers(3, 40), st.integers(1, 60), st.integers(0, 2**32))
def test_any_mesh_survives_glb_bit_for_bit(vertex_count, face_count, seed):
    rng = np.random.default_rng(seed)
    vertices = rng.standard_normal((vertex_count, 3)) * 10.0 ** rng.integers(-12, 6, (vertex_count, 1))
    vertices[rng.random(vertex_count) < 0.2] = vertices[0]
    vertices[1] = -0.0
    mesh = MeshData(vertices, rng.integers(0, vertex_count, (face_count, 3)))
    assert mesh.vertices.tobytes() == (vertices + 0.0).tobytes()  # which makes zeros of negative ones
    assert same(mesh_from_bytes(mesh_to_glb(mesh, "soup"), "glb"), mesh)


def test_another_program_reads_what_is_written():
    mesh = box((0.1, 0.2, 0.3))
    scene = trimesh.load_scene(io.BytesIO(mesh_to_glb(mesh, "Becherglas ä")), file_type="glb", process=False)
    (read,) = scene.geometry.values()
    assert [*scene.graph.nodes_geometry] == ["Becherglas ä"] and np.array_equal(read.faces, mesh.faces)
    assert np.array_equal(read.vertices, mesh.vertices.astype(np.float32))


TABLE = {
    "unity": ((1, 2, -3), (-1, -2, 3, 4), "left"), "openvr": ((1, 2, 3), (1, 2, 3, 4), "right"),
    "openxr": ((1, 2, 3), (1, 2, 3, 4), "right"), "gltf": ((1, 2, 3), (1, 2, 3, 4), "right"),
    "ros": ((-2, 3, -1), (-2, 3, -1, 4), "right"), "z-up": ((1, 3, -2), (1, 3, -2, 4), "right"),
}  # fmt: skip
"""Point (1, 2, 3) and quaternion (1, 2, 3, 4) of each source in the canonical frame, written out by hand."""


@pytest.mark.parametrize("name", CONVENTIONS)
def test_points_and_quaternions_are_those_of_the_table(name):
    point, quaternion, side = TABLE[name]
    assert CONVENTIONS[name].points([1, 2, 3]).tolist() == list(point)
    assert CONVENTIONS[name].quaternions([1, 2, 3, 4]).tolist() == list(quaternion)
    assert CONVENTIONS[name].handedness == side


@pytest.mark.parametrize("order", ["", "xy", "xyw", "xYz", "xyzx", "xxy", "ZYY"])
def test_an_order_that_is_none_is_refused(order):
    with pytest.raises(SessionError, match="no Euler order"):
        quaternion_from_euler([0, 0, 0], order)


TETRAHEDRON = ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


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
