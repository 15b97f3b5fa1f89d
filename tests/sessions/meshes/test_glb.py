import json
import struct

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from sessions.errors import MeshFileError
from sessions.mesh_data import MeshData
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
    mesh = MeshData(vertices, rng.integers(0, vertex_count, (face_count, 3)))
    assert same(mesh_from_bytes(mesh_to_glb(mesh, "soup"), "glb"), mesh)


def test_subnormal_and_extreme_coordinates_survive_glb():
    mesh = MeshData([[1e-45, -1e-40, 3.4e38], [0, 0, -3.4e38], [1, 1e-38, 1]], [[0, 1, 2], [2, 1, 0], [0, 1, 2]])
    assert same(mesh_from_bytes(mesh_to_glb(mesh, "x"), "glb"), mesh)


def test_glb_bytes_depend_on_mesh_and_name_alone():
    assert mesh_to_glb(box(), "a") == mesh_to_glb(box(), "a")
    assert mesh_to_glb(box(), "a") != mesh_to_glb(box(), "b")


def test_glb_is_laid_out_as_the_format_demands():
    mesh = box((0.1, 0.2, 0.3))
    data = mesh_to_glb(mesh, "Becherglas ä")
    magic, version, length, text_length, kind = struct.unpack_from("<IIIII", data)
    tree = json.loads(data[20 : 20 + text_length])
    binary_length, binary_kind = struct.unpack_from("<II", data, 20 + text_length)
    assert (data[:4], version, length, kind, binary_kind) == (b"glTF", 2, len(data), 0x4E4F534A, 0x004E4942)
    assert magic == 0x46546C67
    assert text_length % 4 == binary_length % 4 == 0
    assert tree["buffers"][0]["byteLength"] == binary_length == len(data) - 28 - text_length
    assert tree["nodes"][0]["name"] == "Becherglas ä"
    assert tree["accessors"][0]["min"] == mesh.bounds[0].astype(np.float32).tolist()
    assert tree["accessors"][0]["max"] == mesh.bounds[1].astype(np.float32).tolist()
    assert tree["accessors"][1]["count"] == mesh.faces.size


def test_only_a_mesh_that_float32_would_change_carries_float64_positions():
    third = MeshData([[0, 0, 0], [1 / 3, 0, 0], [0, 1 / 3, 0]], [[0, 1, 2]])
    assert b"float64" in mesh_to_glb(third, "x")
    assert b"float64" not in mesh_to_glb(box(), "x")


def test_another_reader_sees_the_mesh_of_a_file_with_float64_positions():
    third = MeshData([[0, 0, 0], [1 / 3, 0, 0], [0, 1 / 3, 0]], [[0, 1, 2]])
    import io

    scene = trimesh.load_scene(io.BytesIO(mesh_to_glb(third, "x")), file_type="glb", process=False)
    (mesh,) = scene.geometry.values()
    assert np.array_equal(mesh.vertices, third.vertices.astype(np.float32))


def test_a_file_of_our_own_is_read_without_a_library_for_meshes_and_one_of_others_with_it(monkeypatch):
    import sys

    fine, rounded = box((0.1, 0.2, 0.3)), box()
    foreign = mesh_to_glb(rounded, "x").replace(b"vrlab-replay", b"other-writer")
    monkeypatch.setitem(sys.modules, "trimesh", None)
    for mesh in (fine, rounded):
        assert same(mesh_from_bytes(mesh_to_glb(mesh, "x"), "glb"), mesh)
    with pytest.raises(MeshFileError):
        mesh_from_bytes(foreign, "glb")
    monkeypatch.undo()
    assert same(mesh_from_bytes(foreign, "glb"), rounded)
