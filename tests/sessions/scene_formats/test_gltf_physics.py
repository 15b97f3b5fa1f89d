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
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 4], [2, 3, 4], [3, 1, 4]], dtype=np.uint16)


def gltf_document(nodes, shapes, kind, **more):
    """A glTF of nodes with physics of KHR or OMI."""
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


def write_glb(path, content):
    """The path of a GLB file with this content."""
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    path.write_bytes(struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A) + text)
    return path


def glass_document(kind):
    """A body of three shapes: one of its own node, one on a child that is moved, one on a scaled grandchild."""
    shapes = [
        {"type": "box", "box": {"size": [0.2, 0.4, 0.6]}},
        {"type": "capsule", "capsule": {"height": 0.3, "radiusBottom": 0.1, "radiusTop": 0.1}},
        {"type": "sphere", "sphere": {"radius": 0.5}},
    ]

    def collider(shape):
        return {"collider": {"geometry": {"shape": shape}} if kind == "KHR" else {"shape": shape}}

    nodes = [
        {"name": "glass", "translation": [1, 2, 3], "rotation": ROTATION.as_quat().tolist(), "children": [1, 2],
         "physics": {"motion": {"mass": 0.2, "type": "dynamic"}, **collider(0)}},
        {"name": "stem", "translation": [0, -1, 0], "physics": collider(1)},
        {"name": "rim", "children": [3], "translation": [0, 1, 0]},
        {"name": "bead", "scale": [2, 2, 2], "physics": collider(2)},
        {"name": "table", "translation": [0, -1, 0], "physics": collider(0)},
    ]  # fmt: skip
    return gltf_document(nodes, shapes, kind)


@pytest.mark.parametrize("kind", ["KHR", "OMI"])
def test_shapes_of_a_gltf_compound_are_in_body_axes(tmp_path, kind):
    """A box on the body's node, a capsule on a moved child, a ball of radius 0.5 doubled by its grandchild's scale."""
    scene = read_scene_source(write_glb(tmp_path / "glass.glb", glass_document(kind)))
    body = scene.bodies["glass"]
    assert [*scene.bodies] == ["glass", "table"] and body.moves and not scene.bodies["table"].moves
    assert body.mass == 0.2 and len(body.colliders) == 3
    assert np.abs(body.pose[:3, :3] - ROTATION.as_matrix()).max() <= 1e-9 and body.pose[:3, 3].tolist() == [1, 2, 3]
    bounds = [np.abs(solid.bounds - expected).max() for solid, expected in zip(body.colliders, (
        [[-0.1, -0.2, -0.3], [0.1, 0.2, 0.3]],
        [[-0.1, -1.25, -0.1], [0.1, -0.75, 0.1]],
        [[-1, 0, -1], [1, 2, 1]],
    ), strict=True)]  # fmt: skip
    assert max(bounds) <= 1e-9
    assert np.array_equal(scene.rotation, np.eye(3))  # glTF has +Y up


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
    """A quaternion with norm 0.99998 rotates by 90 degrees about x and changes no length; one of norm 0 is refused.

    The capsule below y = 0, 0.3 m between its ends and of radius 0.1 m, then lies along z: from -0.25 to 0.25 m.
    """
    content = glass_document("KHR")
    content["nodes"][0]["rotation"] = ROTATION.as_quat().astype(np.float32).tolist()
    content["nodes"][1]["rotation"] = [0.7071, 0, 0, 0.7071]
    body = read_scene_source(write_glb(tmp_path / "glass.glb", content)).bodies["glass"]
    assert np.abs(body.pose[:3, :3] @ body.pose[:3, :3].T - np.eye(3)).max() <= 1e-12
    expected = [[-0.1, -1.1, -0.25], [0.1, -0.9, 0.25]]
    assert np.abs(body.colliders[1].bounds - expected).max() <= 1e-9
    content["nodes"][1]["rotation"] = [0, 0, 0, 0]
    with pytest.raises(SceneSourceError, match="rotation without length"):
        read_scene_source(write_glb(tmp_path / "glass.glb", content))


@pytest.mark.parametrize("is_hull", [False, True])
def test_mesh_collider_is_the_mesh_or_its_hull(tmp_path, is_hull):
    """Half the size is an eighth of the volume; the hull of the corners is a tetrahedron of 1/6."""
    shape = {"type": "convex" if is_hull else "trimesh", "convex": {"mesh": 0}, "trimesh": {"mesh": 0}}
    nodes = [
        {
            "name": "cup",
            "mesh": 0,
            "scale": [0.5] * 3,
            "physics": {"motion": {"type": "dynamic"}, "collider": {"shape": 0}},
        }
    ]
    body = read_scene_source(write_glb(tmp_path / "cup.glb", gltf_document(nodes, [shape], "OMI"))).bodies["cup"]
    assert np.abs(body.mesh.vertices - 0.5 * CORNERS.astype(np.float64)).max() <= 1e-9
    assert body.colliders[0].volume == pytest.approx((1 / 6 if is_hull else body.mesh.volume * 8) / 8, rel=1e-9)


def collider_of_mesh(geometry, **more):
    """The only collider of a scene, with its own spelling of a mesh and further nodes."""
    return [{"name": "cup", "translation": [5, 0, 0], "physics": {"motion": {}, "collider": geometry}}, *more["nodes"]]


@pytest.mark.parametrize("kind", ["KHR mesh", "KHR node", "OMI"])
def test_gltf_collider_may_use_a_mesh_outside_the_scene(tmp_path, kind):
    """It names the mesh or a node of its own, by either of two extensions."""
    if kind == "OMI":
        nodes, shapes = collider_of_mesh({"shape": 0}, nodes=[]), [{"type": "trimesh", "trimesh": {"mesh": 0}}]
    elif kind == "KHR mesh":
        nodes, shapes = collider_of_mesh({"geometry": {"mesh": 0}}, nodes=[]), []
    else:
        # A node outside the scene stands for its mesh and all below it, without its own place.
        away = {"name": "solid", "translation": [9, 9, 9], "children": [2]}
        inner = {"name": "half", "translation": [0, 1, 0], "scale": [2, 2, 2], "mesh": 0}
        nodes, shapes = collider_of_mesh({"geometry": {"node": 1}}, nodes=[away, inner]), []
    content = gltf_document(nodes, shapes, kind[:3])
    content["scenes"] = [{"nodes": [0]}]
    scene = read_scene_source(write_glb(tmp_path / "s.glb", content))
    expected = CORNERS * 2.0 + [0, 1, 0] if kind == "KHR node" else CORNERS
    assert scene.left_out == () and [*scene.bodies] == ["cup"]
    assert np.abs(scene.bodies["cup"].mesh.vertices - expected).max() <= 1e-9


def test_gltf_bodies_with_equal_names_get_their_parents_prefix(tmp_path):
    """Two nodes "cup" hang on left and right. A filter excludes their pair, which has the new names as well."""
    cup = {"name": "cup", "physics": {"motion": {}, "collider": {"geometry": {"shape": 0}}}}
    filters = [{"collisionSystems": ["a"], "notCollideWithSystems": ["a"]}]
    for node in (left := json.loads(json.dumps(cup))), (right := json.loads(json.dumps(cup))):
        node["physics"]["collider"]["collisionFilter"] = 0
    nodes = [{"name": "left", "children": [2]}, {"name": "right", "children": [3]}, left, right]
    content = gltf_document(nodes, [{"type": "sphere"}], "KHR", collisionFilters=filters)
    scene = read_scene_source(write_glb(tmp_path / "s.glb", content))
    assert [*scene.bodies] == [body.name for body in scene.bodies.values()] == ["left/cup", "right/cup"]
    assert scene.excluded == (("left/cup", "right/cup"),) and "'left/cup' for 'cup'" in scene.notes[0]


def test_gltf_nodes_outside_the_scene_are_no_bodies(tmp_path):
    """The document's scene lists the glass, node 0, and no table."""
    content = glass_document("KHR")
    content["scenes"] = [{"nodes": [0]}]
    assert [*read_scene_source(write_glb(tmp_path / "s.glb", content)).bodies] == ["glass"]


@pytest.mark.parametrize("word", ["cylinder", "capsule"])
def test_cone_ends_in_a_point(tmp_path, word):
    """A height of 1 m between the ends; a capsule adds the ball of its lower radius, 0.2 m."""
    shape = {"type": word, word: {"height": 1.0, "radiusBottom": 0.2, "radiusTop": 0.0}}
    nodes = [{"name": "cone", "physics": {"motion": {}, "collider": {"geometry": {"shape": 0}}}}]
    solid = (
        read_scene_source(write_glb(tmp_path / "s.glb", gltf_document(nodes, [shape], "KHR")))
        .bodies["cone"]
        .colliders[0]
    )
    lowest = -0.5 if word == "cylinder" else -0.7
    assert np.abs(solid.bounds - [[-0.2, lowest, -0.2], [0.2, 0.5, 0.2]]).max() <= 1e-9


@pytest.mark.parametrize("kind", ["KHR", "OMI"])
@pytest.mark.parametrize("collides", [False, True])
def test_jointed_gltf_bodies_collide_only_if_the_joint_enables(tmp_path, kind, collides):
    """Arm and hand have a sphere each, and node 2, below the arm, is a joint with the hand."""
    joint = {"connectedNode": 1, "joint": 0, "enableCollision": collides}
    collider = {"geometry": {"shape": 0}} if kind == "KHR" else {"shape": 0}
    nodes = [
        {"name": name, "physics": {"motion": {}, "collider": dict(collider)}, "children": children}
        for name, children in (("arm", [2]), ("hand", []))
    ]
    content = gltf_document([*nodes, {"name": "wrist"}], [{"type": "sphere"}], kind)
    content["nodes"][2]["extensions"] = (
        {"KHR_physics_rigid_bodies": {"joint": joint}} if kind == "KHR" else {"OMI_physics_joint": joint}
    )
    scene = read_scene_source(write_glb(tmp_path / "s.glb", content))
    assert scene.excluded == (() if collides else (("arm", "hand"),))
    assert scene.left_out == ("the joint of node 'wrist'",)


def test_unfiltered_collider_of_a_body_meets_everything(tmp_path):
    """Colliders of system "hand" do not meet each other; the palm, which is the hand's second collider, has no filter.

    So hand and glass meet in part, which is listed and excludes nothing.
    """

    def collider(row):
        more = {} if row is None else {"collisionFilter": row}
        return {"collider": {"geometry": {"shape": 0}, **more}}

    nodes = [
        {"name": "hand", "physics": {"motion": {}, **collider(0)}, "children": [1]},
        {"name": "palm", "physics": collider(None)},
        {"name": "glass", "physics": {"motion": {}, **collider(0)}},
    ]
    filters = [{"collisionSystems": ["hand"], "notCollideWithSystems": ["hand"]}]
    scene = read_scene_source(
        write_glb(tmp_path / "s.glb", gltf_document(nodes, [{"type": "sphere"}], "KHR", collisionFilters=filters))
    )
    assert scene.excluded == () and "'hand' and 'glass' meet and others not" in scene.left_out[0]


@pytest.mark.parametrize("limit", ["MOST_BODIES", "MOST_FACES"])
def test_scene_that_places_too_much_is_refused(tmp_path, monkeypatch, limit):
    """The limit of bodies, or of faces, is lowered to 2."""
    monkeypatch.setattr(f"sessions.scene_formats.scene_source.{limit}", 2)
    with pytest.raises(SceneSourceError, match="the scene places more than"):
        read_scene_source(write_glb(tmp_path / "s.glb", glass_document("KHR")))


def test_repeated_gltf_buffers_count_towards_the_size_limit(tmp_path, monkeypatch):
    """One file within the limit of 300 bytes is named by four buffers, which together exceed it."""
    monkeypatch.setattr("sessions.scene_formats.gltf_physics.MOST_FILE_BYTES", 300)
    content, data = glass_document("KHR"), CORNERS.tobytes() + FACES.tobytes()
    (tmp_path / "data.bin").write_bytes(data)
    content["buffers"] = [{"byteLength": len(data), "uri": "data.bin"}] * 4
    (tmp_path / "s.gltf").write_text(json.dumps(content))
    with pytest.raises(SceneSourceError, match=r"the buffers of .* have more than"):
        read_scene_source(tmp_path / "s.gltf")


def test_collision_filters_exclude_pairs(tmp_path):
    """Thumb and index are of a system that does not collide with itself; the glass is of another."""

    def part(name, row):
        return {"name": name, "physics": {"motion": {}, "collider": {"geometry": {"shape": 0}, "collisionFilter": row}}}

    filters = [
        {"collisionSystems": ["hand"], "notCollideWithSystems": ["hand"]},
        {"collisionSystems": ["glass"]},
    ]
    nodes = [part("thumb", 0), part("index", 0), part("glass", 1)]
    shapes = [{"type": "sphere", "sphere": {"radius": 0.1}}]
    scene = read_scene_source(
        write_glb(tmp_path / "s.glb", gltf_document(nodes, shapes, "KHR", collisionFilters=filters))
    )
    assert scene.excluded == (("thumb", "index"),)


def test_unsupported_gltf_shapes_triggers_and_joints_are_listed(tmp_path):
    """A cup with a mesh, a collider that is a plane and a joint, and a zone that only triggers."""
    nodes = [
        {"name": "cup", "mesh": 0, "physics": {"motion": {}, "collider": {"geometry": {"shape": 0}}, "joint": {}}},
        {"name": "zone", "physics": {"trigger": {"geometry": {"shape": 0}}}},
    ]
    scene = read_scene_source(write_glb(tmp_path / "s.glb", gltf_document(nodes, [{"type": "plane"}], "KHR")))
    assert [*scene.bodies] == ["cup"]
    assert scene.left_out == (
        "the collider of node 'cup': a shape 'plane'",
        "the trigger of node 'zone'",
        "the joint of node 'cup'",
    )


def test_tapered_ends_make_a_hull(tmp_path):
    """Balls of 0.2 and 0.1 m about points 1 m apart: from -0.7 to 0.6 m."""
    shape = {"type": "capsule", "capsule": {"height": 1.0, "radiusBottom": 0.2, "radiusTop": 0.1}}
    nodes = [{"name": "cone", "physics": {"motion": {}, "collider": {"geometry": {"shape": 0}}}}]
    solid = (
        read_scene_source(write_glb(tmp_path / "s.glb", gltf_document(nodes, [shape], "KHR")))
        .bodies["cone"]
        .colliders[0]
    )
    assert np.abs(solid.bounds - [[-0.2, -0.7, -0.2], [0.2, 0.6, 0.2]]).max() <= 1e-9


def test_gltf_buffers_must_lie_in_its_own_folder(tmp_path):
    """``uri``: by which the file names its buffer."""
    content = glass_document("KHR")
    (tmp_path / "scene").mkdir()
    data = CORNERS.tobytes() + FACES.tobytes()
    (tmp_path / "scene" / "data.bin").write_bytes(data)
    (tmp_path / "secret.bin").write_bytes(data)
    path = tmp_path / "scene" / "glass.gltf"
    for uri, refusal in (
        ("data.bin", ""),
        ("..%2Fsecret.bin", "lies outside"),
        ("https://a/b.bin", "by an address"),
        ("file:/etc/passwd", "by an address"),
    ):
        content["buffers"][0]["uri"] = uri
        path.write_text(json.dumps(content))
        if refusal:
            with pytest.raises(SceneSourceError, match=refusal):
                read_scene_source(path)
        else:
            assert [*read_scene_source(path).bodies] == ["glass", "table"]


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
    """``content`` is all of the file beside its version."""
    with pytest.raises(SceneSourceError, match=refusal):
        read_scene_source(write_glb(tmp_path / "s.glb", {"asset": {"version": "2.0"}, **content}))


@pytest.mark.parametrize(
    ("physics", "moves"),
    [
        ({"motion": {}}, True),
        ({"motion": {"isKinematic": True}}, True),
        ({"motion": {"type": "dynamic"}}, True),
        ({"motion": {"type": "static"}}, False),
        ({}, False),
    ],
)
@pytest.mark.parametrize("kind", ["KHR", "OMI"])
def test_body_with_a_motion_moves_even_by_defaults_alone(tmp_path, kind, physics, moves):
    """``physics``: of a body with a box. An empty motion is that of a moving body; a static one or none is not."""
    collider = {"collider": {"geometry": {"shape": 0}} if kind == "KHR" else {"shape": 0}}
    content = gltf_document([{"name": "cup", "physics": {**physics, **collider}}], [{"type": "box"}], kind)
    assert read_scene_source(write_glb(tmp_path / "s.glb", content)).bodies["cup"].moves is moves


def test_collider_without_a_shape_is_named(tmp_path):
    """The cup's collider names no shape; the cup is drawn as a mesh."""
    nodes = [{"name": "cup", "mesh": 0, "physics": {"motion": {}, "collider": {}}}]
    scene = read_scene_source(write_glb(tmp_path / "s.glb", gltf_document(nodes, [], "KHR")))
    assert scene.left_out == ("the collider of node 'cup': it names no shape with a triangle",)
