from functools import cache, partial

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation
from support.session_files import write_transforms

from sessions.importers import import_session
from sessions.model.assumption import Origin, Subject
from sessions.scene_files.answers import recording_assumptions, with_answer, with_answers_forgotten
from sessions.scene_files.pose_axes import follows_its_poses

OTHERS = ("canonical", "unity", "unreal", "z-up")


@pytest.fixture(scope="module")
def foxglove_recording(tmp_path_factory):
    """A function that imports a recording of Foxglove's, once with the same options: 12 poses of cup, rod and jar.

    Nobody says its axes. The mesh of the cup is an OBJ, the rod's a GLB, and the jar's an STL.
    """
    folder, rng = tmp_path_factory.mktemp("foxglove"), np.random.default_rng(5)
    for name, kind in (("cup", "obj"), ("rod", "glb"), ("jar", "stl")):
        box = trimesh.creation.box((0.1, 0.2, 0.3))
        box.apply_translation((0.01, 0.02, 0.03))
        (folder / f"{name}.{kind}").write_bytes(
            data.encode() if isinstance(data := box.export(file_type=kind), str) else data
        )
    rows = [
        (name, 10**9 + 11_000_000 * step, rng.normal(size=3), Rotation.random(random_state=step).as_quat())
        for step in range(12)
        for name in ("cup", "rod", "jar")
    ]
    write_transforms(folder / "take.mcap", rows)
    meshes = {"cup": folder / "cup.obj", "rod": folder / "rod.glb", "jar": folder / "jar.stl"}
    return cache(partial(import_session, "mcap", folder / "take.mcap", meshes=meshes))


def axes_of(session):
    """The only assumption about axes of poses."""
    (row,) = [row for row in recording_assumptions(session) if row.subject is Subject.POSE_AXES]
    return row


def mesh_axes(session):
    """Body -> assumed axes of its mesh."""
    rows = [row for row in recording_assumptions(session) if row.subject is Subject.MESH_AXES]
    return {body: row.value for row in rows for body in row.bodies}


def assert_same(first, second):
    """Fails unless two sessions have the same poses, meshes and facts about their conversion."""
    # A unit scales positions and back, which rounds the last bit.
    assert np.allclose(first.frames.position, second.frames.position, rtol=1e-15, atol=0)
    assert np.array_equal(first.frames.quaternion_xyzw, second.frames.quaternion_xyzw)
    for name, mesh in second.meshes.items():
        assert np.array_equal(first.meshes[name].vertices, mesh.vertices), name
        assert np.array_equal(first.meshes[name].faces, mesh.faces), name
    for key in ("source_convention", "handedness", "conversions"):
        assert {*first.facts[key].split("; ")} == {*second.facts[key].split("; ")}, key


@pytest.mark.parametrize("axes", OTHERS)
def test_an_answer_is_the_recording_that_the_option_imports(foxglove_recording, axes):
    """Axes are guessed as ROS's; the user answers ``axes``, or imports again with that convention: the same session."""
    guessed = foxglove_recording()
    row = axes_of(guessed)
    assert (row.value, row.origin, row.is_open) == ("ros", Origin.GUESS, True)
    assert {*row.alternatives} == {"ros", *OTHERS}
    chosen = with_answer(guessed, row, axes)
    option = foxglove_recording(convention=axes)
    assert_same(chosen, option)
    assert mesh_axes(chosen) == mesh_axes(option)


@pytest.mark.parametrize("axes", OTHERS)
def test_forgetting_chosen_axes_restores_poses_and_open_guess(foxglove_recording, axes):
    """Axes are guessed as ROS's; the user answers ``axes`` and takes it back: session and assumptions are as before."""
    guessed = foxglove_recording()
    chosen = with_answer(guessed, axes_of(guessed), axes)
    forgotten, answers_forgotten = with_answers_forgotten(chosen)
    assert answers_forgotten == 1
    assert_same(forgotten, guessed)
    before, after = (
        [(row.subject, row.value, row.origin) for row in recording_assumptions(session)]
        for session in (guessed, forgotten)
    )
    assert after == before
    assert "axes ros (right-handed, +X forward, +Y left, +Z up)" in forgotten.facts["assumed"].split("; ")


def test_forgetting_answers_covers_axes_of_meshes_and_poses(foxglove_recording):
    """The user answers for the axes of the poses and of the rod's mesh, and takes both back."""
    guessed = foxglove_recording()
    chosen = with_answer(guessed, axes_of(guessed), "unity")
    (row,) = [row for row in recording_assumptions(chosen) if row.bodies == ("rod",) and "axes" in row.subject]
    chosen = with_answer(chosen, row, "gltf")
    forgotten, answers_forgotten = with_answers_forgotten(chosen)
    assert answers_forgotten == 2
    assert_same(forgotten, guessed)


def test_meshes_in_the_axes_of_their_bodies_follow_their_poses(foxglove_recording):
    """The axes of the poses were guessed as ROS's; a user answers with each of the others.

    All meshes are said to be in the axes of the poses ("body"), so their vertices are rotated by the same change: no
    body comes nearer to another.
    """
    recording = foxglove_recording(mesh_axes="body")
    for axes in OTHERS:
        assert follows_its_poses(recording, with_answer(recording, axes_of(recording), axes))


def test_mesh_of_a_glb_does_not_follow_its_poses(foxglove_recording):
    """Nobody says the axes of the meshes: the rod's GLB has axes of its own, and some answer leaves it behind."""
    recording = foxglove_recording()
    assert not all(follows_its_poses(recording, with_answer(recording, axes_of(recording), axes)) for axes in OTHERS)


def test_axes_that_an_option_names_have_no_alternative(foxglove_recording):
    """The recording is imported with the option that its axes are z-up."""
    row = axes_of(foxglove_recording(convention="z-up"))
    assert row.origin is Origin.USER
    assert row.alternatives == ()
    assert not row.is_open


def length_unit_of(session):
    """The only assumption about the unit of lengths."""
    (row,) = [row for row in recording_assumptions(session) if row.subject is Subject.LENGTH_UNIT]
    return row


def test_guessed_unit_follows_the_axes(foxglove_recording):
    """Metres are guessed first; in Unreal's axes, once the user says so, lengths are usually in centimetres."""
    guessed = foxglove_recording()
    assert length_unit_of(guessed).alternatives == ("m", "cm", "mm")
    in_axes_of_unreal = with_answer(guessed, axes_of(guessed), "unreal")
    assert length_unit_of(in_axes_of_unreal).alternatives == ("cm", "m", "mm")


def test_stated_unit_does_not_follow_the_axes(foxglove_recording):
    """The user says metres, and then Unreal's axes, whose lengths are usually in centimetres."""
    guessed = foxglove_recording()
    stated = with_answer(guessed, length_unit_of(guessed), "m")
    in_axes_of_unreal = with_answer(stated, axes_of(stated), "unreal")
    assert length_unit_of(in_axes_of_unreal).value == "m"
