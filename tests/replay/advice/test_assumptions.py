"""Guesses of an import as questions, on a planted scene in the axes of many programs whose contacts are known."""

from contextlib import contextmanager
from dataclasses import replace
from itertools import product
from types import SimpleNamespace

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

pytestmark = pytest.mark.usefixtures("few_depth_frames", "few_surface_points")

FORMATS = ("obj", "stl", "ply", "glb")
EVERY_SCENE = [*product(TO_SOURCE, FORMATS, (False, True))]
SAME_AXES = ("openxr", "openvr", "godot", "aframe")
"""Conventions whose axes are those of canonical and gltf."""
QUICK_SCENES = [(name, FORMATS[k % 4], k % 3 == 0) for k, name in enumerate(TO_SOURCE) if name not in SAME_AXES][::2]
"""Convention of the poses, kind of mesh files, and whether the program's own exporter wrote them."""
SLOW_SCENES = [row for row in EVERY_SCENE if row not in QUICK_SCENES]


def contacts(session):
    """Whether tool and plate are in contact, a truth value a frame, by a replay of the recording as it is."""
    return examine_assumptions(session).outcome.contact[:, 0]


def written_scene(folder, convention, kind, exported, **options):
    """The axes that the meshes of a written scene of tool and plate are in, and a function that imports the scene."""
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
    assert np.array_equal(decided.outcome.contact[:, 0], truth)
    assert not decided.questions
    unanswered = examine_assumptions(imported())
    is_right = np.array_equal(unanswered.outcome.contact[:, 0], truth)
    assert is_right or unanswered.questions
    for question in unanswered.questions:
        right = [row for row in question.alternatives if np.array_equal(row.outcome.contact[:, 0], truth)]
        assert len(right) == 1
        assert question.plausible in ("", right[0].value)
    if convention in ("canonical", "openxr", "openvr", "godot", "gltf", "aframe"):
        assert is_right
        assert not unanswered.questions


@pytest.mark.parametrize(("convention", "kind", "exported"), QUICK_SCENES)
def test_contacts_are_exact_once_axes_are_stated(tmp_path, convention, kind, exported):
    """A planted scene of tool and plate, written in a program's axes (``convention``), is imported again.

    With the axes of its meshes stated it has its true contacts. Without, it has them too or raises a question, one
    answer of which gives them. ``exported``: meshes are written by the program's own exporter.
    """
    assert_contacts_are_true_or_questioned(tmp_path, convention, kind, exported)


@pytest.mark.slow
@pytest.mark.parametrize(("convention", "kind", "exported"), SLOW_SCENES)
def test_contacts_are_exact_or_questioned_in_every_convention_and_format(tmp_path, convention, kind, exported):
    """The scene of the test above in all other conventions and kinds of mesh files, by the own exporter or not."""
    assert_contacts_are_true_or_questioned(tmp_path, convention, kind, exported)


CUP_AXES = Assumption(Subject.MESH_AXES, "gltf", Origin.GUESS, bodies=("cup",), files=("a.obj",), description="Y is up")
"""A guess on the axes of the mesh a.obj of a cup."""


@pytest.mark.parametrize(
    ("assumption", "text"),
    [
        pytest.param(CUP_AXES, "Y is up", id="the cup's axes"),
        pytest.param(replace(CUP_AXES, bodies=("rod",)), "Z is up", id="the rod's axes"),
        pytest.param(replace(CUP_AXES, files=("b.obj",)), "value", id="another file, not described"),
        pytest.param(replace(CUP_AXES, subject=Subject.COLLIDER_AXES), "value", id="colliders, not recorded"),
        pytest.param(Assumption(Subject.POSE_AXES, "unity", Origin.USER), "value (left-handed)", id="poses"),
        pytest.param(Assumption(Subject.LENGTH_UNIT, "m", Origin.USER), "lengths in value", id="unit of lengths"),
        pytest.param(Assumption(Subject.MESH_UNIT, "m", Origin.USER), "drawn in value", id="unit of meshes"),
    ],
)
def test_assumption_is_described_as_the_recording_has_it(assumption, text):
    """A recording describes its assumptions by subject, bodies and files: poses, and axes of the meshes of three files.

    A value ("value") is described as the recording does, if it says anything of that subject, body and file.
    """
    recorded = [
        Assumption(Subject.POSE_AXES, "unity", Origin.USER, description="left-handed"),
        replace(CUP_AXES, bodies=("rod",), description="Z is up"),
        replace(CUP_AXES, files=("b.obj",), description=""),
        CUP_AXES,
    ]
    session = Session.from_arrays(
        [0], {"a": ([[0, 0, 0]], [[0, 0, 0, 1]])}, {}, facts={ASSUMPTIONS_FACT: assumptions_fact(recorded)}
    )
    assert assumption_text(session, assumption, "value") == text


def test_planted_scene_has_exactly_two_contacts():
    """The scene that the tests of this file write: contact begins twice, after the first frame, in 120 frames.

    It lasts 6 frames at least and less than a quarter of all, so that an answer that is always right or wrong differs.
    """
    truth = true_contact()
    begins = np.flatnonzero(np.diff(truth.astype(int)) == 1)
    assert len(begins) == 2
    assert 6 <= truth.sum() < FRAMES / 4


@pytest.mark.parametrize("convention", ["z-up", "ros"])
def test_stl_rod_hovering_4_cm_over_plate_has_no_contact(tmp_path, convention):
    """A rod 2 cm thick whose middle is 5 cm over the top of a plate: 4 cm are between them, in 20 frames.

    Poses and STL files are in the axes of a program in which z is up; the import has to find out.
    """
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
    assert outcome.contacts == 0
    assert outcome.closest == pytest.approx(0.04, abs=1e-6)
    assert outcome_text(outcome) == "no contact, 40 mm at the closest"


def test_run_starts_with_an_open_question(tmp_path):
    """A tool and a plate, recorded in ROS axes (Z up); STL files do not say the axes of their meshes.

    Taken in those of the poses the bodies never touch, with Y up they have 2 contacts: the run's first doubt, and its
    page, say that this is not decided.
    """
    _axes, imported = written_scene(tmp_path, "ros", "stl", exported=True)
    write_session(imported(), tmp_path / "s.mcap")
    result = replay.run(tmp_path / "s.mcap", detectors="exact", out=tmp_path / "run", picture=False)
    (question,) = result.document.open_questions
    assert question.startswith("Not decided: axes of meshes of tool and plate. As the poses (ros): no contact")
    assert "Y up" in question
    assert "2 contacts" in question
    assert doubts(result.document)[0] == question
    page = (tmp_path / "run" / "report.html").read_text()
    assert "Not decided: axes of meshes" in page
    assert "guessed, not sure: STL files say no axes" in page


def test_run_with_stated_axes_has_no_question(tmp_path):
    """A scene of tool and plate in ROS axes with STL files, whose axes the import states: both contacts are found."""
    axes, imported = written_scene(tmp_path, "ros", "stl", exported=True)
    write_session(imported(mesh_axes=axes), tmp_path / "s.mcap")
    result = replay.run(tmp_path / "s.mcap", detectors="exact")
    assert result.document.open_questions == ()
    assert len(result.episodes["exact"]) == 2


@pytest.fixture(scope="module")
def unreal_scene(tmp_path_factory):
    """A scene in Unreal's axes with PLY meshes by its exporter, whose axes are an open guess of the import.

    ``guessed``, ``stated``: imported without and with their axes. ``answered``: the guess answered, written, read back.
    """
    folder = tmp_path_factory.mktemp("unreal")
    axes, imported = written_scene(folder, "unreal", "ply", exported=True)
    guessed = imported()
    (guess,) = [row for row in recording_assumptions(guessed) if row.subject is Subject.MESH_AXES]
    write_session(with_answer(guessed, guess, axes), folder / "s.mcap")
    answered = read_session(folder / "s.mcap")
    return SimpleNamespace(axes=axes, guessed=guessed, stated=imported(mesh_axes=axes), answered=answered)


def test_answered_recording_has_the_meshes_of_the_import_option(unreal_scene):
    """The axes of meshes, Unreal's, are answered in the recording, or stated by the import's option ``mesh_axes``."""
    for name in ("tool", "plate"):
        assert np.array_equal(unreal_scene.answered.meshes[name].vertices, unreal_scene.stated.meshes[name].vertices)
        assert np.array_equal(unreal_scene.answered.meshes[name].faces, unreal_scene.stated.meshes[name].faces)


def test_answered_recording_has_no_question(unreal_scene):
    """A user answered the axes of a recording's meshes, which the import had guessed to be those of the poses ("body").

    The recording says both.
    """
    assert not examine_assumptions(unreal_scene.answered).questions
    (row,) = [row for row in recording_assumptions(unreal_scene.answered) if row.subject is Subject.MESH_AXES]
    assert (row.origin, row.value, row.guessed_value) == (Origin.USER, unreal_scene.axes, "body")


def test_forgotten_answer_leaves_the_recording_as_imported(unreal_scene):
    """A user answered the axes of a recording's meshes, and takes that back: question and guessed meshes return.

    Then there is no further answer to forget.
    """
    forgotten, count = with_answers_forgotten(unreal_scene.answered)
    assert count == 1
    assert len(examine_assumptions(forgotten).questions) == 1
    assert np.array_equal(forgotten.meshes["tool"].vertices, unreal_scene.guessed.meshes["tool"].vertices)
    _session, further_count = with_answers_forgotten(forgotten)
    assert further_count == 0


def test_lengths_of_another_unit_are_questioned_and_answered(tmp_path):
    """Positions of a scene are written in millimetres, 1,000 times as large, and the mapping says no unit.

    The question has no plausible answer; "mm" gives the true contacts, and can be forgotten.
    """
    _axes, imported = written_scene(tmp_path, "openxr", "obj", exported=False)
    head, *lines = (tmp_path / "take.csv").read_text().splitlines()
    rows = []
    for line in lines:
        time, name, *numbers = line.split(",")
        millimetres = [repr(1000 * float(metres)) for metres in numbers[:3]]
        rows.append(",".join([time, name, *millimetres, *numbers[3:]]))
    (tmp_path / "take.csv").write_text("\n".join([head, *rows, ""]))
    session = imported()
    (question,) = examine_assumptions(session).questions
    assert question.assumption.subject is Subject.LENGTH_UNIT
    assert question.plausible == ""
    answered = with_answer(session, question.assumption, "mm")
    assert np.array_equal(contacts(answered), true_contact())
    forgotten, _count = with_answers_forgotten(answered)
    assert np.allclose(forgotten.frames.position, session.frames.position, rtol=1e-15, atol=0)


@pytest.fixture
def recording_of_an_earlier_release(tmp_path):
    """A scene in ROS axes whose meshes are in the axes of their STL files, without assumptions, as once recorded."""
    _axes, imported = written_scene(tmp_path, "ros", "stl", exported=False)
    new = imported(mesh_axes="gltf")
    facts = {key: value for key, value in new.facts.items() if key != ASSUMPTIONS_FACT}
    return type(new)(new.source, new.meshes, new.scene, facts=facts)


def test_axes_are_unknown_in_recordings_of_earlier_releases(recording_of_an_earlier_release):
    """Earlier releases recorded no assumptions: those of poses and of meshes are asked for as "not known"."""
    rows = recording_assumptions(recording_of_an_earlier_release)
    assert {row.subject: row.origin for row in rows} == {
        Subject.POSE_AXES: Origin.NOT_KNOWN,
        Subject.MESH_AXES: Origin.NOT_KNOWN,
    }


def test_recording_of_an_earlier_release_is_answered_and_forgotten(recording_of_an_earlier_release):
    """Meshes are in the axes of their files (glTF's); the answer "body", those of the poses, gives true contacts."""
    old = recording_of_an_earlier_release
    (question,) = examine_assumptions(old).questions
    assert question.assumption.value == "gltf"
    answered = with_answer(old, question.assumption, "body")
    assert np.array_equal(contacts(answered), true_contact())
    forgotten, _count = with_answers_forgotten(answered)
    assert recording_assumptions(forgotten) == recording_assumptions(old)


def test_minimised_recording_keeps_open_guesses_under_new_names(tmp_path):
    """A scene of tool and plate in ROS axes with STL files has an open guess on the axes of its meshes.

    Minimised, bodies are body-1 and body-2 and files have no names; the question and its plausible answer stay.
    """
    _axes, imported = written_scene(tmp_path, "ros", "stl", exported=True)
    session = imported()
    (question,) = examine_assumptions(session).questions
    minimised = minimise(session)
    (question_of_minimised,) = examine_assumptions(minimised).questions
    assert question_of_minimised.assumption.bodies == ("body-1", "body-2")
    assert not question_of_minimised.assumption.files
    assert question_of_minimised.plausible == question.plausible
    assert "tool" not in minimised.facts[ASSUMPTIONS_FACT]


def test_minimised_recording_with_stated_axes_has_no_guess(tmp_path):
    """A scene in ROS axes with STL files, whose axes the import states, is minimised.

    No fact says that anything is open.
    """
    _axes, imported = written_scene(tmp_path, "ros", "stl", exported=True)
    assert ASSUMPTIONS_FACT not in minimise(imported(mesh_axes="y-up")).facts


@pytest.mark.parametrize(
    ("stated_axes", "questions", "contact_count"),
    [pytest.param("", 1, None, id="not stated"), pytest.param('mesh_axes = "y-up"', 0, 2, id="stated")],
)
def test_mesh_added_by_a_later_scene_is_questioned(tmp_path, stated_axes, questions, contact_count):
    """A recording in ROS axes whose meshes have stated axes; a run's own scene file brings the STL files once more.

    It may state their axes too: then there is no question, and both contacts of the scene are found.
    """
    _axes, imported = written_scene(tmp_path, "ros", "stl", exported=True)
    write_session(imported(mesh_axes="y-up"), tmp_path / "s.mcap")
    bodies = [f'[[body]]\nid = "{name}"\nmesh = "{name}.stl"\n{stated_axes}' for name in ("tool", "plate")]
    (tmp_path / "scene.toml").write_text("\n".join(bodies))
    result = replay.run(tmp_path / "s.mcap", scene=tmp_path / "scene.toml", detectors="exact")
    assert len(result.document.open_questions) == questions
    if contact_count is not None:
        assert len(result.episodes["exact"]) == contact_count


def write_colliders(path, map_point):
    """Writes a hull of the tool and one of the plate as GLB, each vertex mapped, with names of Unreal's importer."""
    pieces = trimesh.Scene()
    for name, (vertices, faces) in (("tool", TOOL), ("plate", PLATE)):
        pieces.add_geometry(trimesh.Trimesh(changed(vertices, map_point), faces), node_name=f"UCX_{name}_00")
    path.write_bytes(pieces.export(file_type="glb"))


class CountedSteps:
    """Progress that notes the steps of the last stage: how many there are, and those done."""

    @contextmanager
    def stage(self, name, total=None, unit="frames"):
        self.total, self.done = total, []
        yield self.done.append


@pytest.fixture(scope="module")
def unity_scene_with_colliders(tmp_path_factory):
    """A scene in Unity's axes with stated axes of its meshes, and a file of colliders.

    ``fitting``: it is in the axes of the poses; ``flipped``: it is turned by half a turn about Y; ``stated``: the
    import says so.
    """
    folder = tmp_path_factory.mktemp("unity")
    axes, imported = written_scene(folder, "unity", "obj", exported=True)
    write_colliders(folder / "own.glb", lambda x, y, z: (x, y, z))
    write_colliders(folder / "flipped.glb", lambda x, y, z: (-x, y, -z))
    flipped = folder / "flipped.glb"
    return SimpleNamespace(
        fitting=imported(mesh_axes=axes, colliders=folder / "own.glb"),
        flipped=imported(mesh_axes=axes, colliders=flipped),
        stated=imported(mesh_axes=axes, colliders=flipped, collider_axes="x-flipped"),
    )


def test_colliders_that_fit_their_meshes_are_not_questioned(unity_scene_with_colliders):
    """The axes of a file of colliders are a guess; as guessed they lie where the meshes are, so nothing is asked."""
    fitting = unity_scene_with_colliders.fitting
    (guess,) = [row for row in recording_assumptions(fitting) if row.subject is Subject.COLLIDER_AXES]
    assert not examine_assumptions(fitting).questions
    assert alternatives_differ(fitting, guess) is False


def test_colliders_that_do_not_fit_their_meshes_are_questioned(unity_scene_with_colliders):
    """Colliders are turned by half a turn about Y. The question has several alternatives, each described differently.

    The current one is "canonical", the axes as they are; with "x-flipped" they fit, so that it is the plausible one.
    The first says how far the colliders stand off the meshes. Progress counts alternatives.
    """
    flipped, progress = unity_scene_with_colliders.flipped, CountedSteps()
    (question,) = examine_assumptions(flipped, progress=progress).questions
    assert sum(progress.done) == progress.total == len(question.alternatives)
    assert question.assumption.subject is Subject.COLLIDER_AXES
    assert question.plausible == "x-flipped"
    assert alternatives_differ(flipped, question.assumption) is True
    assert [row.value for row in question.alternatives if row.is_current] == ["canonical"]
    assert question.alternatives[0].words.startswith("colliders up to ")
    descriptions = {row.description for row in question.alternatives}
    assert len(descriptions) == len(question.alternatives) > 1


def test_answered_axes_of_colliders_equal_the_import_option(unity_scene_with_colliders):
    """Colliders turned by half a turn about Y: their axes, "x-flipped", are an answer in the recording or an option.

    Both ways give the same colliders, which fit their meshes to 1 um, and no question is left.
    """
    flipped, stated = unity_scene_with_colliders.flipped, unity_scene_with_colliders.stated
    (guess,) = [row for row in recording_assumptions(flipped) if row.subject is Subject.COLLIDER_AXES]
    answered = with_answer(flipped, guess, "x-flipped")
    for name in ("tool", "plate"):
        (collider, *_), (stated_collider, *_) = answered.colliders[name], stated.colliders[name]
        assert np.array_equal(collider.vertices, stated_collider.vertices)
        assert np.allclose(collider.bounds, answered.meshes[name].bounds, atol=1e-6)
    assert not examine_assumptions(answered).questions
    assert not examine_assumptions(stated).questions


@pytest.fixture
def import_meshes_in_10_cm(tmp_path):
    """Imports a scene whose meshes are written in units of 10 cm, 2.5 and 4.2 long: metres or centimetres?"""
    _axes, imported = written_scene(tmp_path, "openxr", "obj", exported=False)
    for name, (vertices, faces) in (("tool", TOOL), ("plate", PLATE)):
        write_mesh(tmp_path / f"{name}.obj", vertices, faces, unit=0.1)
    return imported


def test_mesh_unit_is_questioned_where_two_units_fit(import_meshes_in_10_cm):
    """Meshes of an OBJ file, which says no unit, are 2.5 and 4.2 long: metres and centimetres are both possible."""
    questions = examine_assumptions(import_meshes_in_10_cm()).questions
    of_units = [question for question in questions if question.assumption.subject is Subject.MESH_UNIT]
    assert [[row.value for row in question.alternatives] for question in of_units] == [["m", "cm"]]


def test_mesh_unit_may_be_stated_for_a_single_body(import_meshes_in_10_cm):
    """The option ``mesh_units`` of the import: "cm" for all, then "cm" for all but the tool."""
    of_all = recording_assumptions(import_meshes_in_10_cm(mesh_units="cm"))
    assert [row for row in of_all if row.is_open] == []
    of_tool = recording_assumptions(import_meshes_in_10_cm(mesh_units=("cm", "tool=m")))
    unit_of_bodies = {row.bodies: row.value for row in of_tool if row.subject is Subject.MESH_UNIT}
    assert unit_of_bodies == {("tool",): "m", ("plate",): "cm"}


def test_mesh_unit_of_an_unknown_body_is_refused(import_meshes_in_10_cm):
    """The bodies are tool and plate; the option ``mesh_units`` of the import names "tol"."""
    with pytest.raises(ImportFileError, match="--mesh-units tol=m: there is no body 'tol'; did you mean 'tool'"):
        import_meshes_in_10_cm(mesh_units=("tol=m",))


def test_mesh_unit_of_metres_is_not_questioned(tmp_path):
    """Meshes of an OBJ file, which says no unit, are 0.25 and 0.42 long: they can be metres only."""
    _axes, imported = written_scene(tmp_path, "openxr", "obj", exported=False)
    assert not examine_assumptions(imported()).questions


def test_lone_small_mesh_in_centimetres_is_questioned(tmp_path):
    """A bead of 6 mm, written as 0.6 in an OBJ, moves as the tool of a scene; as metres it is a box of most of a metre.

    The plate is in a GLB file, which is in metres.
    """
    write_scene(tmp_path, "openxr", "glb")
    edge = 0.006
    vertices, faces = box([-edge / 2] * 3, [edge / 2] * 3)
    write_mesh(tmp_path / "tool.obj", vertices, faces, unit=0.01)
    meshes = {"tool": tmp_path / "tool.obj", "plate": tmp_path / "plate.glb"}
    session = import_session("csv", tmp_path / "take.csv", mapping=tmp_path / "map.toml", meshes=meshes)
    (question,) = examine_assumptions(session).questions
    assert question.assumption.subject is Subject.MESH_UNIT
    assert question.plausible in ("", "cm")
    assert [row.value for row in question.alternatives] == ["m", "cm"]


def test_forgetting_an_answer_restores_all_recorded_facts(tmp_path):
    """Two recordings: poses of Unity in a file that says no axes, and meshes of Unreal whose axes are a guess.

    Each alternative of each open guess is given as the answer, and forgotten: assumptions, other facts and positions
    are as before.
    """
    _axes, import_poses = unity_poses_without_a_name(tmp_path, "glb")
    _axes, import_meshes = written_scene(tmp_path, "unreal", "ply", exported=True)

    def other_facts(session):
        return {key: text for key, text in session.facts.items() if key != ASSUMPTIONS_FACT}

    for session in (import_poses(), import_meshes()):
        open_guesses = [row for row in recording_assumptions(session) if row.is_open]
        assert open_guesses
        for guess in open_guesses:
            for value in guess.alternatives:
                forgotten, count = with_answers_forgotten(with_answer(session, guess, value))
                assert count == 1
                assert recording_assumptions(forgotten) == recording_assumptions(session)
                assert other_facts(forgotten) == other_facts(session)
                assert np.allclose(forgotten.frames.position, session.frames.position, rtol=1e-15, atol=0)


def test_run_lists_guesses_of_the_draft_on_first_screen(tmp_path):
    """A mapping for the import that ``replay`` drafted says which of its keys are guesses: here the unit of times.

    Units of lengths and meshes are guessed by the import itself. One line on the first screen lists all three.
    """
    _axes, imported = written_scene(tmp_path, "openxr", "obj", exported=False)
    mapping = (tmp_path / "map.toml").read_text()
    (tmp_path / "map.toml").write_text('guessed = ["time.unit"]\n' + mapping)
    (line,) = doubts(replay.run(imported(), detectors="exact").document)
    assert line.startswith(
        "Guessed by the import: unit of lengths (m); unit of times (s); unit of meshes of tool and plate (m). Why"
    )


def unity_poses_without_a_name(folder, kind):
    """The axes of the meshes, and a function that imports poses of Unity in Foxglove's messages, which say no axes."""
    axes = write_scene(folder, "unity", kind, exported=True)
    rows = [line.split(",") for line in (folder / "take.csv").read_text().splitlines()[1:]]
    write_transforms(
        folder / "take.mcap", [(row[1], round(float(row[0]) * 1e9) + 10**9, row[2:5], row[5:]) for row in rows]
    )
    meshes = {name: folder / f"{name}.{kind}" for name in ("tool", "plate")}
    return axes, lambda **more: import_session("mcap", folder / "take.mcap", meshes=meshes, **more)


@pytest.mark.slow
def test_question_about_pose_axes_has_the_right_answer_unity(tmp_path):
    """Poses of Unity in a file that says no axes: as guessed, contacts are wrong.

    Of all alternatives of the question only Unity's axes give the true contacts. Once that is the answer, poses are no
    question, and the meshes of Unity's exporter (x flipped) are understood too.
    """
    axes, imported = unity_poses_without_a_name(tmp_path, "glb")
    assert axes == "x-flipped"
    guessed, truth = imported(), true_contact()
    review = examine_assumptions(guessed)
    assert not np.array_equal(review.outcome.contact[:, 0], truth)
    (question,) = [item for item in review.questions if item.assumption.subject is Subject.POSE_AXES]
    right = [row.value for row in question.alternatives if np.array_equal(row.outcome.contact[:, 0], truth)]
    assert right == ["unity"]
    review_of_answer = examine_assumptions(with_answer(guessed, question.assumption, "unity"))
    assert np.array_equal(review_of_answer.outcome.contact[:, 0], truth)
    assert Subject.POSE_AXES not in {item.assumption.subject for item in review_of_answer.questions}


def test_harmless_guesses_of_pose_axes_are_listed_without_question(tmp_path):
    """Axes of poses are a guess; meshes are in the same axes by the option "body".

    Whatever these are, contacts are the same, so nothing is asked; the first screen lists the guess.
    """
    _axes, imported = unity_poses_without_a_name(tmp_path, "obj")
    session = imported(mesh_axes="body")
    assert not examine_assumptions(session).questions
    first_line, *_ = doubts(replay.run(session, detectors="exact").document)
    assert first_line.startswith(
        "Guessed by the import: axes of poses (ros, not sure); unit of lengths (m); unit of meshes"
    )


def test_stated_axes_of_poses_are_not_listed_as_a_guess(tmp_path):
    """The option ``convention`` of the import says that poses are in ROS axes.

    Other guesses are listed on the first screen.
    """
    _axes, imported = unity_poses_without_a_name(tmp_path, "obj")
    lines = doubts(replay.run(imported(convention="ros"), detectors="exact").document)
    assert lines
    assert [line for line in lines if "axes of poses" in line] == []


def test_at_most_three_questions_whose_answers_change_contacts(tmp_path):
    """Four guesses or more are open: axes of poses that a file does not say, and axes and units of an OBJ and an STL.

    Meshes are written in units of 10 cm, so that they may be in metres or in centimetres. At most three guesses become
    questions, each with two alternatives or more, no two of which have the same contacts.
    """
    unity_poses_without_a_name(tmp_path, "obj")
    files = {"tool": tmp_path / "tool.obj", "plate": tmp_path / "plate.stl"}
    for path, (vertices, faces) in zip(files.values(), (TOOL, PLATE), strict=True):
        faces_of_mirrored = faces[:, ::-1]  # Unity's axes are left-handed
        write_mesh(path, changed(vertices, TO_SOURCE["unity"]), faces_of_mirrored, unit=0.1)
    session = import_session("mcap", tmp_path / "take.mcap", meshes=files)
    assert len([row for row in recording_assumptions(session) if row.is_open]) >= 4
    questions = examine_assumptions(session).questions
    assert 1 <= len(questions) <= 3
    for question in questions:
        contacts_of_alternatives = [row.outcome.contact.tobytes() for row in question.alternatives]
        assert len(contacts_of_alternatives) == len(set(contacts_of_alternatives)) > 1
