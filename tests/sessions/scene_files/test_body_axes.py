from itertools import product

import numpy as np
import pytest
import trimesh

from sessions.mesh_data import MeshData
from sessions.meshes.conventions import CONVENTIONS
from sessions.meshes.mesh_axes import MESH_ROTATIONS
from sessions.model.assumption import (
    ASSUMPTIONS_FACT,
    Assumption,
    Confidence,
    Origin,
    Subject,
    assumptions_fact,
    assumptions_of,
)
from sessions.model.scene import Scene, SceneBody
from sessions.scene_files.body_axes import (
    axes_assumption,
    axes_change,
    from_body_axes,
    grouped_assumptions,
    in_body_axes,
    scene_meshes_in_body_axes,
)

NAMES = ("body", "gltf", *MESH_ROTATIONS, *CONVENTIONS)


def mesh(*size):
    """A box of this size."""
    box = trimesh.creation.box(size)
    return MeshData(np.asarray(box.vertices), np.asarray(box.faces))


def test_a_mesh_comes_back_from_body_axes_bit_by_bit():
    """A box is read by each name of axes beside poses of each convention, and written back; its faces stay outwards."""
    tool = mesh(0.1, 0.2, 0.3)
    for name, poses in product(NAMES, CONVENTIONS.values()):
        read = in_body_axes(tool, name, poses)
        assert read.volume == pytest.approx(tool.volume), (name, poses)  # negative where faces look inwards
        assert np.array_equal(from_body_axes(read, name, poses).vertices, tool.vertices), (name, poses)


def test_a_change_of_axes_is_the_mesh_read_again():
    """A box was read by some axes beside poses of Unity; a user says other axes of it, and ROS's of the poses.

    The change of axes gives the vertices that reading its file anew would give.
    """
    tool, unity, ros = mesh(0.1, 0.2, 0.3), CONVENTIONS["unity"], CONVENTIONS["ros"]
    for before, after in product(NAMES, NAMES):
        changed = in_body_axes(tool, before, unity).transformed(axes_change(before, unity, after, ros))
        assert np.array_equal(changed.vertices, in_body_axes(tool, after, ros).vertices), (before, after)


def test_files_of_one_type_have_a_common_row():
    """Axes of mesh files are assumed: the files cup.obj and rod.obj make one assumption, jar.glb another."""
    poses = CONVENTIONS["ros"]
    rows = [axes_assumption(body=name, file=f"{name}.obj", stated="", poses=poses) for name in ("cup", "rod")]
    rows.append(axes_assumption(body="jar", file="jar.glb", stated="", poses=poses))
    grouped = grouped_assumptions(rows)
    assert [(row.bodies, row.files) for row in grouped] == [
        (("cup", "rod"), ("cup.obj", "rod.obj")),
        (("jar",), ("jar.glb",)),
    ]


Y_UP = ("canonical", "godot", "openvr", "openxr", "webxr", "aframe", "gltf")
"""Conventions in which a mesh has the same axes, whatever its file or exporter means."""


@pytest.mark.parametrize("file", ["cup.obj", "cup.glb"])
def test_unstated_axes_are_a_guess_where_readings_differ(file):
    """Nobody says the axes of a cup's file beside poses in axes that differ from glTF's: a guess among several."""
    for name in CONVENTIONS.keys() - Y_UP:
        row = axes_assumption(body="cup", file=file, stated="", poses=CONVENTIONS[name])
        assert (row.origin, row.confidence) == (Origin.GUESS, Confidence.OPEN), name
        assert row.reason.startswith(("OBJ files say", "usual for GLB files")), name
        assert len(row.alternatives) > 1, name


@pytest.mark.parametrize("file", ["cup.obj", "cup.glb"])
def test_unstated_axes_are_sure_where_readings_agree(file):
    """Poses in axes as glTF's leave a single reading of a cup's file: whatever its axes are called, they are those."""
    for name in Y_UP:
        row = axes_assumption(body="cup", file=file, stated="", poses=CONVENTIONS[name])
        assert (row.origin, row.confidence) == (Origin.FORMAT, Confidence.SURE), name
        assert row.reason == "all axes it may have are those of the recording", name
        assert len(row.alternatives) == 1, name


def test_stated_axes_are_the_users_and_sure():
    """The user says "body", the axes of the poses, of a cup's OBJ file, beside poses of each convention."""
    for name, poses in CONVENTIONS.items():
        row = axes_assumption(body="cup", file="cup.obj", stated="body", poses=poses)
        assert (row.value, row.origin, row.confidence, row.reason) == ("body", Origin.USER, Confidence.SURE, ""), name


def test_new_mesh_drops_what_was_assumed_of_the_old():
    """A recording has assumptions on axes: of the rod's file, of the cup's and the jar's in common, of a collider.

    A scene gives the cup a new file: what was assumed of its old file is dropped, and only rows on the new are added.
    The scene's bench has a recorded mesh without a file, and its lid a file that gave no mesh.
    """
    poses = CONVENTIONS["canonical"]
    collider_axes = Assumption(Subject.COLLIDER_AXES, "canonical", Origin.GUESS, bodies=("cup",), files=("c.glb",))
    rod_axes = axes_assumption("rod", "rod.glb", "", poses)
    shared = grouped_assumptions([axes_assumption(name, f"{name}.obj", "", poses) for name in ("cup", "jar")])
    facts = {ASSUMPTIONS_FACT: assumptions_fact([collider_axes, rod_axes, *shared])}
    bodies = (SceneBody("cup", mesh="new.obj", mesh_axes="body"), SceneBody("bench"), SceneBody("lid", mesh="lid.obj"))
    meshes = {"cup": mesh(0.1, 0.2, 0.3), "bench": mesh(1.0, 1.0, 1.0)}
    _, changed = scene_meshes_in_body_axes(Scene(bodies=bodies), meshes, facts)
    of_collider, of_rod, of_jar, *added = assumptions_of(changed)
    assert of_collider == collider_axes
    assert of_rod == rod_axes
    assert of_jar.bodies == ("jar",)
    assert {(row.bodies, row.files) for row in added} == {(("cup",), ("new.obj",))}
