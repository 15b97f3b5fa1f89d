from contextlib import contextmanager
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import trimesh
from support.planted_sessions import (
    FRAMES,
    PLATE,
    TO_SOURCE,
    TOOL,
    box,
    changed,
    true_contact,
    write_mapping,
    write_mesh,
    write_scene,
)
from support.session_files import write_transforms

import replay
from replay.advice.assumptions import assumption_text, examine_assumptions
from replay.advice.sampled_contacts import alternatives_differ
from replay.advice.scene_outcome import outcome_text
from replay.document.headline import doubts
from replay.studies.minimise import minimise
from sessions import Session, read_session, write_session
from sessions.errors import ImportFileError
from sessions.importers import import_session
from sessions.model.assumption import ASSUMPTIONS_FACT, Assumption, Origin, Subject, assumptions_fact
from sessions.scene_files.answers import recording_assumptions, with_answer, with_answers_forgotten

pytestmark = pytest.mark.usefixtures("few_depth_frames")

FORMATS = ("obj", "stl", "ply", "glb")
EVERY_SCENE = [*product(TO_SOURCE, FORMATS, (False, True))]
SAME_AXES = ("openxr", "openvr", "godot", "aframe")
"""Conventions whose axes are those of canonical and gltf."""
QUICK_SCENES = [(name, FORMATS[k % 4], k % 3 == 0) for k, name in enumerate(TO_SOURCE) if name not in SAME_AXES][::2]
SLOW_SCENES = [row for row in EVERY_SCENE if row not in QUICK_SCENES]


def written_scene(folder, convention, kind, exported, **options):
    """The axes of the meshes of a scene that is written, and a function that imports it."""
    axes = write_scene(folder, convention, kind, exported=exported)
    meshes = {name: folder / f"{name}.{kind}" for name in ("tool", "plate")}
    given = {"mapping": folder / "map.toml", "meshes": meshes}
    return axes, lambda **more: import_session("csv", folder / "take.csv", **given, **options, **more)


def assert_contacts_are_true_or_questioned(folder, convention, kind, exported):
    """Fails unless a scene with stated axes has its true contacts, and without, a question that leads to them.

    One alternative of each question must have the true contacts, and a plausible one be that. Where the convention's
    axes are those of the file's format, nothing is to be asked.
    """
    truth = true_contact()
    axes, imported = written_scene(folder, convention, kind, exported)
    decided = examine_assumptions(imported(mesh_axes=axes))
    assert np.array_equal(decided.outcome.contact[:, 0], truth) and not decided.questions
    unanswered = examine_assumptions(imported())
    is_right = np.array_equal(unanswered.outcome.contact[:, 0], truth)
    assert is_right or unanswered.questions
    for question in unanswered.questions:
        right = [row for row in question.alternatives if np.array_equal(row.outcome.contact[:, 0], truth)]
        assert len(right) == 1 and question.plausible in ("", right[0].value)
    if convention in ("canonical", "openxr", "openvr", "godot", "gltf", "aframe"):
        assert is_right and not unanswered.questions


@pytest.mark.parametrize(("convention", "kind", "exported"), QUICK_SCENES)
def test_contacts_are_exact_once_axes_are_stated(tmp_path, convention, kind, exported):
    """``convention``: of the poses; ``kind``: of mesh files; ``exported``: by the program's own exporter."""
    assert_contacts_are_true_or_questioned(tmp_path, convention, kind, exported)


@pytest.mark.slow
@pytest.mark.parametrize(("convention", "kind", "exported"), SLOW_SCENES)
def test_contacts_are_exact_or_questioned_in_every_convention_and_format(tmp_path, convention, kind, exported):
    """All other scenes of the test above."""
    assert_contacts_are_true_or_questioned(tmp_path, convention, kind, exported)


CUP_AXES = Assumption(Subject.MESH_AXES, "gltf", Origin.GUESS, bodies=("cup",), files=("a.obj",), description="Y is up")


@pytest.mark.parametrize(
    ("row", "text"),
    [
        (CUP_AXES, "Y is up"),
        (replace(CUP_AXES, bodies=("rod",)), "Z is up"),
        (replace(CUP_AXES, files=("b.obj",)), "given"),
        (replace(CUP_AXES, subject=Subject.COLLIDER_AXES), "given"),
        (Assumption(Subject.POSE_AXES, "unity", Origin.USER), "given (left-handed)"),
        (Assumption(Subject.LENGTH_UNIT, "m", Origin.USER), "lengths in given"),
        (Assumption(Subject.MESH_UNIT, "m", Origin.USER), "drawn in given"),
    ],
)
def test_assumption_is_described_as_the_recording_has_it(row, text):
    """The recording says something of other bodies, files and subjects as well; ``given`` is the value asked for."""
    rows = [
        Assumption(Subject.POSE_AXES, "unity", Origin.USER, description="left-handed"),
        replace(CUP_AXES, bodies=("rod",), description="Z is up"),
        replace(CUP_AXES, files=("b.obj",), description=""),
        CUP_AXES,
    ]
    session = Session.from_arrays(
        [0], {"a": ([[0, 0, 0]], [[0, 0, 0, 1]])}, {}, facts={ASSUMPTIONS_FACT: assumptions_fact(rows)}
    )
    assert assumption_text(session, row, "given") == text


def test_planted_scene_has_exactly_two_contacts():
    """Contact begins twice, and lasts 6 frames at least and less than a quarter of all."""
    truth = true_contact()
    assert np.flatnonzero(np.diff(truth.astype(int)) == 1).size == 2 and 5 < truth.sum() < FRAMES / 4


@pytest.mark.parametrize("convention", ["z-up", "ros"])
def test_stl_rod_hovering_4_cm_over_plate_has_no_contact(tmp_path, convention):
    """The rod's middle is 5 cm over the plate's top, and the rod 2 cm thick: 4 cm are between them."""
    to_source = TO_SOURCE[convention]
    bodies = {"rod": ([-0.1, -0.01, -0.01], [0.1, 0.01, 0.01]), "plate": ([-0.2, -0.01, -0.2], [0.2, 0, 0.2])}
    for name, corners in bodies.items():
        vertices, faces = box(*corners)
        write_mesh(tmp_path / f"{name}.stl", changed(vertices, to_source), faces)
    rows = ["t,name,x,y,z,qx,qy,qz,qw"]
    for frame in range(20):
        for name, start in (("rod", (0.001 * frame, 0.05, 0.0)), ("plate", (0.0, 0.0, 0.0))):
            rows.append(f"{frame / 60!r},{name}," + ",".join(map(str, (*changed(start, to_source)[0], 0, 0, 0, 1))))
    (tmp_path / "take.csv").write_text("\n".join([*rows, ""]))
    write_mapping(tmp_path, convention)
    meshes = {name: tmp_path / f"{name}.stl" for name in ("rod", "plate")}
    session = import_session("csv", tmp_path / "take.csv", mapping=tmp_path / "map.toml", meshes=meshes)
    outcome = examine_assumptions(session).outcome
    assert outcome.contacts == 0 and outcome.closest == pytest.approx(0.04, abs=1e-6)
    assert outcome_text(outcome) == "no contact, 40 mm at the closest"


def test_run_starts_with_open_questions_until_they_are_decided(tmp_path):
    """STL files say no axes: run and page ask, until the import states them; then 2 contacts are found."""
    axes, imported = written_scene(tmp_path, "ros", "stl", exported=True)
    write_session(imported(), tmp_path / "s.mcap")
    result = replay.run(tmp_path / "s.mcap", detectors="exact", out=tmp_path / "run")
    (question,) = result.document.open_questions
    assert question.startswith("Not decided: axes of meshes of tool and plate. As the poses (ros): no contact")
    assert "Y up" in question and "2 contacts" in question and doubts(result.document)[0] == question
    page = (tmp_path / "run" / "report.html").read_text()
    assert "Not decided: axes of meshes" in page and "guessed, not sure: STL files say no axes" in page
    write_session(imported(mesh_axes=axes), tmp_path / "said.mcap")
    stated = replay.run(tmp_path / "said.mcap", detectors="exact")
    assert stated.document.open_questions == () and len(stated.episodes["exact"]) == 2


def test_answer_equals_import_option_and_can_be_forgotten(tmp_path):
    """Meshes by an answer in the recording are those by the option of the import; forgotten, they are as before."""
    axes, imported = written_scene(tmp_path, "unreal", "ply", exported=True)
    before, option = imported(), imported(mesh_axes=axes)
    (row,) = [row for row in recording_assumptions(before) if row.subject is Subject.MESH_AXES]
    write_session(with_answer(before, row, axes), tmp_path / "s.mcap")
    kept = read_session(tmp_path / "s.mcap")
    for name in ("tool", "plate"):
        assert np.array_equal(kept.meshes[name].vertices, option.meshes[name].vertices)
        assert np.array_equal(kept.meshes[name].faces, option.meshes[name].faces)
    assert not examine_assumptions(kept).questions
    (decided,) = [row for row in recording_assumptions(kept) if row.subject is Subject.MESH_AXES]
    assert (decided.origin, decided.value, decided.guessed_value) == (Origin.USER, axes, "body")
    forgotten, count = with_answers_forgotten(kept)
    assert count == 1 and len(examine_assumptions(forgotten).questions) == 1
    assert np.array_equal(forgotten.meshes["tool"].vertices, before.meshes["tool"].vertices)
    assert with_answers_forgotten(forgotten)[1] == 0


def test_lengths_of_another_unit_are_questioned_and_answered(tmp_path):
    """Positions are written in millimetres, 1,000 times as large, and the mapping says no unit."""
    _, imported = written_scene(tmp_path, "openxr", "obj", exported=False)
    table = (tmp_path / "take.csv").read_text().splitlines()
    cells = [row.split(",") for row in table[1:]]
    rows = [",".join([*row[:2], *(repr(1000 * float(item)) for item in row[2:5]), *row[5:]]) for row in cells]
    (tmp_path / "take.csv").write_text("\n".join([table[0], *rows, ""]))
    session = imported()
    (question,) = examine_assumptions(session).questions
    assert question.assumption.subject is Subject.LENGTH_UNIT and not question.plausible
    meant = with_answer(session, question.assumption, "mm")
    assert np.array_equal(examine_assumptions(meant).outcome.contact[:, 0], true_contact())
    back, _ = with_answers_forgotten(meant)
    assert np.allclose(back.frames.position, session.frames.position, rtol=1e-15, atol=0)


def test_axes_are_unknown_in_recordings_of_earlier_releases(tmp_path):
    """Earlier releases kept meshes in the axes of their files and recorded no assumptions."""
    _, imported = written_scene(tmp_path, "ros", "stl", exported=False)
    new = imported(mesh_axes="gltf")
    facts = {key: value for key, value in new.facts.items() if key != ASSUMPTIONS_FACT}
    old = type(new)(new.source, new.meshes, new.scene, facts=facts)
    origins = {row.subject: row.origin for row in recording_assumptions(old)}
    assert origins == {Subject.POSE_AXES: Origin.NOT_KNOWN, Subject.MESH_AXES: Origin.NOT_KNOWN}
    (question,) = examine_assumptions(old).questions
    assert question.assumption.value == "gltf"
    now = with_answer(old, question.assumption, "body")
    assert np.array_equal(examine_assumptions(now).outcome.contact[:, 0], true_contact())
    back, _ = with_answers_forgotten(now)
    assert recording_assumptions(back) == recording_assumptions(old)


def test_minimised_recording_keeps_open_guesses_under_new_names(tmp_path):
    """Bodies become body-1 and body-2, and files have no names; a stated answer leaves no guess."""
    _, imported = written_scene(tmp_path, "ros", "stl", exported=True)
    session = imported()
    (question,) = examine_assumptions(session).questions
    (again,) = examine_assumptions(minimise(session)).questions
    assert again.assumption.bodies == ("body-1", "body-2") and not again.assumption.files
    assert again.plausible == question.plausible
    assert "tool" not in minimise(session).facts[ASSUMPTIONS_FACT]
    assert ASSUMPTIONS_FACT not in minimise(imported(mesh_axes="y-up")).facts


def test_mesh_added_by_a_later_scene_is_questioned(tmp_path):
    """The scene brings STL files again, for a recording whose axes were stated; it may state them too."""
    _, imported = written_scene(tmp_path, "ros", "stl", exported=True)
    write_session(imported(mesh_axes="y-up"), tmp_path / "s.mcap")
    bodies = "\n".join(f'[[body]]\nid = "{name}"\nmesh = "{name}.stl"' for name in ("tool", "plate"))
    (tmp_path / "scene.toml").write_text(bodies)
    result = replay.run(tmp_path / "s.mcap", scene=tmp_path / "scene.toml", detectors="exact")
    assert len(result.document.open_questions) == 1
    stated = bodies.replace(".stl", '.stl"\nmesh_axes = "y-up')
    (tmp_path / "scene.toml").write_text(stated)
    decided = replay.run(tmp_path / "s.mcap", scene=tmp_path / "scene.toml", detectors="exact")
    assert decided.document.open_questions == () and len(decided.episodes["exact"]) == 2


def collider_file(path, map_point):
    """A hull of the tool and one of the plate as GLB, each vertex mapped, with the names of Unreal's importer."""
    pieces = trimesh.Scene()
    for name, (vertices, faces) in (("tool", TOOL), ("plate", PLATE)):
        pieces.add_geometry(trimesh.Trimesh(changed(vertices, map_point), faces), node_name=f"UCX_{name}_00")
    path.write_bytes(pieces.export(file_type="glb"))


class Steps:
    """Progress that keeps the steps of the last stage: how many there are, and those done."""

    @contextmanager
    def stage(self, name, total=None, unit="frames"):
        self.total, self.done = total, []
        yield self.done.append


def test_only_colliders_that_do_not_fit_meshes_are_questioned(tmp_path):
    """Colliders in axes that are turned about Y do not fit; answering the question fits them to the meshes."""
    axes, imported = written_scene(tmp_path, "unity", "obj", exported=True)
    collider_file(tmp_path / "own.glb", lambda x, y, z: (x, y, z))
    collider_file(tmp_path / "flipped.glb", lambda x, y, z: (-x, y, -z))
    fits = imported(mesh_axes=axes, colliders=tmp_path / "own.glb")
    assert not examine_assumptions(fits).questions
    session = imported(mesh_axes=axes, colliders=tmp_path / "flipped.glb")
    progress = Steps()
    (question,) = examine_assumptions(session, progress=progress).questions
    assert question.assumption.subject is Subject.COLLIDER_AXES and question.plausible == "x-flipped"
    assert sum(progress.done) == progress.total == len(question.alternatives)
    assert alternatives_differ(session, question.assumption) is True
    (fitting,) = (row for row in recording_assumptions(fits) if row.subject is Subject.COLLIDER_AXES)
    assert alternatives_differ(fits, fitting) is False
    assert question.alternatives[0].words.startswith("colliders up to ")
    assert [row.is_current for row in question.alternatives] == [
        row.value == "canonical" for row in question.alternatives
    ]
    assert len({row.description for row in question.alternatives}) == len(question.alternatives)
    meant = with_answer(session, question.assumption, "x-flipped")
    stated = imported(mesh_axes=axes, colliders=tmp_path / "flipped.glb", collider_axes="x-flipped")
    for name in ("tool", "plate"):
        assert np.array_equal(meant.colliders[name][0].vertices, stated.colliders[name][0].vertices)
        assert np.allclose(meant.colliders[name][0].bounds, meant.meshes[name].bounds, atol=1e-6)
    assert not examine_assumptions(meant).questions and not examine_assumptions(stated).questions


def test_mesh_unit_is_questioned_where_two_units_fit(tmp_path):
    """The meshes are written in units of 10 cm, 2.5 and 4.2 long, so that metres and centimetres may be meant.

    A unit may be stated for all bodies or for one; in metres, as they are, nothing is asked.
    """
    _, imported = written_scene(tmp_path, "openxr", "obj", exported=False)
    for name, (vertices, faces) in (("tool", TOOL), ("plate", PLATE)):
        write_mesh(tmp_path / f"{name}.obj", vertices, faces, unit=0.1)  # 2.5 and 4.2 units of 10 cm
    session = imported()
    raised = [item for item in examine_assumptions(session).questions if item.assumption.subject is Subject.MESH_UNIT]
    assert [[row.value for row in item.alternatives] for item in raised] == [["m", "cm"]]
    assert not [row for row in recording_assumptions(imported(mesh_units="cm")) if row.is_open]
    mixed = {row.bodies: row for row in recording_assumptions(imported(mesh_units=("cm", "tool=m")))}
    assert (mixed["tool",].value, mixed["plate",].value) == ("m", "cm")
    with pytest.raises(ImportFileError, match="--mesh-units tol=m: there is no body 'tol'; did you mean 'tool'"):
        imported(mesh_units=("tol=m",))
    for name, (vertices, faces) in (("tool", TOOL), ("plate", PLATE)):
        write_mesh(tmp_path / f"{name}.obj", vertices, faces)
    assert not examine_assumptions(imported()).questions


def test_lone_small_mesh_in_centimetres_is_questioned(tmp_path):
    """A bead of 6 mm, written as 0.6, rests on a plate of the scene; as metres it is a box of most of a metre."""
    write_scene(tmp_path, "openxr", "glb")
    edge = 0.006
    vertices, faces = box([-edge / 2] * 3, [edge / 2] * 3)
    write_mesh(tmp_path / "tool.obj", vertices, faces, unit=0.01)
    meshes = {"tool": tmp_path / "tool.obj", "plate": tmp_path / "plate.glb"}
    session = import_session("csv", tmp_path / "take.csv", mapping=tmp_path / "map.toml", meshes=meshes)
    (question,) = examine_assumptions(session).questions
    assert question.assumption.subject is Subject.MESH_UNIT and question.plausible in ("", "cm")
    assert [row.value for row in question.alternatives] == ["m", "cm"]


def test_forgetting_an_answer_restores_all_recorded_facts(tmp_path):
    """Each alternative of each open guess, of poses and of meshes."""
    _, poses = unity_poses_without_a_name(tmp_path, "glb")
    _, meshes = written_scene(tmp_path, "unreal", "ply", exported=True)
    for session in (poses(), meshes()):
        for row in recording_assumptions(session):
            for value in row.alternatives if row.is_open else ():
                back, count = with_answers_forgotten(with_answer(session, row, value))
                assert count == 1 and recording_assumptions(back) == recording_assumptions(session)
                assert {key: text for key, text in back.facts.items() if key != ASSUMPTIONS_FACT} == {
                    key: text for key, text in session.facts.items() if key != ASSUMPTIONS_FACT
                }
                assert np.allclose(back.frames.position, session.frames.position, rtol=1e-15, atol=0)


def test_run_lists_guesses_of_the_draft_on_first_screen(tmp_path):
    """The draft of the mapping says that it guessed the unit of times."""
    _, imported = written_scene(tmp_path, "openxr", "obj", exported=False)
    text = (tmp_path / "map.toml").read_text()
    (tmp_path / "map.toml").write_text('guessed = ["time.unit"]\n' + text)
    (line,) = doubts(replay.run(imported(), detectors="exact").document)
    assert line.startswith(
        "Guessed by the import: unit of lengths (m); unit of times (s); unit of meshes of tool and plate (m). Why"
    )


def unity_poses_without_a_name(folder, kind):
    """Poses of Unity in Foxglove's messages, which say no axes, and meshes as Unity's exporter writes them."""
    axes = write_scene(folder, "unity", kind, exported=True)
    rows = [line.split(",") for line in (folder / "take.csv").read_text().splitlines()[1:]]
    write_transforms(
        folder / "take.mcap", [(row[1], round(float(row[0]) * 1e9) + 10**9, row[2:5], row[5:]) for row in rows]
    )
    meshes = {name: folder / f"{name}.{kind}" for name in ("tool", "plate")}
    return axes, lambda **more: import_session("mcap", folder / "take.mcap", meshes=meshes, **more)


@pytest.mark.slow
def test_question_about_pose_axes_has_the_right_answer_unity(tmp_path):
    """The guess gives wrong contacts; of all alternatives only Unity's axes have the true ones."""
    axes, imported = unity_poses_without_a_name(tmp_path, "glb")
    guessed = imported()
    assert not np.array_equal(examine_assumptions(guessed).outcome.contact[:, 0], true_contact())
    raised = {question.assumption.subject: question for question in examine_assumptions(guessed).questions}
    right = [
        row.value
        for row in raised[Subject.POSE_AXES].alternatives
        if np.array_equal(row.outcome.contact[:, 0], true_contact())
    ]
    assert right == ["unity"]
    decided = with_answer(guessed, raised[Subject.POSE_AXES].assumption, "unity")
    assert np.array_equal(examine_assumptions(decided).outcome.contact[:, 0], true_contact())
    assert axes == "x-flipped" and Subject.POSE_AXES not in {
        question.assumption.subject for question in examine_assumptions(decided).questions
    }


def test_harmless_guesses_of_pose_axes_are_listed_without_question(tmp_path):
    """Axes of poses and of meshes that are in the same ones: whatever they are, contacts are the same."""
    _, imported = unity_poses_without_a_name(tmp_path, "obj")
    session = imported(mesh_axes="body")
    assert not examine_assumptions(session).questions
    stated = doubts(replay.run(session, detectors="exact").document)
    assert stated[0].startswith(
        "Guessed by the import: axes of poses (ros, not sure); unit of lengths (m); unit of meshes"
    )
    assert not any(
        "axes of poses" in line for line in doubts(replay.run(imported(convention="ros"), detectors="exact").document)
    )


def test_at_most_three_questions_whose_answers_change_contacts(tmp_path):
    """Five guesses are open: axes of the poses, axes and unit of an OBJ, and of an STL."""
    unity_poses_without_a_name(tmp_path, "obj")
    files = {"tool": tmp_path / "tool.obj", "plate": tmp_path / "plate.stl"}
    for path, (vertices, faces) in zip(files.values(), (TOOL, PLATE), strict=True):
        write_mesh(path, changed(vertices, TO_SOURCE["unity"]), faces[:, ::-1], unit=0.1)
    session = import_session("mcap", tmp_path / "take.mcap", meshes=files)
    assert len([row for row in recording_assumptions(session) if row.is_open]) >= 4
    questions = examine_assumptions(session).questions
    assert 1 <= len(questions) <= 3
    for question in questions:
        contacts = [row.outcome.contact.tobytes() for row in question.alternatives]
        assert len(contacts) == len({*contacts}) > 1
