"""Whether a guess of an import changes contacts, by few sampled frames, against a replay of each alternative."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import trimesh
from support.planted_sessions import write_scene

from replay.advice import sampled_contacts
from replay.advice.assumptions import examine_assumptions
from replay.advice.open_guesses import open_rows
from replay.advice.sampled_contacts import alternatives_differ
from sessions import Session
from sessions.importers import import_session
from sessions.model.assumption import (
    ASSUMPTIONS_FACT,
    Assumption,
    Confidence,
    Origin,
    Subject,
    assumptions_fact,
)
from sessions.model.scene import Pose, Scene, SceneBody
from sessions.model.session import Track

pytestmark = pytest.mark.usefixtures("few_depth_frames", "few_surface_points")


def imported(folder, convention, kind, exported=False, **options):
    """A written scene of tool and plate in a program's axes, with meshes of this kind, imported."""
    write_scene(folder, convention, kind, exported=exported)
    meshes = {name: folder / f"{name}.{kind}" for name in ("tool", "plate")}
    return import_session("csv", folder / "take.csv", mapping=folder / "map.toml", meshes=meshes, **options)


@pytest.mark.sampled(10)
@pytest.mark.parametrize(
    ("convention", "kind", "exported"),
    [*product(("ros", "unity"), ("glb", "stl"), (False, True)), ("unreal", "glb", True), ("z-up", "stl", False)],
)
def test_questions_decided_by_samples_agree_with_a_full_replay(tmp_path, convention, kind, exported):
    """A scene of tool and plate in a program's axes; mesh files (``kind``) may be written by its own exporter.

    Each open guess of its import is asked about if its alternatives have different contacts, by a replay of each.
    Samples of few frames decide the same (True, False), or leave it open (None).
    """
    session = imported(tmp_path, convention, kind, exported)
    replayed = {question.assumption for question in examine_assumptions(session).questions}
    guesses = open_rows(session)
    assert guesses
    for guess in guesses:
        assert alternatives_differ(session, guess) in (None, guess in replayed), guess


def test_samples_alone_show_that_axes_of_ros_meshes_matter(tmp_path):
    """Poses in axes of ROS and GLB files, whose meshes may be in glTF's axes or in those of the poses.

    The answer is yes (True), not that only a replay can tell (None).
    """
    session = imported(tmp_path, "ros", "glb")
    (guess,) = open_rows(session)
    assert guess.subject is Subject.MESH_AXES
    assert alternatives_differ(session, guess) is True


def box(sizes):
    """Vertices and faces of a box about the origin."""
    mesh = trimesh.creation.box(sizes)
    return mesh.vertices, mesh.faces


# Metres. Read as glTF, whose x, y and z are y, z and x of ROS, a mesh turns: a rod along x lies along y, one along y
# stands along z.
ROD_ALONG_X = box((0.3, 0.02, 0.03))
ROD_ALONG_Y = box((0.02, 0.3, 0.02))


def bodies_at_rest(positions, mesh, value="body", alternatives=("body", "gltf")):
    """Two bodies of one mesh at rest, in ROS axes, and the open question: is the mesh in those axes or in glTF's?"""
    rotation = [[0.0, 0.0, 0.0, 1.0]] * 3
    row = Assumption(
        Subject.MESH_AXES, value, Origin.GUESS, Confidence.OPEN, bodies=("a", "b"), alternatives=alternatives
    )
    poses = Assumption(Subject.POSE_AXES, "ros", Origin.USER)
    bodies = {name: ([position] * 3, rotation) for name, position in zip("ab", positions, strict=True)}
    facts = {ASSUMPTIONS_FACT: assumptions_fact([poses, row])}
    scene = Scene(pairs=(("a", "b"),))
    return Session.from_arrays([0, 11, 22], bodies, dict.fromkeys("ab", mesh), scene, facts=facts), row


def test_bodies_beyond_reach_have_contacts_under_no_alternative():
    """Rods of 0.3 m stand 5 m apart: no contact, whether a mesh is in the axes of the poses or in glTF's."""
    session, guess = bodies_at_rest([[0, 0, 0], [5, 0, 0]], ROD_ALONG_Y)
    assert alternatives_differ(session, guess) is False


def test_rods_within_reach_whose_boxes_never_overlap_are_decided():
    """Two rods of 0.3 m along x, or along y if their mesh is in glTF's axes; middles 0.2 m apart both in x and in y.

    That is 0.28 m, within reach of each other, but they lie 0.2 m beside each other in either case.
    """
    session, guess = bodies_at_rest([[0, 0, 0], [0.2, 0.2, 0]], ROD_ALONG_X)
    assert alternatives_differ(session, guess) is False


def test_rods_that_meet_only_unrotated_decide_the_question():
    """Two rods of 0.3 m along x, or along y if their mesh is in glTF's axes; middles 0.1 m apart in x.

    Along x they overlap, along y they are apart.
    """
    session, guess = bodies_at_rest([[0, 0, 0], [0.1, 0, 0]], ROD_ALONG_X)
    assert alternatives_differ(session, guess) is True


def test_coinciding_boxes_touch_whatever_the_open_guess_is(monkeypatch):
    """Cubes about one point meet, whether their mesh is in the axes of the poses or in glTF's: the guess is harmless.

    Usually a few frames are tried first, which would decide it; here none are.
    """
    monkeypatch.setattr(sampled_contacts, "FEW_FRAMES", 0)
    session, guess = bodies_at_rest([[0, 0, 0], [0, 0, 0]], box((0.3, 0.3, 0.3)))
    assert alternatives_differ(session, guess) is False


def crossing_rods(contact_frame, frames=3000):
    """Two rods, one above the other: 0.5 m, and 0.25 m in one frame, in which they meet if they stand, as in glTF."""
    positions = np.zeros((2, frames, 3))
    positions[1] = (0.0, 0.25, 0.5)
    positions[1, contact_frame] = (0.0, 0.0, 0.25)
    guess = Assumption(
        Subject.MESH_AXES, "body", Origin.GUESS, Confidence.OPEN, bodies=("a", "b"), alternatives=("body", "gltf")
    )
    facts = {ASSUMPTIONS_FACT: assumptions_fact([Assumption(Subject.POSE_AXES, "ros", Origin.USER), guess])}
    bodies = {name: (positions[number], [[0.0, 0.0, 0.0, 1.0]] * frames) for number, name in enumerate("ab")}
    return Session.from_arrays(np.arange(frames) * 11, bodies, dict.fromkeys("ab", ROD_ALONG_Y), facts=facts), guess


def differs_by_replay(session, guess):
    """Whether alternatives of a guess have different contacts, by a replay of each."""
    return any(question.assumption == guess for question in examine_assumptions(session).questions)


@pytest.mark.parametrize(
    ("distance", "differs"), [pytest.param(0.1, True, id="rods that meet"), pytest.param(0.5, False, id="rods apart")]
)
def test_bodies_with_parents_and_offsets_are_decided_where_they_stand(distance, differs):
    """Body b has its pose in the axes of its parent a, and is offset along x by so many metres.

    Rods of 0.3 m along x meet at 0.1 m, not at 0.5 m; along y, if their mesh is in glTF's axes, they never meet.
    """
    session, guess = bodies_at_rest([[0, 0, 0], [0, 0, 0]], ROD_ALONG_X)
    bodies = (SceneBody("a"), SceneBody("b", parent="a", offset=Pose((distance, 0.0, 0.0))))
    session = replace(session, scene=replace(session.scene, bodies=bodies, pairs=(("a", "b"),)))
    assert alternatives_differ(session, guess) is differs
    assert differs_by_replay(session, guess) is differs


def test_bodies_that_never_move_make_no_pair():
    """Two rods at rest, which meet in one reading only; the scene names no pair.

    Then all pairs count but those of two bodies that rest, so there is nothing to differ.
    """
    session, guess = bodies_at_rest([[0, 0, 0], [0.1, 0, 0]], ROD_ALONG_X)
    assert alternatives_differ(replace(session, scene=Scene()), guess) is False


def test_fixed_bodies_are_decided_where_they_stand():
    """A table, a rod of 0.3 m too, is fixed by the scene 0.25 m along y from the rod a.

    Along y they overlap; if their mesh is in glTF's axes they stand, side by side.
    """
    session, guess = bodies_at_rest([[0, 0, 0], [5, 0, 0]], ROD_ALONG_Y)
    table = SceneBody("table", fixed=Pose((0.0, 0.25, 0.0)))
    scene = replace(session.scene, bodies=(table,), pairs=(("a", "table"),))
    meshes = {**session.meshes, "table": session.meshes["a"]}
    session = replace(session, scene=scene, meshes=meshes)
    assert alternatives_differ(session, guess) is True
    assert differs_by_replay(session, guess) is True


def test_bodies_without_a_common_frame_are_decided_at_filled_frames():
    """Two rods of 0.3 m at rest, 0.25 m apart along y, which meet in one reading; stamps of b are 4 ns later.

    No frame has poses of both, so they are filled in between.
    """
    session, guess = bodies_at_rest([[0, 0, 0], [0, 0.25, 0]], ROD_ALONG_Y)
    track_a, track_b = session.tracks.values()
    later = Track(track_b.times_ns + 4, track_b.positions, track_b.quaternions_xyzw)
    session = Session.from_tracks(
        {"a": track_a, "b": later}, meshes=session.meshes, scene=session.scene, facts=session.facts
    )
    assert alternatives_differ(session, guess) is True
    assert differs_by_replay(session, guess) is True


def test_contact_of_a_single_frame_between_samples_is_noticed():
    """Two rods meet in frame 1237 of 3000 alone, and only if they stand, as in glTF's axes; few frames are sampled."""
    session, guess = crossing_rods(contact_frame=1237)
    assert alternatives_differ(session, guess) is True
    assert differs_by_replay(session, guess) is True


@pytest.mark.parametrize(("convention", "kind"), [("openxr", "obj"), ("openvr", "stl"), ("gltf", "obj")])
def test_axes_of_openxr_leave_no_guess_open(tmp_path, convention, kind):
    """Poses in the axes of OpenXR, OpenVR or glTF, which are the same: meshes in those or in glTF's are no question."""
    assert open_rows(imported(tmp_path, convention, kind)) == []
