from itertools import product

import fcl
import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation
from support.planted_sessions import TO_SOURCE, write_scene

from replay.advice.assumptions import examine_assumptions
from replay.advice.open_guesses import open_rows
from replay.advice.sampled_contacts import alternatives_differ, faces_cross
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


def imported(folder, convention, kind, exported=False, **options):
    write_scene(folder, convention, kind, exported=exported)
    meshes = {name: folder / f"{name}.{kind}" for name in ("tool", "plate")}
    return import_session("csv", folder / "take.csv", mapping=folder / "map.toml", meshes=meshes, **options)


@pytest.mark.parametrize(
    ("convention", "kind", "exported"), [*product(("ros", "unity", "unreal", "z-up"), ("glb", "stl"), (False, True))]
)
def test_samples_decide_only_what_a_full_replay_decides(tmp_path, convention, kind, exported):
    session = imported(tmp_path, convention, kind, exported)
    requested = {question.assumption for question in examine_assumptions(session).questions}
    decided = {row: alternatives_differ(session, row) for row in open_rows(session)}
    for row, differs in decided.items():
        assert differs is None or differs == (row in requested), row


def test_wrong_guess_of_ros_meshes_is_decided_without_replay(tmp_path):
    session = imported(tmp_path, "ros", "glb")
    assert [alternatives_differ(session, row) for row in open_rows(session)] == [True]


def still(positions, mesh, value="body", alternatives=("body", "gltf")):
    """Two bodies of one mesh at these places, in ROS axes, with an open question on the mesh."""
    rotation = [[0.0, 0.0, 0.0, 1.0]] * 3
    row = Assumption(
        Subject.MESH_AXES, value, Origin.GUESS, Confidence.OPEN, bodies=("a", "b"), alternatives=alternatives
    )
    poses = Assumption(Subject.POSE_AXES, "ros", Origin.USER)
    bodies = {name: ([position] * 3, rotation) for name, position in zip("ab", positions, strict=True)}
    facts = {ASSUMPTIONS_FACT: assumptions_fact([poses, row])}
    return Session.from_arrays([0, 11, 22], bodies, dict.fromkeys("ab", mesh), facts=facts), row


def test_bodies_beyond_reach_have_contacts_under_no_alternative():
    rod = trimesh.creation.box((0.02, 0.3, 0.02))
    session, row = still([[0, 0, 0], [5, 0, 0]], (rod.vertices, rod.faces))
    assert alternatives_differ(session, row) is False


def test_rods_within_reach_whose_boxes_never_overlap_are_decided():
    rod = trimesh.creation.box((0.3, 0.02, 0.03))
    session, row = still([[0, 0, 0], [0.2, 0.2, 0]], (rod.vertices, rod.faces))
    assert alternatives_differ(session, row) is False


def test_rods_that_meet_only_when_rotated_decide_the_question():
    rod = trimesh.creation.box((0.3, 0.02, 0.03))
    session, row = still([[0, 0, 0], [0.1, 0, 0]], (rod.vertices, rod.faces))
    assert alternatives_differ(session, row) is True


def test_a_body_that_may_be_inside_another_is_left_undecided():
    outer = trimesh.creation.box((0.3, 0.3, 0.3))
    session, row = still([[0, 0, 0], [0, 0, 0]], (outer.vertices, outer.faces))
    assert alternatives_differ(session, row) is None


@pytest.mark.parametrize("seed", range(60))
def test_faces_cross_where_fcl_finds_a_contact(seed):
    rng = np.random.default_rng(seed)
    meshes = [trimesh.creation.icosphere(2, 0.1), trimesh.creation.box((0.3, 0.02, 0.1))]
    position, rotation = rng.uniform(-0.2, 0.2, 3), Rotation.random(random_state=seed)
    models = []
    for mesh in meshes:
        model = fcl.BVHModel()
        model.beginModel(len(mesh.vertices), len(mesh.faces))
        model.addSubModel(mesh.vertices, mesh.faces)
        model.endModel()
        models.append(model)
    objects = [
        fcl.CollisionObject(models[0]),
        fcl.CollisionObject(models[1], fcl.Transform(rotation.as_matrix(), position)),
    ]
    contact = fcl.collide(*objects, fcl.CollisionRequest(), fcl.CollisionResult()) > 0
    second = rotation.apply(meshes[1].vertices) + position
    assert faces_cross(meshes[0].triangles, second[meshes[1].faces]) == contact


def test_conventions_without_an_open_row_are_not_tested(tmp_path):
    assert set(TO_SOURCE) >= {"openxr"}
    assert open_rows(imported(tmp_path, "openxr", "obj")) == []
