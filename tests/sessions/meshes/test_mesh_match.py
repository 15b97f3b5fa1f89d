"""Files find their bodies by name, and their unit by size; what was assumed is said."""

import numpy as np
import pytest
import trimesh

from sessions.errors import MeshFileError
from sessions.mesh_data import MeshData
from sessions.meshes.mesh_match import UNITS, guessed_unit, likely_units, match_meshes, possible_units, unit_of_file


def ball_mesh_of_size(size):
    """A ball of this diameter."""
    solid = trimesh.creation.icosphere(subdivisions=1, radius=size / 2)
    return MeshData(solid.vertices, solid.faces)


def write_balls(folder, **sizes):
    """Write a ball of a diameter for each name."""
    for name, size in sizes.items():
        trimesh.creation.icosphere(1, size / 2).export(folder / f"{name}.obj")


@pytest.mark.parametrize(
    ("size", "scale", "text"),
    [
        (0.08, 1.0, ""),
        (4.9, 1.0, ""),
        (8.0, 0.01, "x is 8 units long, taken for cm: 80 mm"),
        (80.0, 0.001, "x is 80 units long, taken for mm: 80 mm"),
        (20.0, 0.01, "taken for cm: 200 mm"),
        (1600.0, 0.001, "taken for mm: 1.6 m"),
        (0.001, 1.0, "x is 1 mm long, taken as it is; if it is drawn in"),
    ],
)
def test_mesh_unit_gives_hand_size_and_is_reported(size, scale, text):
    """The mesh "x" is a ball of ``size`` in an unknown unit: up to 5 these are metres, up to 500 centimetres.

    A note says what was taken, but for metres of a usual size. ``scale``: metres in the unit.
    """
    result, note = guessed_unit(ball_mesh_of_size(size), "x")
    assert result == scale
    assert text in note
    assert (note == "") == (text == "")


@pytest.mark.parametrize(
    ("name", "head", "scale"),
    [
        ("cup.obj", "# File units = inches\n", 0.0254),
        ("cup.obj", "# Units are in Millimeters.\n", 0.001),
        ("cup.obj", "# a unit cube\no units: mm\n", 0.01),
        ("cup.stl", "solid UNITS=mm", 0.001),
        ("cup.ply", "comment unit: ft\n", 0.3048),
    ],
)
def test_unit_that_a_mesh_file_states_wins_over_size(tmp_path, name, head, scale):
    """A file's first line states a unit, or none ("a unit cube"); its ball of 8 units would be taken for centimetres.

    ``scale``: metres in the unit.
    """
    (tmp_path / name).write_text(head)
    metres, *_notes = unit_of_file(ball_mesh_of_size(size=8.0), tmp_path / name, "cup")
    assert metres == scale


def test_folder_is_matched_by_name_and_reported(tmp_path):
    """A folder has balls of these diameters: bodies get those of like names, and one of 8 units is in centimetres.

    Names match but for case, an engine's "(Clone)" and the order of words; a folder or text named "camera" is no mesh.
    """
    write_balls(tmp_path, Beaker_250=8.0, LEFT_hand=0.2, flask=0.1, flask_old=0.1, spare=0.1)
    (tmp_path / "camera.txt").write_text("no mesh")
    (tmp_path / "camera.obj").mkdir()
    matches, notes = match_meshes(tmp_path, ["beaker", "LeftHand(Clone)", "Flask", "camera", "hand", "old spare"])
    assert {name: match.file.name for name, match in matches.items()} == {
        "beaker": "Beaker_250.obj",
        "LeftHand(Clone)": "LEFT_hand.obj",
        "Flask": "flask.obj",
        "hand": "LEFT_hand.obj",
        "old spare": "spare.obj",
    }
    assert notes == ["no mesh is named like: camera"]
    assert matches["Flask"].sentence == "Flask: flask.obj"
    beaker = matches["beaker"]
    assert beaker.sentence == "beaker: Beaker_250.obj; a like name; Beaker_250.obj is 8 units long, taken for cm: 80 mm"
    assert beaker.scale == 0.01
    assert beaker.mesh.bounds[1, 0] == pytest.approx(0.08 / 2, rel=0.05)  # half the diameter of few faces


def test_unit_that_the_user_states_wins_over_size(tmp_path):
    """A flask of 0.1 units would be taken for metres; the user says that all files ("") are in millimetres."""
    write_balls(tmp_path, flask=0.1)
    guessed, _notes = match_meshes(tmp_path, ["flask"])
    stated, _notes = match_meshes(tmp_path, ["flask"], {"": 0.001})
    assert np.array_equal(stated["flask"].mesh.vertices, guessed["flask"].mesh.vertices * 0.001)


def test_body_with_two_matching_mesh_files_gets_neither(tmp_path):
    """Two files are named like the body "glass"; a note says how to choose."""
    write_balls(tmp_path, glass_a=0.1, glass_b=0.1)
    matches, notes = match_meshes(tmp_path, ["glass"])
    assert not matches
    first_note, *_others = notes
    assert first_note == "glass: several are named so: glass_a.obj, glass_b.obj; name one with mesh = FILE in the scene"


@pytest.mark.parametrize("source", ["", "lab.glb"], ids=["the folder", "the file"])
def test_a_glb_of_many_nodes_is_split_among_its_bodies(tmp_path, source):
    """A GLB has balls of 5 cm radius around x = 0, 1 and 2 m, a node each; flask and beaker are named like theirs.

    Each mesh is in its node's frame, where a tracker reports the body, and not around 1 m, where the file has it.
    """
    scene = trimesh.Scene()
    for k, name in enumerate(("Beaker", "Flask", "Shelf")):
        at = trimesh.transformations.translation_matrix([k, 0, 0])
        scene.add_geometry(
            trimesh.creation.icosphere(subdivisions=1, radius=0.05), node_name=name, geom_name=name, transform=at
        )
    (tmp_path / "lab.glb").write_bytes(scene.export(file_type="glb"))
    matches, notes = match_meshes(tmp_path / source, ["flask", "beaker", "rod"])
    assert {name: (match.file.name, match.node) for name, match in matches.items()} == {
        "beaker": ("lab.glb", "Beaker"),
        "flask": ("lab.glb", "Flask"),
    }
    assert np.abs(matches["flask"].mesh.bounds).max() == pytest.approx(0.05, abs=1e-6)
    assert matches["flask"].sentence == "flask: lab.glb, node Flask"
    assert notes == ["no mesh is named like: rod"]


def test_unmatched_and_damaged_files_are_refused_in_a_sentence(tmp_path):
    """A folder is empty, and then has a damaged GLB, which is named itself or is in the folder that is named."""
    with pytest.raises(MeshFileError, match=r"holds no mesh; name a folder of glb, obj"):
        match_meshes(tmp_path, ["a"])
    (tmp_path / "a.glb").write_bytes(b"glTF????")
    with pytest.raises(MeshFileError, match=r"a.glb: this is no readable GLB"):
        match_meshes(tmp_path / "a.glb", ["a"])
    with pytest.raises(MeshFileError, match=r"a.glb: it ends within its header"):
        match_meshes(tmp_path, ["a"])


@pytest.mark.parametrize(
    ("size", "taken", "likely"),
    [
        (0.25, "m", ("m",)),
        (0.8, "m", ("m",)),  # beside other meshes in metres; alone it may be a stopper of 8 mm, in centimetres
        (1.5, "m", ("m", "cm")),
        (4.0, "m", ("m", "cm")),
        (12.0, "cm", ("cm",)),
        (42.0, "cm", ("cm", "mm")),
        (120.0, "mm", ("mm",)),
        (0.0, "m", ("m",)),
    ],
)
def test_likely_units_give_the_mesh_a_hand_held_size(size, taken, likely):
    """``size``: the longest side, in the unit ``taken``. A beaker has 15 cm; a mesh of 1.5 m is ten times as long.

    Likely is another unit if by it the mesh is at most three times as far from 15 cm, as a ratio.
    """
    factor = UNITS[taken]
    mesh = MeshData(np.array([[0, 0, 0], [size, 0, 0], [0, size / 2, 0]]) * factor, [[0, 1, 2]])
    assert likely_units(mesh, taken) == likely


@pytest.mark.parametrize(
    ("size", "taken", "possible"),
    [
        (0.3, "m", ("m",)),
        (0.5, "m", ("m", "cm")),
        (0.89, "m", ("m", "cm")),
        (5.0, "m", ("m", "cm", "mm")),
        (8.0, "cm", ("cm", "mm")),
        (499.0, "cm", ("cm", "mm")),
        (501.0, "mm", ("mm",)),
        (0.0, "m", ("m",)),
    ],
)
def test_possible_units_give_5_mm_to_5_m(size, taken, possible):
    """``size``: the longest side, in the file's unit. The unit ``taken`` stays first, also for a mesh of no size.

    499 units are 4.99 m in centimetres, 501 are too long; 0.3 units are 3 mm in centimetres, too short.
    """
    factor = UNITS[taken]
    mesh = MeshData(np.array([[0, 0, 0], [size, 0, 0], [0, size / 2, 0]]) * factor, [[0, 1, 2]])
    assert possible_units(mesh, taken) == possible
