"""glTF with physics: compound shapes in the frames of their bodies, and what cannot be taken."""

import base64
import json
import struct

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sessions.errors import SceneSourceError
from sessions.scene_formats.scene_source import read_scene_source

ROTATION = Rotation.from_euler("xyz", [0.3, -0.4, 0.5])
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.1, 0.1, 0.1]], dtype=np.float32)
"""Corners of a tetrahedron with legs of 1 m along the axes, and a point inside it."""
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 4], [2, 3, 4], [3, 1, 4]], dtype=np.uint16)
"""Its slanted side is dented to the point inside: a hollow that the convex hull fills."""


def gltf_document(nodes, shapes, kind, **more):
    """A glTF of nodes; what a node has as "physics" is written by the extension of Khronos (KHR) or OMI.

    Mesh 0 is that of CORNERS and FACES. ``more``: further parts of the extension.
    """
    body, shape_list = {
        "KHR": ("KHR_physics_rigid_bodies", "KHR_implicit_shapes"),
        "OMI": ("OMI_physics_body", "OMI_physics_shape"),
    }[kind]
    for node in nodes:
        if "physics" in node:
            node["extensions"] = {body: node.pop("physics")}
    data = CORNERS.tobytes() + FACES.tobytes()
    inside = {child for node in nodes for child in node.get("children", ())}
    extensions = {shape_list: {"shapes": shapes}} | ({body: more} if more else {})
    return {
        "asset": {"version": "2.0"},
        "extensionsUsed": [body, shape_list],
        "extensionsRequired": [body, shape_list],
        "extensions": extensions,
        "nodes": nodes,
        "scenes": [{"nodes": [number for number in range(len(nodes)) if number not in inside]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 18, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 60}, {"buffer": 0, "byteOffset": 60, "byteLength": 36}],
        "buffers": [{"byteLength": len(data), "uri": "data:;base64," + base64.b64encode(data).decode()}],
    }


def scene_of(folder, content):
    """The scene that is read from a GLB file with this content."""
    return read_scene_source(write_glb(folder / "s.glb", content))


def collider_of_shape(kind, number=0):
    """A collider of a node with the shape of this number, as either extension writes it."""
    return {"collider": {"geometry": {"shape": number}} if kind == "KHR" else {"shape": number}}


def write_glb(path, content):
    """The path of a GLB file, the binary form of glTF, with this content."""
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    path.write_bytes(struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A) + text)
    return path


GLASS, STEM = 0, 1
"""Numbers of nodes in ``glass_document``."""


def glass_document(kind):
    """A body "glass" of three shapes, and a table, which has no motion.

    A box on the body's own node, which stands at (1, 2, 3) with ROTATION; a capsule on a child 1 m below; a ball of
    radius 0.5 m on a grandchild 1 m above, which is scaled by 2.
    """
    shapes = [
        {"type": "box", "box": {"size": [0.2, 0.4, 0.6]}},
        {"type": "capsule", "capsule": {"height": 0.3, "radiusBottom": 0.1, "radiusTop": 0.1}},
        {"type": "sphere", "sphere": {"radius": 0.5}},
    ]
    nodes = [
        {"name": "glass", "translation": [1, 2, 3], "rotation": ROTATION.as_quat().tolist(), "children": [1, 2],
         "physics": {"motion": {"mass": 0.2, "type": "dynamic"}, **collider_of_shape(kind, 0)}},
        {"name": "stem", "translation": [0, -1, 0], "physics": collider_of_shape(kind, 1)},
        {"name": "rim", "children": [3], "translation": [0, 1, 0]},
        {"name": "bead", "scale": [2, 2, 2], "physics": collider_of_shape(kind, 2)},
        {"name": "table", "translation": [0, -1, 0], "physics": collider_of_shape(kind, 0)},
    ]  # fmt: skip
    return gltf_document(nodes, shapes, kind)


@pytest.mark.parametrize("kind", ["KHR", "OMI"])
def test_shapes_of_a_gltf_compound_are_in_body_axes(tmp_path, kind):
    """A box of 0.2 x 0.4 x 0.6 m on the body's node, a capsule 1 m below, and 1 m above a ball of radius 1 m.

    The capsule has 0.3 m between the middles of its ends and a radius of 0.1 m: 0.25 m from its middle to a tip.
    """
    glass = scene_of(tmp_path, glass_document(kind)).bodies["glass"]
    box, capsule, ball = (collider.bounds for collider in glass.colliders)
    assert np.abs(box - [[-0.1, -0.2, -0.3], [0.1, 0.2, 0.3]]).max() <= 1e-9
    assert np.abs(capsule - [[-0.1, -1.0 - 0.25, -0.1], [0.1, -1.0 + 0.25, 0.1]]).max() <= 1e-9
    assert np.abs(ball - [[-1, 1 - 1, -1], [1, 1 + 1, 1]]).max() <= 1e-9


@pytest.mark.parametrize("kind", ["KHR", "OMI"])
def test_gltf_bodies_have_pose_mass_and_motion(tmp_path, kind):
    """The glass stands at (1, 2, 3) with ROTATION and moves; the table has no motion. glTF has +Y up, as the scene."""
    scene = scene_of(tmp_path, glass_document(kind))
    assert {name: body.moves for name, body in scene.bodies.items()} == {"glass": True, "table": False}
    glass = scene.bodies["glass"]
    assert glass.mass == 0.2
    assert np.abs(glass.pose[:3, :3] - ROTATION.as_matrix()).max() <= 1e-9
    assert glass.pose[:3, 3].tolist() == [1, 2, 3]
    assert np.array_equal(scene.rotation, np.eye(3))


def test_gltf_text_may_hold_its_buffers(tmp_path):
    """The buffer of the mesh is written in the file; another one has no content that anything uses."""
    nodes = [{"name": "cup", "mesh": 0, "physics": {"motion": {}, "collider": {"shape": 0}}}]
    content = gltf_document(nodes, [{"type": "trimesh", "trimesh": {"mesh": 0}}], "OMI")
    content["buffers"].append({"byteLength": 4})
    path = tmp_path / "cup.gltf"
    path.write_text(json.dumps(content))
    body = read_scene_source(path).bodies["cup"]
    assert np.abs(body.mesh.vertices - CORNERS).max() <= 1e-6


def test_rotations_in_float32_do_not_stretch(tmp_path):
    """The glass's rotation is rounded to float32; the stem's quaternion, of norm 0.99998, means 90 degrees about x.

    Neither changes a length: the glass has a rotation to 1e-12, and the stem's capsule, 1 m below, 0.5 m long and of
    radius 0.1 m, lies along z.
    """
    content = glass_document("KHR")
    content["nodes"][GLASS]["rotation"] = ROTATION.as_quat().astype(np.float32).tolist()
    content["nodes"][STEM]["rotation"] = [0.7071, 0, 0, 0.7071]
    glass = scene_of(tmp_path, content).bodies["glass"]
    assert np.abs(glass.pose[:3, :3] @ glass.pose[:3, :3].T - np.eye(3)).max() <= 1e-12
    _, capsule, _ = glass.colliders
    assert np.abs(capsule.bounds - [[-0.1, -1.1, -0.25], [0.1, -0.9, 0.25]]).max() <= 1e-9


def test_rotation_without_length_is_refused(tmp_path):
    """The stem of a glass has the quaternion 0, 0, 0, 0, which is no rotation."""
    content = glass_document("KHR")
    content["nodes"][STEM]["rotation"] = [0, 0, 0, 0]
    with pytest.raises(SceneSourceError, match="rotation without length"):
        scene_of(tmp_path, content)


@pytest.mark.parametrize("shape", ["trimesh", "convex"])
def test_mesh_collider_is_the_mesh_or_its_hull(tmp_path, shape):
    """The mesh of CORNERS at half its size; the hull is the tetrahedron of 1/6 m3, whose half has an eighth of that."""
    cup = {"name": "cup", "mesh": 0, "scale": [0.5] * 3}
    cup["physics"] = {"motion": {"type": "dynamic"}, "collider": {"shape": 0}}
    body = scene_of(tmp_path, gltf_document([cup], [{"type": shape, shape: {"mesh": 0}}], "OMI")).bodies["cup"]
    assert np.abs(body.mesh.vertices - 0.5 * CORNERS.astype(np.float64)).max() <= 1e-9
    (collider,) = body.colliders
    expected = body.mesh.volume if shape == "trimesh" else 1 / 6 / 8
    assert collider.volume == pytest.approx(expected, rel=1e-9)
    assert body.mesh.volume < 0.99 * 1 / 6 / 8, "the mesh has a hollow"


@pytest.mark.parametrize(
    ("kind", "collider", "shapes", "expected"),
    [
        pytest.param("KHR", {"geometry": {"mesh": 0}}, [], CORNERS, id="KHR names a mesh"),
        # A node outside the scene stands for its mesh and all below it, without its own place.
        pytest.param("KHR", {"geometry": {"node": 1}}, [], CORNERS * 2.0 + [0, 1, 0], id="KHR names a node"),
        pytest.param("OMI", {"shape": 0}, [{"type": "trimesh", "trimesh": {"mesh": 0}}], CORNERS, id="OMI"),
    ],
)
def test_gltf_collider_may_use_a_mesh_outside_the_scene(tmp_path, kind, collider, shapes, expected):
    """The cup, node 0, has no mesh of its own: its collider names mesh 0, or node 1, which the scene does not list.

    Node 1 has a child 1 m above, with mesh 0 at twice its size.
    """
    nodes = [
        {"name": "cup", "translation": [5, 0, 0], "physics": {"motion": {}, "collider": collider}},
        {"name": "solid", "translation": [9, 9, 9], "children": [2]},
        {"name": "half", "translation": [0, 1, 0], "scale": [2, 2, 2], "mesh": 0},
    ]
    content = gltf_document(nodes, shapes, kind)
    content["scenes"] = [{"nodes": [0]}]
    scene = scene_of(tmp_path, content)
    assert scene.left_out == () and [*scene.bodies] == ["cup"]
    assert np.abs(scene.bodies["cup"].mesh.vertices - expected).max() <= 1e-9


def filtered_collider(filter_number):
    """A collider with the ball of shape 0 and a filter of the document; ``None``: without a filter."""
    collision_filter = {} if filter_number is None else {"collisionFilter": filter_number}
    return {"collider": {"geometry": {"shape": 0}, **collision_filter}}


NO_COLLISION_WITHIN_HAND = {"collisionSystems": ["hand"], "notCollideWithSystems": ["hand"]}
"""A filter whose colliders are of the system "hand", which does not collide with itself."""


def test_gltf_bodies_with_equal_names_get_their_parents_prefix(tmp_path):
    """Two nodes "cup" hang on left and right. A filter excludes their pair, which has the new names as well."""
    cups = [{"name": "cup", "physics": {"motion": {}, **filtered_collider(0)}} for _ in range(2)]
    nodes = [{"name": "left", "children": [2]}, {"name": "right", "children": [3]}, *cups]
    filters = [NO_COLLISION_WITHIN_HAND]
    scene = scene_of(tmp_path, gltf_document(nodes, [{"type": "sphere"}], "KHR", collisionFilters=filters))
    assert [*scene.bodies] == [body.name for body in scene.bodies.values()] == ["left/cup", "right/cup"]
    assert scene.excluded == (("left/cup", "right/cup"),)
    assert "'left/cup' for 'cup'" in scene.notes[0]


def test_gltf_nodes_outside_the_scene_are_no_bodies(tmp_path):
    """The document has the nodes of a glass and a table; its scene lists the glass alone."""
    content = glass_document("KHR")
    content["scenes"] = [{"nodes": [GLASS]}]
    assert [*scene_of(tmp_path, content).bodies] == ["glass"]


def collider_with_ends(folder, shape, radius_bottom, radius_top):
    """The solid of a cylinder or capsule along y with these radii and 1 m between the middles of its ends."""
    round_shape = {"type": shape, shape: {"height": 1.0, "radiusBottom": radius_bottom, "radiusTop": radius_top}}
    nodes = [{"name": "cone", "physics": {"motion": {}, **collider_of_shape("KHR")}}]
    (solid,) = scene_of(folder, gltf_document(nodes, [round_shape], "KHR")).bodies["cone"].colliders
    return solid


@pytest.mark.parametrize(
    ("shape", "lowest_y"),
    [
        pytest.param("cylinder", -0.5, id="cylinder: a flat end"),
        pytest.param("capsule", -0.5 - 0.2, id="capsule: a ball at its end"),
    ],
)
def test_cone_ends_in_a_point(tmp_path, shape, lowest_y):
    """Ends of radius 0.2 m below and 0 above, with 1 m between them: from y = -0.5 m, or its ball, to 0.5 m."""
    solid = collider_with_ends(tmp_path, shape, radius_bottom=0.2, radius_top=0.0)
    assert np.abs(solid.bounds - [[-0.2, lowest_y, -0.2], [0.2, 0.5, 0.2]]).max() <= 1e-9


@pytest.mark.parametrize("kind", ["KHR", "OMI"])
@pytest.mark.parametrize("collides", [False, True])
def test_jointed_gltf_bodies_collide_only_if_the_joint_enables(tmp_path, kind, collides):
    """Arm and hand have a ball each; the node "wrist", below the arm, is a joint with the hand.

    Their pair is excluded unless the joint enables its collision; the joint itself is listed as not taken.
    """
    joint = {"connectedNode": 1, "joint": 0, "enableCollision": collides}
    nodes = [
        {"name": "arm", "children": [2], "physics": {"motion": {}, **collider_of_shape(kind)}},
        {"name": "hand", "physics": {"motion": {}, **collider_of_shape(kind)}},
        {"name": "wrist"},
    ]
    content = gltf_document(nodes, [{"type": "sphere"}], kind)
    wrist = content["nodes"][2]
    wrist["extensions"] = (
        {"KHR_physics_rigid_bodies": {"joint": joint}} if kind == "KHR" else {"OMI_physics_joint": joint}
    )
    scene = scene_of(tmp_path, content)
    assert scene.excluded == (() if collides else (("arm", "hand"),))
    assert scene.left_out == ("the joint of node 'wrist'",)


def test_unfiltered_collider_of_a_body_meets_everything(tmp_path):
    """Colliders of system "hand" do not meet each other; the palm, which is the hand's second collider, has no filter.

    So hand and glass meet in part, which is listed and excludes nothing.
    """
    nodes = [
        {"name": "hand", "physics": {"motion": {}, **filtered_collider(0)}, "children": [1]},
        {"name": "palm", "physics": filtered_collider(None)},
        {"name": "glass", "physics": {"motion": {}, **filtered_collider(0)}},
    ]
    filters = [NO_COLLISION_WITHIN_HAND]
    scene = scene_of(tmp_path, gltf_document(nodes, [{"type": "sphere"}], "KHR", collisionFilters=filters))
    assert scene.excluded == ()
    assert "'hand' and 'glass' meet and others not" in scene.left_out[0]


@pytest.mark.parametrize("limit", ["MOST_BODIES", "MOST_FACES"])
def test_scene_that_places_too_much_is_refused(tmp_path, monkeypatch, limit):
    """Four nodes of a glass and a table have physics; at most two such nodes, or two faces, may be placed."""
    monkeypatch.setattr(f"sessions.scene_formats.scene_source.{limit}", 2)
    with pytest.raises(SceneSourceError, match="the scene places more than"):
        scene_of(tmp_path, glass_document("KHR"))


def test_repeated_gltf_buffers_count_towards_the_size_limit(tmp_path, monkeypatch):
    """A file of 96 bytes, within the limit of 300, is named by four buffers, which together exceed it."""
    monkeypatch.setattr("sessions.scene_formats.gltf_physics.MOST_FILE_BYTES", 300)
    content, data = glass_document("KHR"), CORNERS.tobytes() + FACES.tobytes()
    assert len(data) == 96
    (tmp_path / "data.bin").write_bytes(data)
    content["buffers"] = [{"byteLength": len(data), "uri": "data.bin"}] * 4
    (tmp_path / "s.gltf").write_text(json.dumps(content))
    with pytest.raises(SceneSourceError, match=r"the buffers of .* have more than"):
        read_scene_source(tmp_path / "s.gltf")


def test_collision_filters_exclude_pairs(tmp_path):
    """Thumb and index are of the system "hand", which does not collide with itself; the glass is of another."""
    filter_of_body = {"thumb": 0, "index": 0, "glass": 1}
    nodes = [
        {"name": name, "physics": {"motion": {}, **filtered_collider(number)}}
        for name, number in filter_of_body.items()
    ]
    filters = [NO_COLLISION_WITHIN_HAND, {"collisionSystems": ["glass"]}]
    scene = scene_of(tmp_path, gltf_document(nodes, [{"type": "sphere"}], "KHR", collisionFilters=filters))
    assert scene.excluded == (("thumb", "index"),)


def test_unsupported_gltf_shapes_triggers_and_joints_are_listed(tmp_path):
    """A cup is drawn as a mesh and has a plane as its collider and a joint; a zone only triggers.

    The cup is a body by its mesh; collider, trigger and joint are listed as not taken.
    """
    nodes = [
        {"name": "cup", "mesh": 0, "physics": {"motion": {}, **collider_of_shape("KHR"), "joint": {}}},
        {"name": "zone", "physics": {"trigger": {"geometry": {"shape": 0}}}},
    ]
    scene = scene_of(tmp_path, gltf_document(nodes, [{"type": "plane"}], "KHR"))
    assert [*scene.bodies] == ["cup"]
    assert scene.left_out == (
        "the collider of node 'cup': a shape 'plane'",
        "the trigger of node 'zone'",
        "the joint of node 'cup'",
    )


def test_tapered_ends_make_a_hull(tmp_path):
    """Balls of 0.2 m below and of 0.1 m above, 1 m between their middles: from y = -0.5 - 0.2 to 0.5 + 0.1 m."""
    solid = collider_with_ends(tmp_path, "capsule", radius_bottom=0.2, radius_top=0.1)
    assert np.abs(solid.bounds - [[-0.2, -0.7, -0.2], [0.2, 0.6, 0.2]]).max() <= 1e-9


@pytest.fixture
def gltf_beside_a_buffer(tmp_path):
    """Returns the path of a glTF in a folder with its buffer, data.bin, which it names by a given address.

    A copy of the buffer, secret.bin, stands outside the folder.
    """
    folder = tmp_path / "scene"
    folder.mkdir()
    data = CORNERS.tobytes() + FACES.tobytes()
    (folder / "data.bin").write_bytes(data)
    (tmp_path / "secret.bin").write_bytes(data)

    def gltf_with_buffer(uri):
        content = glass_document("KHR")
        content["buffers"][0]["uri"] = uri
        (folder / "glass.gltf").write_text(json.dumps(content))
        return folder / "glass.gltf"

    return gltf_with_buffer


def test_gltf_buffer_beside_the_file_is_read(gltf_beside_a_buffer):
    """A glTF of a glass and a table names the file of its corners and faces data.bin, in its own folder."""
    assert [*read_scene_source(gltf_beside_a_buffer("data.bin")).bodies] == ["glass", "table"]


@pytest.mark.parametrize(
    ("uri", "refusal"),
    [
        pytest.param("..%2Fsecret.bin", "lies outside", id="a folder above, escaped"),
        pytest.param("https://a/b.bin", "by an address", id="another machine"),
        pytest.param("file:/etc/passwd", "by an address", id="a file by its address"),
    ],
)
def test_gltf_buffers_must_lie_in_its_own_folder(gltf_beside_a_buffer, uri, refusal):
    """A glTF names the file of its corners and faces by ``uri``; only a file in its own folder may be read."""
    with pytest.raises(SceneSourceError, match=refusal):
        read_scene_source(gltf_beside_a_buffer(uri))


@pytest.mark.parametrize(
    ("content", "refusal"),
    [
        pytest.param({"nodes": [{"name": "a"}], "scenes": [{"nodes": [0]}]}, "has no physics", id="no physics"),
        pytest.param(
            {"extensionsUsed": ["OMI_collider"], "nodes": []}, "extension OMI_collider is", id="outdated extension"
        ),
        pytest.param(
            {"nodes": [{"extensions": {"OMI_physics_body": {"trigger": {}}}}]},
            "no body that collides; not taken: the trigger of node 'node 0'",
            id="only a trigger",
        ),
        pytest.param(
            {"nodes": [{"children": [1]}, {}, {"children": [1]}]}, "hangs on two others", id="node with two parents"
        ),
    ],
)
def test_gltf_that_gives_no_scene_is_refused_with_the_reason(tmp_path, content, refusal):
    """A file without a body that collides, in an older extension, or that is no tree of nodes.

    ``content``: all of the file beside its version.
    """
    with pytest.raises(SceneSourceError, match=refusal):
        scene_of(tmp_path, {"asset": {"version": "2.0"}, **content})


@pytest.mark.parametrize(
    ("physics", "moves"),
    [
        pytest.param({"motion": {}}, True, id="an empty motion"),
        pytest.param({"motion": {"isKinematic": True}}, True, id="kinematic"),
        pytest.param({"motion": {"type": "dynamic"}}, True, id="dynamic"),
        pytest.param({"motion": {"type": "static"}}, False, id="static"),
        pytest.param({}, False, id="no motion"),
    ],
)
@pytest.mark.parametrize("kind", ["KHR", "OMI"])
def test_body_with_a_motion_moves_even_by_defaults_alone(tmp_path, kind, physics, moves):
    """A cup has a box as its collider, and ``physics`` beside it: it moves if it has a motion that is not static."""
    cup = {"name": "cup", "physics": {**physics, **collider_of_shape(kind)}}
    assert scene_of(tmp_path, gltf_document([cup], [{"type": "box"}], kind)).bodies["cup"].moves is moves


def test_collider_without_a_shape_is_named(tmp_path):
    """The cup is drawn as a mesh; its collider names neither a shape nor that mesh, and is listed as not taken."""
    cup = {"name": "cup", "mesh": 0, "physics": {"motion": {}, "collider": {}}}
    scene = scene_of(tmp_path, gltf_document([cup], [], "KHR"))
    assert scene.left_out == ("the collider of node 'cup': it names no shape with a triangle",)
