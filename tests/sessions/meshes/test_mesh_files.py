import io

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from support.mutants import MUTANTS, tried

from sessions.errors import MeshFileError
from sessions.mesh_data import MeshData, has_consistent_winding
from sessions.meshes.glb import mesh_to_glb
from sessions.meshes.mesh_files import (
    FILE_TYPES,
    load_mesh,
    mesh_from_bytes,
    refined_mesh,
    subtracted_mesh,
    united_mesh,
)


def box_of(extents):
    """A box of these edges."""
    solid = trimesh.creation.box(extents)
    return MeshData(solid.vertices, solid.faces)


def have_equal_bytes(a, b):
    """Whether two meshes are the same, bit by bit."""
    return a.vertices.tobytes() == b.vertices.tobytes() and a.faces.tobytes() == b.faces.tobytes()


@given(st.integers(3, 40), st.integers(1, 60), st.integers(0, 2**32))
def test_any_mesh_survives_glb_bit_for_bit(vertex_count, face_count, seed):
    """A random mesh has coordinates of 1e-12 to 1e6, repeated vertices and negative zeros, which become zeros.

    Written as GLB and read again its arrays have the same bytes.
    """
    rng = np.random.default_rng(seed)
    vertices = rng.standard_normal((vertex_count, 3)) * 10.0 ** rng.integers(-12, 6, (vertex_count, 1))
    vertices[rng.random(vertex_count) < 0.2] = vertices[0]
    vertices[1] = -0.0
    mesh = MeshData(vertices, rng.integers(0, vertex_count, (face_count, 3)))
    assert mesh.vertices.tobytes() == (vertices + 0.0).tobytes()  # which makes zeros of negative ones
    assert have_equal_bytes(mesh_from_bytes(mesh_to_glb(mesh, "soup"), "glb"), mesh)


def test_trimesh_reads_a_written_glb_with_its_name():
    """A box is written under a name with an umlaut, which trimesh finds at its node; GLB has single precision."""
    mesh = box_of((0.1, 0.2, 0.3))
    scene = trimesh.load_scene(io.BytesIO(mesh_to_glb(mesh, "Becherglas ä")), file_type="glb", process=False)
    (box,) = scene.geometry.values()
    assert [*scene.graph.nodes_geometry] == ["Becherglas ä"]
    assert np.array_equal(box.faces, mesh.faces)
    assert np.array_equal(box.vertices, mesh.vertices.astype(np.float32))


TETRAHEDRON = ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


@pytest.mark.parametrize(
    "faces",
    [
        pytest.param([[0, 2, 1], [0, 1, 3], [0, 3, 2]], id="three of four faces"),
        pytest.param([[0, 1, 2], [0, 1, 3], [0, 3, 2], [1, 2, 3]], id="the first reversed"),
        pytest.param([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] * 2, id="every face twice"),
    ],
)
def test_open_reversed_or_doubled_faces_are_not_closed(faces):
    """A tetrahedron of the faces 0 2 1, 0 1 3, 0 3 2 and 1 2 3 is closed; ``faces`` are changed from these."""
    vertices, closed_faces = TETRAHEDRON
    assert has_consistent_winding(MeshData(vertices, closed_faces))
    assert not has_consistent_winding(MeshData(vertices, faces))


def test_a_mirroring_node_still_gives_an_outward_mesh():
    """A ball with a radius of 1 hangs below a node that mirrors Z; its volume is over 3 (of few faces, 4.2 if round).

    It would be negative, were its faces to look inwards.
    """
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.creation.icosphere(1), transform=np.diag([1, 1, -1, 1.0]))
    mesh = mesh_from_bytes(scene.export(file_type="glb"), "glb")
    assert has_consistent_winding(mesh)
    assert mesh.volume > 3


def test_obj_keeps_vertex_and_face_order_across_materials():
    """An OBJ has a red triangle, a blue one, a red quad, and a triangle whose row goes on in the next line.

    The quad is two triangles; none is moved to the others of its colour, and corners count from 0 in the mesh.
    """
    text = """mtllib none.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vt 1 1
usemtl red
f 1/1 2/2 3/1
usemtl blue
f 1/1/1 3//1 4
usemtl red
f -4 -3 -2 -1 # a quad, counted from the end
v 0 0 1
f 1 2 \\
5
"""
    mesh = mesh_from_bytes(text.encode(), "obj")
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 2], [0, 2, 3], [0, 1, 4]]
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1]]


@pytest.mark.parametrize("ascii_text", [True, False])
def test_stl_keeps_face_order_and_merges_equal_corners(ascii_text):
    """An STL states three corners for every face; the ball comes back with the vertices that it had."""
    solid = trimesh.creation.icosphere(2)
    data = trimesh.exchange.stl.export_stl_ascii(solid).encode() if ascii_text else solid.export(file_type="stl")
    mesh = mesh_from_bytes(data, "stl")
    assert np.allclose(mesh.triangles, solid.triangles, atol=1e-6)
    assert len(mesh.vertices) == len(solid.vertices)
    assert has_consistent_winding(mesh)


@pytest.mark.parametrize("kind", ["ply", "off"])
def test_ply_and_off_keep_vertices_and_faces(kind):
    """A ball, written by trimesh with at least six digits, has the same vertices and faces in the same order."""
    solid = trimesh.creation.icosphere(1)
    data = solid.export(file_type=kind)
    mesh = mesh_from_bytes(data if isinstance(data, bytes) else data.encode(), kind)
    assert np.array_equal(mesh.faces, solid.faces)
    assert np.allclose(mesh.vertices, solid.vertices, atol=1e-6)


def test_scale_is_applied_in_float64(tmp_path):
    """An OBJ has the vertices (1, 2, 3), (4, 5, 6) and (7, 8, 10) in centimetres; metres are their doubles by 0.01."""
    path = tmp_path / "cube.OBJ"
    path.write_text("v 1 2 3\nv 4 5 6\nv 7 8 10\nf 1 2 3\n")
    vertices = np.array([[1, 2, 3], [4, 5, 6], [7, 8, 10]])
    assert load_mesh(str(path)).vertices.tolist() == vertices.tolist()
    assert load_mesh(path, scale=0.01).vertices.tolist() == (vertices * 0.01).tolist()


def test_scale_that_is_no_number_is_refused(tmp_path):
    """The scale is infinite."""
    path = tmp_path / "cube.obj"
    path.write_text("v 1 2 3\nv 4 5 6\nv 7 8 10\nf 1 2 3\n")
    with pytest.raises(MeshFileError, match="scale is inf"):
        load_mesh(path, scale=np.inf)


def test_file_error_names_the_path_without_a_traceback(tmp_path):
    """A file is missing, empty, cut short or a folder; the error is one line without the name of a Python class."""
    (tmp_path / "empty.glb").write_bytes(b"")
    (tmp_path / "damaged.glb").write_bytes(mesh_to_glb(box_of((1, 1, 1)), "x")[:200])
    (tmp_path / "folder.glb").mkdir()
    for name in ("missing.glb", "empty.glb", "damaged.glb", "folder.glb"):
        with pytest.raises(MeshFileError) as caught:
            load_mesh(tmp_path / name)
        message = str(caught.value)
        assert str(tmp_path / name) in message, name
        assert "\n" not in message, name
        assert "Error" not in message, name


def test_unions_and_differences_have_the_volume_of_the_solids():
    """A plate of 4 x 1 x 4 and a bar of 1 x 3 x 1 through it share a cube of 1: together 16 + 3 - 1, without it 16 - 1.

    Both results are closed with faces outwards, and a second union has the same bytes.
    """
    plate, bar = box_of((4, 1, 4)), box_of((1, 3, 1))
    union, difference = united_mesh([plate, bar]), subtracted_mesh(plate, [bar])
    assert union.volume == pytest.approx(16 + 3 - 1, rel=1e-6)
    assert difference.volume == pytest.approx(16 - 1, rel=1e-6)
    assert has_consistent_winding(union)
    assert has_consistent_winding(difference)
    assert have_equal_bytes(united_mesh([plate, bar]), union)


def test_refined_cube_of_a_tenth_millimetre_keeps_its_volume():
    """The edges of a cube of 12 faces are cut in halves, so that it has more faces, but the same volume.

    Points that are nearer to each other than meshes usually have them are not joined, which would take the cube away.
    """
    edge_m = 1e-4
    fine = refined_mesh(box_of((edge_m, edge_m, edge_m)), edge_m / 2)
    assert fine.volume == pytest.approx(edge_m**3, rel=1e-5)
    assert len(fine.faces) > 12


@pytest.mark.parametrize("mutants", MUTANTS)
@pytest.mark.parametrize("kind", FILE_TYPES)
def test_mutants_end_in_a_mesh_or_a_sentence(tmp_path, kind, mutants):
    """A box is written in each format; so many copies with random bytes changed are read.

    ``tried`` fails where one gives neither a mesh nor one error in a sentence that names the file.
    """
    data = trimesh.creation.box((0.1, 0.2, 0.3)).export(file_type=kind)
    path = tmp_path / f"box.{kind}"
    path.write_bytes(data if isinstance(data, bytes) else data.encode())

    def read():
        mesh = load_mesh(path)
        assert np.isfinite(mesh.vertices).all()
        assert mesh.faces.max() < len(mesh.vertices)

    tried(path, mutants, read)


@pytest.mark.parametrize(
    ("data", "kind", "noun"),
    [(b"\x89PNG\r\n\x1a\n", "glb", "a picture"), (b"glTF\2\0\0\0", "obj", "a GLB"), (b"glTF\2\0\0\0", "stl", "a GLB")],
)
def test_file_of_another_kind_is_refused_by_its_kind(data, kind, noun):
    """A PNG is read as a GLB, and a GLB as an OBJ or an STL: the error names both kinds."""
    with pytest.raises(MeshFileError, match=f"it is {noun}.*, no {kind.upper()}"):
        mesh_from_bytes(data + bytes(40), kind)
