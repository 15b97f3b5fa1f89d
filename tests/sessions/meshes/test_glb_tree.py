"""GLB files of other programs: written here by hand, or by trimesh, and read by the format's own words."""

import base64
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
COMPONENT_TYPES = {"<f4": 5126, "<u2": 5123, "<u1": 5121, "<i2": 5122, "<u4": 5125}
TYPES_BY_WIDTH = {1: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


def glb_file(tree, *arrays):
    """The bytes of a GLB whose accessor k is array k; ``tree`` has its nodes, meshes and so on, as glTF's JSON."""
    views, accessors, binary = [], [], b""
    for array in arrays:
        data = array.tobytes()
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
        accessor = {"bufferView": len(views) - 1, "componentType": COMPONENT_TYPES[array.dtype.str.replace("|", "<")]}
        accessors.append(
            accessor | {"count": len(array), "type": TYPES_BY_WIDTH[array.reshape(len(array), -1).shape[1]]}
        )
        binary += data + b"\0" * (-len(data) % 4)
    whole = {"asset": {"version": "2.0"}, "accessors": accessors, "bufferViews": views,
             "buffers": [{"byteLength": len(binary)}], **tree}  # fmt: skip
    text = json.dumps(whole).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(binary), len(text), 0x4E4F534A)
    return head + text + struct.pack("<II", len(binary), 0x004E4942) + binary


def primitive_at(positions=0, **more):
    """A primitive (faces of a mesh, in glTF) whose positions are this accessor."""
    return {"attributes": {"POSITION": positions}, **more}


def tree_of_a_mesh(node, *primitives):
    """A tree of a node with a mesh of these primitives."""
    return {"nodes": [{"mesh": 0, **node}], "meshes": [{"primitives": list(primitives)}]}


@pytest.mark.parametrize("names", [("cup_LOD0", "cup_LOD1"), ("LOD2", "LOD0"), ("cup.lod1", "cup LOD 3")])
def test_levels_of_detail_are_not_joined(names):
    """Two children of a node "cup" are named as two levels of detail: one of them must be named to be read."""
    nodes = [{"name": "cup", "children": [1, 2]}, *({"name": name, "mesh": 0} for name in names)]
    data = glb_file(
        {"nodes": nodes, "scenes": [{"nodes": [0]}], "meshes": [{"primitives": [primitive_at()]}]}, TRIANGLE
    )
    for node in ("", "cup"):
        with pytest.raises(MeshFileError, match="are one surface in different detail; export one of them"):
            mesh_from_bytes(data, "glb", 1.0, node)
    for name in names:
        assert len(mesh_from_bytes(data, "glb", 1.0, name).faces) == 1, name


@pytest.mark.parametrize("names", [("cup_LOD0", "lid_LOD1"), ("cup_LOD0", "cup_LOD0"), ("pilod", "cup")])
def test_meshes_of_one_level_of_detail_are_joined(names):
    """Two nodes, each a triangle, are not two levels of detail of one object: the mesh has both triangles."""
    nodes = [{"name": name, "mesh": 0} for name in names]
    tree = {"nodes": nodes, "scenes": [{"nodes": [0, 1]}], "meshes": [{"primitives": [primitive_at()]}]}
    assert len(mesh_from_bytes(glb_file(tree, TRIANGLE), "glb").faces) == 2


def test_node_tree_is_split_unscaled_and_joins_as_in_trimesh():
    """Ball b hangs on a, and c on b; a is scaled by 0.01, so that c, with a radius of 0.2, has one of 2 mm.

    trimesh writes the file; corners are placed here by the product of the nodes' matrices. Read whole, the mesh has
    them there; read as a node, it is in that node's frame without its scale. A node that is not there is refused.
    """
    rng, scene = np.random.default_rng(3), trimesh.Scene()
    solids = {
        name: trimesh.creation.icosphere(subdivisions=1, radius=radius)
        for name, radius in (("a", 1.0), ("b", 0.4), ("c", 0.2))
    }
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
    for name, pieces in (("a", "abc"), ("b", "bc")):
        rigid = world[name].copy()
        rigid[:3, :3] /= np.cbrt(np.linalg.det(rigid[:3, :3]))
        back = np.linalg.inv(rigid)
        expected = [
            trimesh.transform_points(solids[item].vertices, back @ world[item])[solids[item].faces] for item in pieces
        ]
        assert np.allclose(read_glb(data).below(name).triangles, np.concatenate(expected), atol=1e-7), name
    assert mesh_from_bytes(data, "glb", node="c").bounds[1] == pytest.approx([0.002] * 3, rel=0.1)
    with pytest.raises(MeshFileError, match="no mesh hangs on a node 'd'; there are: a, b, c"):
        mesh_from_bytes(data, "glb", node="d")


def test_skin_is_cut_by_strongest_joint_and_posed_by_all():
    """A strip of four triangles along x hangs on a joint "palm" at x = 0 and on its child "tip" at x = 2.

    Weights change from the one to the other around x = 2. Read as a joint, the mesh has the faces whose weight is
    largest there, as they were bound. Read whole, each corner moves with both joints by weight: "tip" is rotated by
    half a circle, so that x = 3 and 4 fold back, and x = 2 goes halfway, onto the axis.
    """
    points = np.array([[x, y, 0] for x in range(5) for y in (0, 1)], dtype="<f4")
    faces = np.array([[2 * k, 2 * k + 2, 2 * k + 1] for k in range(4)], dtype="<u2")
    joints = np.zeros((10, 4), dtype="<u1")
    joints[:, 1] = 1
    fraction = np.clip((points[:, 0] - 1.5) / 1.0, 0, 1)
    weights = np.stack([1 - fraction, fraction, 0 * fraction, 0 * fraction], axis=1).astype("<f4")
    inverse = np.stack([np.eye(4)] * 3)
    inverse[1, 0, 3] = -2.0
    tree = {
        "nodes": [
            {"mesh": 0, "skin": 0, "name": "Hand"},
            {"name": "palm", "children": [2]},
            {"name": "tip", "translation": [2, 0, 0], "rotation": [0, 0, 1, 0]},
            {"name": "idle"},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3}, "indices": 1}]}],
        "skins": [{"joints": [1, 2, 3], "inverseBindMatrices": 4}],
    }
    matrices = inverse.transpose(0, 2, 1).reshape(3, 16).astype("<f4")
    data = glb_file(tree, points, faces.reshape(-1), joints, weights, matrices)
    glb = read_glb(data)
    assert glb.owners == ("palm", "tip")
    tip = glb.below("tip")
    assert len(tip.faces) == 2
    assert tip.bounds.tolist() == [[0, 0, 0], [2, 1, 0]]
    assert len(glb.below("palm").faces) == 4  # with those of its child
    folded = [[0, 0], [0, 1], [1, 0], [1, 1], [2, 0], [2, 0], [1, 0], [1, -1], [0, 0], [0, -1]]
    assert len(glb.whole().faces) == 4
    assert np.allclose(glb.whole().vertices[:, :2], folded, atol=1e-15)


def test_normalised_16_bit_positions_are_scaled_to_unit_range():
    """Positions are 16-bit integers: 32767 stands for 1 and -32768 for -1 (glTF 2.0, 3.6.2.2); the node scales by 2.

    The accessor skips the first of four rows, 6 bytes.
    """
    short = np.array([[9, 9, 9], [0, 0, 0], [32767, 0, 0], [0, -32768, 0]], dtype="<i2")
    accessor = {"bufferView": 0, "byteOffset": 6, "componentType": 5122, "count": 3, "type": "VEC3", "normalized": True}
    data = glb_file({**tree_of_a_mesh({"scale": [2, 2, 2]}, primitive_at()), "accessors": [accessor]}, short)
    assert mesh_from_bytes(data, "glb").vertices.tolist() == [[0, 0, 0], [2, 0, 0], [0, -2, 0]]


def test_cyclic_nodes_outside_the_scene_are_ignored():
    """Nodes 1 and 2 are each other's children; the scene has only 0, "cup" with a mesh, and 3, "lamp" without."""
    nodes = [{"mesh": 0, "name": "cup"}, {"children": [0, 2]}, {"children": [1]}, {"name": "lamp"}]
    data = glb_file({**tree_of_a_mesh({}, primitive_at()), "nodes": nodes, "scenes": [{"nodes": [0, 3]}]}, TRIANGLE)
    assert mesh_from_bytes(data, "glb", node="cup").vertices.tolist() == TRIANGLE.tolist()
    with pytest.raises(MeshFileError, match="no mesh hangs on a node 'lamp'; there are: cup"):
        mesh_from_bytes(data, "glb", node="lamp")


BOX = trimesh.creation.box((1.0, 2.0, 3.0))
"""A box of 8 vertices and a volume of 6, with its faces outwards."""
BOX_POINTS = BOX.vertices.astype("<f4")
BOX_CORNERS = BOX.faces.astype("<u2").reshape(-1)


def test_skin_follows_its_joints_and_ignores_its_node():
    """Eight vertices, each with eight joints of random weights; expected: the weighted sum of its joints' matrices.

    A joint's matrix: its place in the tree times its inverse bind matrix. Shift and scale of the skinned node itself
    are not applied, as glTF asks.
    """
    random = np.random.default_rng(7)
    locals_, inverse = [], []
    for _ in range(3):
        pose = np.eye(4)
        pose[:3, :3] = Rotation.random(random_state=random).as_matrix() * random.uniform(0.01, 2.0)
        pose[:3, 3] = random.standard_normal(3)
        locals_.append(pose)
        inverse.append(np.linalg.inv(pose) + 0.1 * np.vstack([random.standard_normal((3, 4)), np.zeros(4)]))
    world = [locals_[0], locals_[0] @ locals_[1], locals_[2]]  # joint 1 hangs on joint 0
    joints = random.integers(0, 3, (2, 8, 4)).astype("<u1")
    weights = random.integers(1, 60, (2, 8, 4)).astype("<u1")
    nodes = [{"matrix": pose.T.reshape(-1).tolist()} for pose in locals_]
    nodes[0]["children"] = [1]
    nodes.append({"mesh": 0, "skin": 0, "translation": [5, 6, 7], "scale": [9, 9, 9]})
    names = ("POSITION", "JOINTS_0", "JOINTS_1", "WEIGHTS_0", "WEIGHTS_1")
    skinned = {"attributes": dict(zip(names, range(5), strict=True)), "indices": 5}
    skin = {"joints": [0, 1, 2], "inverseBindMatrices": 6}
    tree = {"nodes": nodes, "meshes": [{"primitives": [skinned]}], "skins": [skin]}
    matrices = np.array(inverse).transpose(0, 2, 1).reshape(3, 16).astype("<f4")
    data = glb_file(tree, BOX_POINTS, *joints, *weights, BOX_CORNERS, matrices)
    expected = []
    for vertex in range(8):
        fractions = weights[:, vertex].reshape(-1) / weights[:, vertex].sum()
        blend = sum(
            fraction * world[joint] @ matrices[joint].reshape(4, 4).T.astype(float)
            for fraction, joint in zip(fractions, joints[:, vertex].reshape(-1), strict=True)
        )
        expected.append((blend @ [*BOX_POINTS[vertex], 1.0])[:3])
    assert np.allclose(mesh_from_bytes(data, "glb").vertices, expected, atol=1e-12)


def test_an_armature_that_mirrors_gives_an_outward_mesh():
    """A box is skinned to the one joint node 0, which mirrors X; faces inwards would give a negative volume."""
    mirroring_joint, skinned_box = {"scale": [-1, 1, 1]}, {"mesh": 0, "skin": 0}
    attributes = {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3}  # numbers of the arrays that `glb_file` gets
    tree = {
        "nodes": [mirroring_joint, skinned_box],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 1}]}],
        "skins": [{"joints": [0]}],
    }
    joints, weights = np.zeros((8, 4), dtype="<u1"), np.zeros((8, 4), dtype="<f4")  # no weights: all to the first joint
    mesh = mesh_from_bytes(glb_file(tree, BOX_POINTS, BOX_CORNERS, joints, weights), "glb")
    assert mesh.volume == pytest.approx(BOX.volume)


@pytest.mark.parametrize(("joint_rows", "weight_rows", "joint"), [(8, 7, 0), (7, 8, 0), (7, 7, 0), (8, 8, 1)])
def test_skin_that_does_not_fit_its_eight_vertices_is_refused(joint_rows, weight_rows, joint):
    """Rows of joints or weights number 7 for 8 vertices, or a row names joint 1 of a skin whose only joint is 0."""
    attributes = {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3}  # numbers of the arrays that `glb_file` gets
    tree = {
        "nodes": [{}, {"mesh": 0, "skin": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 1}]}],
        "skins": [{"joints": [0]}],
    }
    joints, weights = np.full((joint_rows, 4), joint, dtype="<u1"), np.ones((weight_rows, 4), dtype="<f4")
    with pytest.raises(MeshFileError, match="joints and weights of a skin do not fit its vertices"):
        mesh_from_bytes(glb_file(tree, BOX_POINTS, BOX_CORNERS, joints, weights), "glb")


@pytest.mark.parametrize(
    ("of_mesh", "of_node", "expected"),
    [
        (None, None, 0.0),
        ([0.5, 0.0, 1.0], None, 2.0),
        ([0.5, 0.0, 1.0], [1.0, 0.0, 1.0], 4.0),
        ([1.0, 1.0, 1.0], None, 14.0),
    ],
)
def test_morph_targets_use_weights_of_node_before_mesh(of_mesh, of_node, expected):
    """Morph targets are changes of a mesh, added by weight: here all corners of a box, 3 m high along Z, are lifted.

    The first lifts by 4 m, the second, stored sparsely, by 10 m; a third changes normals alone. The weights are those
    of the node, else of the mesh, else 0. ``expected``: z of the middle of the box, 4 or 10 m times the weights.
    """
    dense = np.tile(np.array([[0, 0, 4]], dtype="<f4"), (8, 1))
    positions, values = np.arange(8, dtype="<u2"), np.tile(np.array([[0, 0, 10]], dtype="<f4"), (8, 1))
    mesh = {"primitives": [primitive_at(indices=1, targets=[{"POSITION": 2}, {"POSITION": 5}, {"NORMAL": 2}])]}
    node = {"mesh": 0, **({"weights": of_node} if of_node else {})}
    tree = {"nodes": [node], "meshes": [mesh | ({"weights": of_mesh} if of_mesh else {})]}
    data = glb_file(tree, BOX_POINTS, BOX_CORNERS, dense, positions, values)
    text = json.loads(data[20 : 20 + struct.unpack_from("<I", data, 12)[0]])
    sparse = {"count": 8, "indices": {"bufferView": 3, "componentType": 5123}, "values": {"bufferView": 4}}
    text["accessors"].append({"componentType": 5126, "count": 8, "type": "VEC3", "sparse": sparse})
    data = glb_file({**tree, "accessors": text["accessors"]}, BOX_POINTS, BOX_CORNERS, dense, positions, values)
    mesh = mesh_from_bytes(data, "glb")
    assert np.allclose(mesh.bounds[:, 2], [expected - 1.5, expected + 1.5])


def test_the_buffer_that_a_view_names_is_read():
    """The view names the second buffer, of a data URI; the file's own holds another triangle."""
    uri = "data:application/octet-stream;base64," + base64.b64encode(TRIANGLE.tobytes()).decode()
    views = [{"buffer": 1, "byteLength": 36}]
    buffers = [{"byteLength": 36}, {"byteLength": 36, "uri": uri}]
    data = glb_file({**tree_of_a_mesh({}, primitive_at()), "bufferViews": views, "buffers": buffers}, TRIANGLE * 7)
    assert mesh_from_bytes(data, "glb").vertices.tolist() == TRIANGLE.tolist()


def test_appearance_and_redundant_data_are_ignored():
    """Required are extensions of materials, textures and numbers; a Draco copy is there beside the plain positions."""
    draco = primitive_at(extensions={"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}})
    required = {"extensionsRequired": ["KHR_materials_unlit", "KHR_texture_transform", "KHR_mesh_quantization"]}
    data = glb_file({**tree_of_a_mesh({}, draco), **required}, TRIANGLE)
    assert len(mesh_from_bytes(data, "glb").faces) == 1


def with_version(version, length=0):
    """A file that states this version, and a length that is off by ``length``."""
    data = bytearray(glb_file(tree_of_a_mesh({}, primitive_at()), TRIANGLE))
    struct.pack_into("<I", data, 4, version)
    struct.pack_into("<I", data, 8, len(data) + length)
    return bytes(data)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (with_version(version=1), "it is glTF 1.0; export it as glTF 2.0"),
        (with_version(version=2, length=1), "cut short"),
    ],
)
def test_another_version_and_a_cut_file_are_named(data, message):
    """A file that states version 1, and one that states a byte more than it has."""
    with pytest.raises(MeshFileError, match=message):
        mesh_from_bytes(data, "glb")


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"extensionsRequired": ["KHR_draco_mesh_compression"]}, "compressed by Draco; export it without"),
        ({"accessors": [{"componentType": 5126, "count": 10**12, "type": "VEC3"}]}, "claims 1,000,000,000,000 values"),
        ({"nodes": [{"mesh": 0, "children": [0]}]}, "no triangle"),
        ({"nodes": [{"mesh": 0}, {"children": [0]}, {"children": [0]}], "scenes": [{"nodes": [1, 2]}]}, "hangs on two"),
        ({"buffers": [{"byteLength": 36, "uri": "other.bin"}]}, "keeps its data in another file"),
        ({"meshes": [{"primitives": [primitive_at(mode=1)]}]}, "no triangle"),
        ({"meshes": [{"primitives": [primitive_at(mode=5)]}]}, "holds a strip or a fan"),
        ({"accessors": [{"componentType": 5126, "count": 3, "type": "VEC3", "sparse": {}}]}, "no readable GLB"),
        ({"accessors": [{"componentType": 5126, "count": 3, "type": "VEC3"}]}, "an accessor of it has no data"),
        ({"accessors": [{"componentType": 5126, "count": 9_000, "type": "VEC3", "sparse": {}}]}, "has no data"),
        ({"bufferViews": [{"buffer": 0, "byteLength": 36, "byteStride": 0}]}, "elements of an accessor overlap"),
        ({"bufferViews": [{"buffer": 0, "byteLength": 360}]}, "lies beyond its end: cut short"),
        ({"bufferViews": [{"buffer": -1, "byteLength": 36}]}, "names row -1 of a list of 1"),
        ({"buffers": [{}, {}], "bufferViews": [{"buffer": 1, "byteLength": 36}]}, "its buffer 1 holds no data"),
        ({"bufferViews": [{"buffer": 1, "byteLength": 36, "extensions": {"EXT_meshopt_compression": {}}}],
          "buffers": [{}, {}]}, "compressed by meshopt; export it without"),
        ({"extensionsRequired": ["EXT_meshopt_compression"]}, "compressed by meshopt"),
        ({"extensionsRequired": ["KHR_meshopt_compression"]}, "compressed by meshopt"),
        ({"extensionsRequired": ["EXT_mesh_gpu_instancing"]}, "draws a mesh many times by EXT_mesh_gpu_instancing"),
        ({"nodes": [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {}}}]}, "EXT_mesh_gpu_instancing"),
        ({"extensionsRequired": ["ACME_waves"]}, "requires the extension ACME_waves, which may change its shape"),
        ({"asset": {"version": "1.1"}}, "it is glTF 1.1; export it as glTF 2.0"),
        ({"asset": {"version": "2.0", "minVersion": "2.1"}}, "it is glTF 2.1; export it as glTF 2.0"),
        ({"nodes": [{"mesh": 0, "weights": [1.0]}]}, "1 weights of 0 morph targets"),
        ({"nodes": [{"mesh": 0, "skin": 0}, {}], "skins": [{"joints": [1]}], "scenes": [{"nodes": [0]}]},
         "joint 1 of a skin is no node of its scene"),
        ({"nodes": [{"mesh": 0, "skin": 0}], "skins": [{"joints": [0]}]}, "names no joints"),
        ({"meshes": [{"primitives": [primitive_at(extensions={"KHR_draco_mesh_compression": {}})]}],
          "accessors": [{"componentType": 5126, "count": 3, "type": "VEC3"}]}, "compressed by Draco"),
        ({"meshes": [{"primitives": [{"attributes": {"POSITION": 7}}]}]}, "names row 7 of a list of 1"),
        ({"nodes": [{"mesh": 0}] * 4, "accessors": [{"componentType": 5126, "count": 18_000_000, "type": "VEC3"}]},
         "hold more than 20,000,000 faces"),
    ],
)  # fmt: skip
def test_unreadable_files_are_refused_in_a_sentence(more, message):
    """``more`` replaces parts of the tree of a file with one triangle."""
    with pytest.raises(MeshFileError, match=message):
        mesh_from_bytes(glb_file({**tree_of_a_mesh({}, primitive_at()), **more}, TRIANGLE), "glb")


@pytest.mark.parametrize("length", [2.0, 1.01, 0.9])
def test_node_rotation_must_be_a_unit_quaternion(length):
    """(0, 0, 0.6, 0.8) has length 1; ``length`` times as long, by 1 % already, it is no rotation and is refused."""
    node = {"rotation": [0.0, 0.0, 0.6 * length, 0.8 * length]}
    with pytest.raises(MeshFileError, match="a rotation of length"):
        mesh_from_bytes(glb_file(tree_of_a_mesh(node, primitive_at()), TRIANGLE), "glb")


def test_named_node_of_scale_zero_is_refused():
    """The node is scaled by (0, 1, 1): its mesh has no frame that it could be read in."""
    tree = tree_of_a_mesh({"name": "cup", "scale": [0.0, 1.0, 1.0]}, primitive_at())
    with pytest.raises(MeshFileError, match="a node has a scale of 0"):
        mesh_from_bytes(glb_file(tree, TRIANGLE), "glb", node="cup")


def two_nodes(first, second, **more):
    """A file with a triangle on each of two nodes."""
    nodes = [{"mesh": 0, **first}, {"mesh": 0, **second}]
    return glb_file({"nodes": nodes, "meshes": [{"primitives": [primitive_at()]}], **more}, TRIANGLE)


HIDDEN = {"extensions": {"KHR_node_visibility": {"visible": False}}}


@pytest.mark.parametrize(
    "nodes",
    [
        [{"mesh": 0}, {"mesh": 0, "name": "spare", **HIDDEN}],
        [{"mesh": 0}, {"children": [2], **HIDDEN}, {"mesh": 0, "name": "spare"}],
    ],
)
def test_surface_of_a_hidden_node_is_not_joined_in_silence(nodes):
    """The node "spare", or the node above it, is not visible; the other node with a mesh is."""
    data = glb_file({"nodes": nodes, "meshes": [{"primitives": [primitive_at()]}]}, TRIANGLE)
    with pytest.raises(MeshFileError, match="'spare' is hidden"):
        mesh_from_bytes(data, "glb")


@pytest.mark.parametrize("prefix", ["UCX", "UBX", "USP", "UCP", "UTM"])
def test_collider_nodes_are_not_read_as_part_of_the_surface(prefix):
    """Prefixes as UCX mark colliders by the convention of Unreal; naming the node ``cup`` reads the surface alone."""
    data = two_nodes({"name": "cup"}, {"name": f"{prefix}_cup_00", "scale": [2.0, 2.0, 2.0]})
    with pytest.raises(MeshFileError, match=f"the collider '{prefix}_cup_00' beside the surface"):
        mesh_from_bytes(data, "glb")
    assert np.array_equal(mesh_from_bytes(data, "glb", node="cup").vertices, TRIANGLE)


def test_collider_node_below_its_body_is_not_surface():
    """ "cup" and its child UCX_cup_00, a collider by its name, have a triangle each: one is read."""
    nodes = [{"mesh": 0, "name": "cup", "children": [1]}, {"mesh": 0, "name": "UCX_cup_00"}]
    data = glb_file({"nodes": nodes, "meshes": [{"primitives": [primitive_at()]}]}, TRIANGLE)
    assert len(mesh_from_bytes(data, "glb", node="cup").faces) == 1


def test_glb_with_only_colliders_is_read_as_a_mesh():
    """Two nodes with names of colliders have a triangle each: both are read."""
    data = two_nodes({"name": "UCX_cup_00"}, {"name": "UCX_cup_01"})
    assert len(mesh_from_bytes(data, "glb").faces) == 2
