"""GLB files of other programs: written here by hand, or by trimesh, and read by the format's own words."""

import json
import struct

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from sessions.errors import MeshFileError
from sessions.meshes.glb_tree import read_glb
from sessions.meshes.mesh_files import mesh_from_bytes

TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype="<f4")
KINDS = {"<f4": 5126, "<u2": 5123, "<u1": 5121, "<i2": 5122, "<u4": 5125}
TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


def glb(tree, *arrays):
    """A file whose accessor k is array k."""
    views, accessors, binary = [], [], b""
    for array in arrays:
        data = array.tobytes()
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
        made = {"bufferView": len(views) - 1, "componentType": KINDS[array.dtype.str.replace("|", "<")]}
        accessors.append(made | {"count": len(array), "type": TYPES[array.reshape(len(array), -1).shape[1]]})
        binary += data + b"\0" * (-len(data) % 4)
    whole = {"asset": {"version": "2.0"}, "accessors": accessors, "bufferViews": views,
             "buffers": [{"byteLength": len(binary)}], **tree}  # fmt: skip
    text = json.dumps(whole).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(binary), len(text), 0x4E4F534A)
    return head + text + struct.pack("<II", len(binary), 0x004E4942) + binary


def primitive(positions=0, **more):
    return {"attributes": {"POSITION": positions}, **more}


def one_mesh(node, *primitives):
    return {"nodes": [{"mesh": 0, **node}], "meshes": [{"primitives": list(primitives)}]}


def test_a_tree_is_split_by_node_in_frames_without_scale_and_joined_it_is_what_trimesh_places():
    rng, scene = np.random.default_rng(3), trimesh.Scene()
    solids = {name: trimesh.creation.icosphere(1, radius) for name, radius in (("a", 1.0), ("b", 0.4), ("c", 0.2))}
    local, above = {}, {"a": None, "b": "a", "c": "b"}
    for name, solid in solids.items():
        pose = np.eye(4)
        pose[:3, :3] = Rotation.random(random_state=rng).as_matrix() * (0.01 if name == "a" else 1.0)
        pose[:3, 3] = rng.standard_normal(3)
        local[name] = pose
        scene.add_geometry(solid, node_name=name, geom_name=name, transform=pose, parent_node_name=above[name])
    data = scene.export(file_type="glb")
    world = {"a": local["a"], "b": local["a"] @ local["b"], "c": local["a"] @ local["b"] @ local["c"]}
    placed = [trimesh.transform_points(solids[name].vertices, world[name])[solids[name].faces] for name in "abc"]
    assert np.allclose(mesh_from_bytes(data, "glb").triangles, np.concatenate(placed), atol=1e-6)
    # What a tracker reports of a node has no scale: its mesh carries the hundredth of the root. `c` hangs on `b`.
    for name, parts in (("a", "abc"), ("b", "bc")):
        rigid = world[name].copy()
        rigid[:3, :3] /= np.cbrt(np.linalg.det(rigid[:3, :3]))
        back = np.linalg.inv(rigid)
        wanted = [trimesh.transform_points(solids[one].vertices, back @ world[one])[solids[one].faces] for one in parts]
        assert np.allclose(read_glb(data).below(name).triangles, np.concatenate(wanted), atol=1e-7)
    assert mesh_from_bytes(data, "glb", node="c").bounds[1] == pytest.approx([0.002] * 3, rel=0.1)
    with pytest.raises(MeshFileError, match="no mesh hangs on a node 'd'; there are: a, b, c"):
        mesh_from_bytes(data, "glb", node="d")


def test_a_skin_is_cut_by_the_joint_that_moves_a_face_most_and_is_not_deformed():
    # A strip of four quads along x, rooted at joint 1 (x = 0) and joint 2 (x = 2); weights change at x = 2.
    points = np.array([[x, y, 0] for x in range(5) for y in (0, 1)], dtype="<f4")
    faces = np.array([[2 * k, 2 * k + 2, 2 * k + 1] for k in range(4)], dtype="<u2")
    joints = np.zeros((10, 4), dtype="<u1")
    joints[:, 1] = 1
    share = np.clip((points[:, 0] - 1.5) / 1.0, 0, 1)
    weights = np.stack([1 - share, share, 0 * share, 0 * share], axis=1).astype("<f4")
    inverse = np.stack([np.eye(4)] * 3)
    inverse[1, 0, 3] = -2.0
    tree = {
        "nodes": [{"mesh": 0, "skin": 0, "name": "Hand"}, {"name": "palm", "children": [2]},
                  {"name": "tip", "translation": [2, 0, 0], "rotation": [0, 0, 1, 0]}, {"name": "idle"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3}, "indices": 1}]}],
        "skins": [{"joints": [1, 2, 3], "inverseBindMatrices": 4}],
    }  # fmt: skip
    matrices = inverse.transpose(0, 2, 1).reshape(3, 16).astype("<f4")
    data = glb(tree, points, faces.reshape(-1), joints, weights, matrices)
    read = read_glb(data)
    assert read.owners == ("palm", "tip")
    tip = read.below("tip")
    assert len(tip.faces) == 2 and tip.bounds.tolist() == [[0, 0, 0], [2, 1, 0]]  # in its own frame, as it was bound
    assert len(read.whole().faces) == 4 and read.whole().bounds.tolist() == [[0, 0, 0], [4, 1, 0]]
    assert len(read.below("palm").faces) == 4  # and what hangs on its child


def test_short_positions_are_what_they_stand_for():
    short = np.array([[9, 9, 9], [0, 0, 0], [32767, 0, 0], [0, -32768, 0]], dtype="<i2")
    accessor = {"bufferView": 0, "byteOffset": 6, "componentType": 5122, "count": 3, "type": "VEC3", "normalized": True}
    data = glb({**one_mesh({"scale": [2, 2, 2]}, primitive()), "accessors": [accessor]}, short)
    assert mesh_from_bytes(data, "glb").vertices.tolist() == [[0, 0, 0], [2, 0, 0], [0, -2, 0]]


def test_nodes_outside_the_scene_that_claim_each_other_and_a_body_stop_nothing():
    nodes = [{"mesh": 0, "name": "cup"}, {"children": [0, 2]}, {"children": [1]}, {"name": "lamp"}]
    data = glb({**one_mesh({}, primitive()), "nodes": nodes, "scenes": [{"nodes": [0, 3]}]}, TRIANGLE)
    assert mesh_from_bytes(data, "glb", node="cup").vertices.tolist() == TRIANGLE.tolist()
    with pytest.raises(MeshFileError, match="no mesh hangs on a node 'lamp'; there are: cup"):
        mesh_from_bytes(data, "glb", node="lamp")


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"extensionsRequired": ["KHR_draco_mesh_compression"]}, "compressed by Draco; export it without"),
        ({"accessors": [{"componentType": 5126, "count": 10**12, "type": "VEC3"}]}, "claims 1,000,000,000,000 values"),
        ({"nodes": [{"mesh": 0, "children": [0]}]}, "no triangle"),
        ({"nodes": [{"mesh": 0}, {"children": [0]}, {"children": [0]}], "scenes": [{"nodes": [1, 2]}]}, "hangs on two"),
        ({"buffers": [{"byteLength": 36, "uri": "other.bin"}]}, "keeps its data in another file"),
        ({"meshes": [{"primitives": [primitive(mode=1)]}]}, "no triangle"),
        ({"meshes": [{"primitives": [primitive(mode=5)]}]}, "holds a strip or a fan"),
        ({"accessors": [{"componentType": 5126, "count": 3, "type": "VEC3", "sparse": {}}]}, "sparse accessor"),
        ({"meshes": [{"primitives": [{"attributes": {"POSITION": 7}}]}]}, "no readable GLB"),
        ({"nodes": [{"mesh": 0}] * 4, "accessors": [{"componentType": 5126, "count": 18_000_000, "type": "VEC3"}]},
         "hold more than 20,000,000 faces"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_one_sentence(more, said):
    with pytest.raises(MeshFileError, match=said):
        mesh_from_bytes(glb({**one_mesh({}, primitive()), **more}, TRIANGLE), "glb")
