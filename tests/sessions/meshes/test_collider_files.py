"""Colliders as engines ship them: a node each, in the body's frame, kept in the session file."""

import json
import re
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh
from support.small_worlds import unit_cubes_on_x

from replay import guide
from sessions import read_session, recover, write_session
from sessions.errors import MeshFileError
from sessions.importers import import_session
from sessions.importers.ledger import ledger_of
from sessions.mesh_data import has_consistent_winding
from sessions.meshes.mesh_match import read_colliders
from sessions.model.assumption import Confidence, Origin, Subject, assumptions_of
from sessions.scene_files.scene_meshes import checked_scene, with_colliders


def translation(*at):
    """A translation as 4x4 matrix."""
    return trimesh.transformations.translation_matrix(at)


def write_glb(path, *nodes, body=None):
    """Writes a GLB of nodes (name, solid, pose); colliders of "a" hang on a node "a" where ``body`` is its pose."""
    scene = trimesh.Scene()
    if body is not None:
        scene.graph.update(frame_to="a", frame_from="world", matrix=body)
    for name, solid, pose in nodes:
        parent = None if body is None or not name.startswith(("UCX_a", "UBX_a", "rim")) else "a"
        scene.add_geometry(solid, node_name=name, geom_name=name, transform=pose, parent_node_name=parent)
    path.write_bytes(scene.export(file_type="glb"))
    return path


BOX, BALL = trimesh.creation.box((0.2, 0.2, 0.2)), trimesh.creation.icosphere(subdivisions=2, radius=0.1)
RING = trimesh.creation.annulus(0.1, 0.2, 0.1)


def test_convex_colliders_become_hulls_and_match_their_body(tmp_path):
    """Nodes are named after their body, with Unreal's prefixes: UBX for a box, UCX for a hull, USP for a sphere.

    A box of 0.2 m around x = 0.5 m has 0.008 m3 and begins at 0.4 m; the hull of a ring has no hole; a ball with a
    radius of 0.1 m around y = 1 m ends at 1.1 m.
    """
    file = write_glb(
        tmp_path / "c.glb",
        ("UBX_a_00", BOX, translation(0.5, 0, 0)),
        ("UCX_a_01", RING, translation(0, 0, 0)),
        ("USP_b", BALL, translation(0, 1, 0)),
        ("UCX_lamp_01", BALL, translation(0, 0, 0)),
    )
    colliders = read_colliders(file, ["a", "b"])
    assert colliders.sentence == "colliders of c.glb: a 2, b 1 (of no body: UCX_lamp_01)"
    box, disc = colliders.solids["a"]
    (ball,) = colliders.solids["b"]
    assert box.volume == pytest.approx(0.008, rel=1e-5)
    assert box.bounds[0, 0] == pytest.approx(0.4, abs=1e-6)
    assert disc.volume == pytest.approx(RING.convex_hull.volume, rel=1e-5)
    assert has_consistent_winding(disc)
    assert ball.bounds[1, 1] == pytest.approx(1.1, abs=1e-6)


def test_colliders_below_a_body_node_use_its_frame_and_scale(tmp_path):
    """The body's node scales by a half: a box of 0.2 m around 0.5 m is a box of 0.1 m around 0.25 m.

    The node also moves and rotates, which does not count. A node without a prefix below it is a collider with its hole;
    it is 0.1 m high around z = 1 m.
    """
    pose = (
        translation(3, 2, 1) @ trimesh.transformations.rotation_matrix(0.7, [1, 2, 3]) @ np.diag([0.5, 0.5, 0.5, 1.0])
    )
    file = write_glb(
        tmp_path / "c.glb", ("UBX_a_00", BOX, translation(0.5, 0, 0)), ("rim", RING, translation(0, 0, 1)), body=pose
    )
    box, rim = read_colliders(file, ["a"]).solids["a"]
    assert np.allclose(box.bounds, [[0.2, -0.05, -0.05], [0.3, 0.05, 0.05]], atol=1e-6)
    assert rim.volume == pytest.approx(RING.volume / 8, rel=1e-4)
    assert np.allclose(rim.bounds[:, 2], [0.475, 0.525], atol=1e-6)


def test_drawn_mesh_beside_ucx_colliders_is_not_a_collider(tmp_path):
    """The node of the body's name is drawn, and a box beside it is its collider, as Unreal's importer takes a file."""
    pose = translation(0, 0, 0)
    colliders = read_colliders(write_glb(tmp_path / "c.glb", ("a", RING, pose), ("UCX_a_00", BOX, pose)), ["a"])
    (box,) = colliders.solids["a"]
    assert box.volume == pytest.approx(0.008, rel=1e-5)
    assert colliders.sentence == "colliders of c.glb: a 1 (drawn beside them: a)"


def test_mesh_of_a_body_without_other_colliders_is_its_collider(tmp_path):
    """The only node has the body's name and no prefix; it is a ring and keeps its hole."""
    file = write_glb(tmp_path / "d.glb", ("a", RING, translation(0, 0, 0)))
    (ring,) = read_colliders(file, ["a"]).solids["a"]
    assert ring.volume == pytest.approx(RING.volume, rel=1e-4)


def two_moving_cubes():
    """A session of two cubes, in five frames; "a" moves 1 m along X a frame."""
    return unit_cubes_on_x({"a": range(5), "b": [9] * 5})


def test_session_file_keeps_colliders_also_after_recover(tmp_path):
    """Twelve boxes are the colliders of the body "a"; "b" has none. A file is written, and copied by its recovery."""
    write_glb(tmp_path / "c.glb", *((f"UBX_a_{k:02d}", BOX, translation(k, 0, 0)) for k in range(12)))
    session = with_colliders(two_moving_cubes(), tmp_path, "c.glb")
    assert session.facts["conversions"] == "colliders of c.glb: a 12"
    write_session(session, tmp_path / "s.mcap")
    recover(tmp_path / "s.mcap", tmp_path / "recovered.mcap")
    for name in ("s.mcap", "recovered.mcap"):
        session_of_file = read_session(tmp_path / name)
        assert [*session_of_file.colliders] == ["a"], name
        assert "b" in session_of_file.meshes, name
        for solid, expected in zip(session_of_file.colliders["a"], session.colliders["a"], strict=True):
            assert np.array_equal(solid.vertices, expected.vertices), name


@pytest.mark.parametrize(
    ("key", "bodies_with_colliders"),
    [
        pytest.param('[scene]\ncolliders = "c.glb"\n', ["b"], id="the scene names a file"),
        pytest.param("", ["a"], id="the scene names none"),
    ],
)
def test_colliders_named_by_a_scene_replace_recorded_colliders(tmp_path, key, bodies_with_colliders):
    """The session file has colliders of "a"; the file c.glb, which a scene may name, has a collider of "b"."""
    write_glb(tmp_path / "c.glb", ("UCX_b_00", BALL, translation(0, 0, 0)))
    write_glb(tmp_path / "old.glb", ("UCX_a_00", BOX, translation(0, 0, 0)))
    write_session(with_colliders(two_moving_cubes(), tmp_path, "old.glb"), tmp_path / "s.mcap")
    (tmp_path / "x.toml").write_text(f'{key}[[body]]\nid = "a"\n')
    session = read_session(tmp_path / "s.mcap", scene=tmp_path / "x.toml")
    assert [*session.colliders] == bodies_with_colliders


@pytest.mark.parametrize(
    ("file", "faults"),
    [
        pytest.param("c.glb", [], id="of a body that may be tracked"),
        pytest.param("d.glb", [r"x.toml: \[scene\]: .*does not exist"], id="no file"),
    ],
)
def test_colliders_file_of_a_scene_is_checked(tmp_path, file, faults):
    """The scene declares the body "a" and names a file of colliders; c.glb has one of "b", which may be tracked."""
    write_glb(tmp_path / "c.glb", ("UCX_b_00", BALL, translation(0, 0, 0)))
    text = f'[scene]\ncolliders = "{file}"\n[[body]]\nid = "a"\n'
    no_effects = lambda *_: ()  # noqa: E731
    _scene, _meshes, problems = checked_scene(text, "x.toml", no_effects, tmp_path)
    for problem, fault in zip(problems, faults, strict=True):
        assert re.match(fault, problem)


def filled_template(template, values):
    """The text that the script makes of an interpolated string: ``{{`` is a brace, ``{word}`` a value."""
    return re.sub(r"{{|}}|{([^{}]+)}", lambda result: str(values[result[1]]) if result[1] else result[0][0], template)


def test_colliders_of_the_unity_script_use_recording_axes(tmp_path):
    """The product's C# script for Unity writes a GLB; here its own templates are filled with values by hand.

    A box of 0.2 m around z = 0.5 m in Unity is around -0.5 m in glTF, with its faces outwards.
    """
    script = (Path(guide.__file__).parent / "VrLabColliders.cs").read_text("utf-8")
    inside_unity = np.add(BOX.vertices, (0, 0, 0.5))
    signs = [float(f"{sign}1") for sign, _ in re.findall(r"writer.Write\((-?)p\.([xyz])\)", script)]
    corners = [int(number or 0) for number in re.findall(r"writer.Write\(faces\[k(?: \+ (\d))?\]\)", script)]
    points = (inside_unity * signs).astype("<f4").tobytes()
    indices = BOX.faces[:, corners].astype("<u4").tobytes()
    values = {
        "start": 0, "middle": len(points), "middle - start": len(points), "data.Length - middle": len(indices),
        "first": 0, "first + 1": 1, "points.Length": 8, "faces.Length": 36, "meshes.Count - 1": 0,
        "kind": "UTM", "name": "cup", "number:D2": "00", "data.Length": len(points + indices),
    }  # fmt: skip
    rows = {"views": [], "accessors": [], "meshes": [], "nodes": []}
    for name, template in re.findall(r'(\w+)\.Add\(Invariant\(\$"(.*)"\)\);', script):
        rows[name].append(json.loads(filled_template(template.replace('\\"', '"'), values)))
    tree = rows | {"bufferViews": rows.pop("views"), "buffers": [{"byteLength": len(points + indices)}]}
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<IIIII", 0x46546C67, 2, 28 + len(text + points + indices), len(text), 0x4E4F534A)
    binary = struct.pack("<II", len(points + indices), 0x004E4942) + points + indices
    (tmp_path / "colliders.glb").write_bytes(head + text + binary)
    (box,) = read_colliders(tmp_path / "colliders.glb", ["cup"]).solids["cup"]
    assert np.allclose(box.bounds, [[-0.1, -0.1, -0.6], [0.1, 0.1, -0.4]])
    assert box.volume == pytest.approx(0.008)  # 0.2 m cubed; negative where faces look inwards


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("none.glb", "does not exist; check the path"),
        ("text.glb", "does not begin as a GLB"),
        ("torn.glb", "cut short; export it again"),
        ("other.glb", "no collider of a, b; name its nodes UCX_BODY_01"),
    ],
)
def test_file_without_colliders_is_refused_in_a_sentence(name, message, tmp_path):
    """The bodies are a and b; other.glb has a collider of a body c, and torn.glb is its first 200 bytes."""
    (tmp_path / "text.glb").write_bytes(b"no mesh")
    whole = write_glb(tmp_path / "other.glb", ("UCX_c_00", BALL, translation(0, 0, 0))).read_bytes()
    (tmp_path / "torn.glb").write_bytes(whole[:200])
    with pytest.raises(MeshFileError, match=message):
        read_colliders(tmp_path / name, ["a", "b"])


def test_an_import_accounts_for_every_node_of_its_colliders(tmp_path):
    """Three nodes of a file are colliders, of which UCX_floor_00 is of no recorded body; the node "cup" is drawn.

    The ledger of the import has a third of the colliders as a large loss.
    """
    nodes = ("UCX_cup_00", BOX), ("UBX_cup_01", BOX), ("UCX_floor_00", BALL), ("cup", RING)
    write_glb(tmp_path / "c.glb", *((name, solid, translation(0, 0, 0)) for name, solid in nodes))
    head = "kind,time,body,px,py,pz,qx,qy,qz,qw,tracked,other,value"
    (tmp_path / "take.csv").write_text(f"{head}\npose,0,cup,0,0,0,0,0,0,1,1,,\n")
    session = import_session("csv", tmp_path / "take.csv", convention="openxr", colliders=tmp_path / "c.glb")
    assert len(session.colliders["cup"]) == 2
    (entry,) = [entry for entry in ledger_of(session.facts) if entry.kind == "nodes"]
    assert (entry.read, entry.kept) == (3, 2)
    assert entry.dropped == {"that belong to no body: UCX_floor_00": 1}
    assert entry.is_large_loss


@pytest.mark.parametrize(
    ("convention", "axes", "is_open", "origin"),
    [
        pytest.param("openxr", "", False, Origin.GUESS, id="poses in glTF's axes"),
        pytest.param("unity", "", True, Origin.GUESS, id="poses in Unity's axes"),
        pytest.param("unity", "canonical", False, Origin.USER, id="the user says it"),
    ],
)
def test_axes_of_colliders_are_open_where_several_are_possible(convention, axes, is_open, origin, tmp_path):
    """A GLB of colliders may be in glTF's axes or those of the poses; ``axes``: what the user says of it, if anything.

    Where these are the same no question is open.
    """
    write_glb(tmp_path / "c.glb", ("UCX_cup_00", BOX, translation(0, 0, 0)))
    head = "kind,time,body,px,py,pz,qx,qy,qz,qw,tracked,other,value"
    (tmp_path / "take.csv").write_text(f"{head}\npose,0,cup,0,0,0,0,0,0,1,1,,\n")
    options = {"colliders": tmp_path / "c.glb", "collider_axes": axes}
    session = import_session("csv", tmp_path / "take.csv", convention=convention, **options)
    (row,) = [row for row in assumptions_of(session.facts) if row.subject is Subject.COLLIDER_AXES]
    assert (row.confidence is Confidence.OPEN) == is_open
    assert row.origin is origin
