from dataclasses import replace

import numpy as np
import pytest
import trimesh
from support.planted_sessions import write_scene

from replay.advice.assumptions import chosen_frames
from replay.advice.open_guesses import open_rows
from replay.advice.rereading import SIGNED_PERMUTATIONS, Rereadings, change_of_axes
from replay.advice.scene_outcome import ReplayedBodies
from replay.engine import prepare
from sessions import MeshData
from sessions.importers import import_session
from sessions.model.assumption import Confidence, Origin, Subject
from sessions.model.scene import Pose, Scene, SceneBody
from sessions.scene_files.answers import recording_assumptions, with_answer

pytestmark = pytest.mark.usefixtures("few_depth_frames")


def imported(folder, convention, kind, exported):
    """A written scene of tool and plate, imported."""
    write_scene(folder, convention, kind, exported=exported)
    meshes = {name: folder / f"{name}.{kind}" for name in ("tool", "plate")}
    return import_session("csv", folder / "take.csv", mapping=folder / "map.toml", meshes=meshes)


def with_open_pose_axes(session):
    """The recording as if nobody had said the axes of its poses."""
    from sessions.meshes.conventions import convention, pose_axes_alternatives
    from sessions.model.assumption import ASSUMPTIONS_FACT, assumptions_fact

    rows = []
    for row in recording_assumptions(session):
        if row.subject is Subject.POSE_AXES:
            others = pose_axes_alternatives(convention(row.value))
            row = replace(row, origin=Origin.GUESS, confidence=Confidence.OPEN, alternatives=others)
        rows.append(row)
    return replace(session, facts={**session.facts, ASSUMPTIONS_FACT: assumptions_fact(rows)})


@pytest.mark.parametrize(
    ("convention", "kind", "exported"),
    [
        ("unity", "obj", True),
        pytest.param("unreal", "glb", True, marks=pytest.mark.slow),
        pytest.param("unity", "glb", False, marks=pytest.mark.slow),
        pytest.param("ros", "stl", True, marks=pytest.mark.slow),
    ],
)
def test_every_reading_has_the_contacts_of_a_whole_preparation(tmp_path, convention, kind, exported):
    """A look changes one preparation for each reading; here each is prepared anew as well."""
    session = with_open_pose_axes(imported(tmp_path, convention, kind, exported))
    whole = prepare(session).assembly
    rereadings = Rereadings(session, whole, chosen_frames(len(whole.motion)))
    rows = open_rows(session)
    assert {row.subject for row in rows} == {Subject.POSE_AXES, Subject.MESH_AXES}
    for row in rows:
        for value in row.alternatives:
            changed = session if value == row.value else with_answer(session, row, value)
            quick = rereadings.outcome(changed, row)
            assembly = prepare(changed).assembly
            slow = ReplayedBodies(assembly).outcome(assembly.motion)
            assert np.array_equal(quick.contact, slow.contact), (row.subject, value)
            assert quick.contacts == slow.contacts
            assert quick.deepest == pytest.approx(slow.deepest, abs=0.004)  # an estimate from random points
            assert quick.closest == pytest.approx(slow.closest, abs=1e-6)


def test_offset_of_a_body_is_kept_in_other_pose_axes(tmp_path):
    """Other axes of poses do not move the room alone where a mesh is offset in its tracker's axes."""
    session = with_open_pose_axes(imported(tmp_path, "unity", "obj", exported=True))
    session = replace(session, scene=Scene(bodies=(SceneBody("tool", offset=Pose((0.1, 0.2, 0.3))),)))
    row = next(row for row in open_rows(session) if row.subject is Subject.POSE_AXES)
    whole = prepare(session).assembly
    rereadings = Rereadings(session, whole, np.arange(len(whole.motion)))
    changed = with_answer(session, row, "z-up")
    assembly = prepare(changed).assembly
    slow = ReplayedBodies(assembly).outcome(assembly.motion)
    assert rereadings.outcome(changed, row).closest == pytest.approx(slow.closest, abs=1e-6)


def test_all_48_changes_of_axes_are_recognised():
    """Six orders of axes times eight signs, of a box without symmetry about the origin."""
    box = trimesh.creation.box((0.1, 0.2, 0.3))
    before = MeshData(box.vertices + np.array([0.01, 0.02, 0.03]), box.faces)
    assert len({matrix.tobytes() for matrix in SIGNED_PERMUTATIONS}) == 48
    for matrix in SIGNED_PERMUTATIONS:
        pose = np.eye(4)
        pose[:3, :3] = matrix
        assert np.array_equal(change_of_axes(before, before.transformed(pose)), matrix)
    assert change_of_axes(before, MeshData(before.vertices * 100, before.faces)) is None


def test_symmetric_solid_is_unchanged_in_other_axes():
    """A cup of 24 sides has the same corners after half a turn, in another order and up to rounding."""
    cup = trimesh.creation.cylinder(0.04, 0.1, sections=24)
    half_a_turn = np.diag([-1.0, -1.0, 1.0, 1.0])
    before = MeshData(cup.vertices, cup.faces)
    assert np.array_equal(change_of_axes(before, before.transformed(half_a_turn)), np.eye(3))
