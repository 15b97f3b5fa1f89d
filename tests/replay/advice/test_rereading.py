"""Other readings of a recording's axes, each from one preparation, against preparations anew."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from support.planted_sessions import write_scene

from replay.advice import scene_outcome
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
        pytest.param("unity", "obj", True, id="unity, OBJ by its exporter"),
        pytest.param("unreal", "glb", True, id="unreal, GLB by its exporter", marks=pytest.mark.slow),
        pytest.param("unity", "glb", False, id="unity, GLB", marks=pytest.mark.slow),
        pytest.param("ros", "stl", True, id="ros, STL by an exporter", marks=pytest.mark.slow),
    ],
)
def test_every_reading_has_the_contacts_of_a_whole_preparation(tmp_path, monkeypatch, convention, kind, exported):
    """A scene of tool and plate in a program's axes, of which those of poses and those of meshes are open questions.

    Each possible answer is a reading of the recording. ``Rereadings`` changes one preparation for each; here each is
    prepared anew as well, which must give the same contacts, depth and closest gap.
    """
    monkeypatch.setattr(scene_outcome, "DEPTH_FRAMES", 2)  # frames in which a depth is measured: most of the time
    session = with_open_pose_axes(imported(tmp_path, convention, kind, exported))
    prepared = prepare(session).assembly
    rereadings = Rereadings(session, prepared, chosen_frames(len(prepared.motion)))
    questions = open_rows(session)
    assert {question.subject for question in questions} == {Subject.POSE_AXES, Subject.MESH_AXES}
    for question in questions:
        for answer in question.alternatives:
            reading = session if answer == question.value else with_answer(session, question, answer)
            quick = rereadings.outcome(reading, question)
            prepared_anew = prepare(reading).assembly
            slow = ReplayedBodies(prepared_anew).outcome(prepared_anew.motion)
            row = question.subject, answer
            assert np.array_equal(quick.contact, slow.contact), row
            assert quick.contacts == slow.contacts, row
            expected_depth = pytest.approx(slow.deepest, abs=0.004)  # an estimate from random points, metres
            assert quick.deepest == expected_depth, row
            expected_gap = pytest.approx(slow.closest, abs=1e-6)
            assert quick.closest == expected_gap, row


def test_offset_of_a_body_is_kept_in_other_pose_axes(tmp_path):
    """The tool's mesh is offset by 0.1, 0.2 and 0.3 m in the axes of its tracker; poses are Unity's, or may be z-up.

    Then another reading of the poses does more than turn the whole room: the closest gap is that of a preparation anew.
    """
    session = with_open_pose_axes(imported(tmp_path, "unity", "obj", exported=True))
    session = replace(session, scene=Scene(bodies=(SceneBody("tool", offset=Pose((0.1, 0.2, 0.3))),)))
    question = next(row for row in open_rows(session) if row.subject is Subject.POSE_AXES)
    prepared = prepare(session).assembly
    rereadings = Rereadings(session, prepared, np.arange(len(prepared.motion)))
    reading = with_answer(session, question, "z-up")
    prepared_anew = prepare(reading).assembly
    slow = ReplayedBodies(prepared_anew).outcome(prepared_anew.motion)
    assert rereadings.outcome(reading, question).closest == pytest.approx(slow.closest, abs=1e-6)


BOX_WITHOUT_SYMMETRY = trimesh.creation.box((0.1, 0.2, 0.3)).apply_translation((0.01, 0.02, 0.03))


def test_all_48_changes_of_axes_are_recognised():
    """Six orders of axes times eight signs; a box of three lengths, off the origin, is another one in each."""
    before = MeshData(BOX_WITHOUT_SYMMETRY.vertices, BOX_WITHOUT_SYMMETRY.faces)
    assert len({matrix.tobytes() for matrix in SIGNED_PERMUTATIONS}) == 6 * 2**3
    for matrix in SIGNED_PERMUTATIONS:
        change = np.eye(4)
        change[:3, :3] = matrix
        assert np.array_equal(change_of_axes(before, before.transformed(change)), matrix)


def test_change_of_unit_is_no_change_of_axes():
    """A box that is 100 times as large, as centimetres taken for metres: no matrix of axes does that (None)."""
    before = MeshData(BOX_WITHOUT_SYMMETRY.vertices, BOX_WITHOUT_SYMMETRY.faces)
    assert change_of_axes(before, MeshData(before.vertices * 100, before.faces)) is None


def test_symmetric_solid_is_unchanged_in_other_axes():
    """A cylinder of 24 sides about z has the same corners after half a turn about z, in another order.

    They are equal up to rounding, so no change is recognised: the identity.
    """
    cylinder = trimesh.creation.cylinder(0.04, 0.1, sections=24)
    half_rotation = np.diag([-1.0, -1.0, 1.0, 1.0])
    before = MeshData(cylinder.vertices, cylinder.faces)
    assert np.array_equal(change_of_axes(before, before.transformed(half_rotation)), np.eye(3))


def test_solid_with_a_moved_corner_is_another():
    """The middle of the lid of a cup is moved by 1 cm within the lid: the box around the cup stays."""
    cup = trimesh.creation.cylinder(0.04, 0.1, sections=24)
    vertices = cup.vertices.copy()
    (middle,) = np.flatnonzero((np.abs(vertices[:, :2]) < 1e-9).all(axis=1) & (vertices[:, 2] > 0.0))
    vertices[middle, 0] += 0.01
    assert change_of_axes(MeshData(cup.vertices, cup.faces), MeshData(vertices, cup.faces)) is None
