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

pytestmark = pytest.mark.usefixtures("few_depth_frames")


def imported(folder, convention, kind, exported=False, **options):
    """A written scene of tool and plate, imported."""
    write_scene(folder, convention, kind, exported=exported)
    meshes = {name: folder / f"{name}.{kind}" for name in ("tool", "plate")}
    return import_session("csv", folder / "take.csv", mapping=folder / "map.toml", meshes=meshes, **options)


@pytest.mark.sampled(10)
@pytest.mark.parametrize(
    ("convention", "kind", "exported"),
    [*product(("ros", "unity"), ("glb", "stl"), (False, True)), ("unreal", "glb", True), ("z-up", "stl", False)],
)
def test_questions_decided_by_samples_agree_with_a_full_replay(tmp_path, convention, kind, exported):
    """Samples may decide that a guess makes a difference, makes none, or leave it open (``None``)."""
    session = imported(tmp_path, convention, kind, exported)
    requested = {question.assumption for question in examine_assumptions(session).questions}
    decided = {row: alternatives_differ(session, row) for row in open_rows(session)}
    assert decided
    for row, differs in decided.items():
        assert differs is None or differs == (row in requested), row


def test_samples_alone_show_that_axes_of_ros_meshes_matter(tmp_path):
    """The answer is yes, no, or ``None``: only a replay can tell."""
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
    """Rods of 0.3 m stand 5 m apart."""
    session, row = bodies_at_rest([[0, 0, 0], [5, 0, 0]], ROD_ALONG_Y)
    assert alternatives_differ(session, row) is False


def test_rods_within_reach_whose_boxes_never_overlap_are_decided():
    """Centres 0.28 m apart, in reach of rods of 0.3 m; but 0.2 m beside each other, be they along x or along y."""
    session, row = bodies_at_rest([[0, 0, 0], [0.2, 0.2, 0]], ROD_ALONG_X)
    assert alternatives_differ(session, row) is False


def test_rods_that_meet_only_unrotated_decide_the_question():
    """0.1 m apart along x, rods of 0.3 m along x overlap; as glTF both lie along y, and are apart."""
    session, row = bodies_at_rest([[0, 0, 0], [0.1, 0, 0]], ROD_ALONG_X)
    assert alternatives_differ(session, row) is True


def test_coinciding_boxes_touch_whatever_the_open_guess_is(monkeypatch):
    """Cubes about one point meet, rotated or not: both readings give contact, so they do not differ."""
    monkeypatch.setattr(sampled_contacts, "FEW_FRAMES", 0)  # a few frames are asked first
    session, row = bodies_at_rest([[0, 0, 0], [0, 0, 0]], box((0.3, 0.3, 0.3)))
    assert alternatives_differ(session, row) is False


def crossing(contact_frame, frames=3000):
    """Two rods, one above the other: 0.5 m, and 0.25 m in one frame, in which they meet if they stand, as in glTF."""
    positions = np.zeros((2, frames, 3))
    positions[1] = (0.0, 0.25, 0.5)
    positions[1, contact_frame] = (0.0, 0.0, 0.25)
    row = Assumption(
        Subject.MESH_AXES, "body", Origin.GUESS, Confidence.OPEN, bodies=("a", "b"), alternatives=("body", "gltf")
    )
    facts = {ASSUMPTIONS_FACT: assumptions_fact([Assumption(Subject.POSE_AXES, "ros", Origin.USER), row])}
    bodies = {name: (positions[number], [[0.0, 0.0, 0.0, 1.0]] * frames) for number, name in enumerate("ab")}
    return Session.from_arrays(np.arange(frames) * 11, bodies, dict.fromkeys("ab", ROD_ALONG_Y), facts=facts), row


def decided_and_replayed(session, row):
    """The decision without kernels, and that of a replay of every alternative."""
    replayed = any(question.assumption == row for question in examine_assumptions(session).questions)
    return alternatives_differ(session, row), replayed


@pytest.mark.parametrize("distance", [0.1, 0.5])
def test_bodies_with_parents_and_offsets_are_decided_where_they_stand(distance):
    """Rods whose middles are 0.1 m from each other meet, 0.5 m from each other they do not."""
    session, row = bodies_at_rest([[0, 0, 0], [0, 0, 0]], ROD_ALONG_X)
    bodies = (SceneBody("a"), SceneBody("b", parent="a", offset=Pose((distance, 0.0, 0.0))))
    session = replace(session, scene=replace(session.scene, bodies=bodies, pairs=(("a", "b"),)))
    decided, replayed = decided_and_replayed(session, row)
    assert decided is replayed is (distance == 0.1)


def test_bodies_that_never_move_make_no_pair():
    """Two rods at rest in a scene that names no pair: of all pairs, those that rest are left out."""
    session, row = bodies_at_rest([[0, 0, 0], [0.1, 0, 0]], ROD_ALONG_X)
    assert alternatives_differ(replace(session, scene=Scene()), row) is False


def test_fixed_bodies_are_decided_where_they_stand():
    """A rod fixed 0.25 m along y overlaps one of 0.3 m along y, and is beside it where both stand, as in glTF."""
    session, row = bodies_at_rest([[0, 0, 0], [5, 0, 0]], ROD_ALONG_Y)
    table = SceneBody("table", fixed=Pose((0.0, 0.25, 0.0)))
    scene = replace(session.scene, bodies=(table,), pairs=(("a", "table"),))
    meshes = {**session.meshes, "table": session.meshes["a"]}
    session = replace(session, scene=scene, meshes=meshes)
    decided, replayed = decided_and_replayed(session, row)
    assert decided is replayed is True


def test_bodies_without_a_common_frame_are_decided_at_filled_frames():
    """Stamps of b lie 4 ns after those of a; a replay of the whole recording agrees."""
    session, row = bodies_at_rest([[0, 0, 0], [0, 0.25, 0]], ROD_ALONG_Y)
    early, late = session.tracks.values()
    later = Track(late.times_ns + 4, late.positions, late.quaternions_xyzw)
    session = Session.from_tracks(
        {"a": early, "b": later}, meshes=session.meshes, scene=session.scene, facts=session.facts
    )
    decided, replayed = decided_and_replayed(session, row)
    assert decided is replayed is True


def test_contact_of_a_single_frame_between_samples_is_found():
    """Frame 1237 of 3000, under one reading; a replay of both tells the same."""
    session, row = crossing(contact_frame=1237)
    assert alternatives_differ(session, row) == any(
        question.assumption == row for question in examine_assumptions(session).questions
    )
    assert alternatives_differ(session, row) is True


@pytest.mark.parametrize(("convention", "kind"), [("openxr", "obj"), ("openvr", "stl"), ("gltf", "obj")])
def test_axes_of_openxr_leave_no_guess_open(tmp_path, convention, kind):
    """OpenXR, OpenVR and glTF have one set of axes: every reading turns a mesh alike."""
    assert open_rows(imported(tmp_path, convention, kind)) == []
