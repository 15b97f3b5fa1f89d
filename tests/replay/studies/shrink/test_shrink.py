"""A wrong answer shrunk: it stays wrong, nothing more can go, and the written test says so to anyone."""

import json
import runpy
import shutil
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.report_states import tamper
from support.shapes import box_mesh
from support.small_worlds import unit_cubes_on_x

from cdcore import Body, Motion, TriangleMesh
from cdcore.bounding.hull import hull_of
from cdcore.poses import rotation_from_quaternion
from replay import run
from replay.cli.main import main
from replay.errors import RunFolderError, ShrinkError
from replay.show.results.run_folder import read_run_folder
from replay.studies.shrink.reduce import Shrinking, Size, minimal_subset
from replay.studies.shrink.well_posed import doubts_of
from replay.studies.shrink.writing import sentence, write_case
from replay.studies.shrink.wrong_answer import WrongAnswer, fault_of_run
from sessions import write_session

X_OF_SECOND_CUBE = [3, 3, 0.9, 0.9, 3, 3, 3, 0.9, 3, 3]
"""Metres, of a cube of 1 m beside one at 0, frame by frame of 10 ms: contacts at the frames 2 and 3, and at 7."""


@given(count=st.integers(1, 60), data=st.data())
def test_minimal_subset_keeps_exactly_the_necessary_faces(count, data):
    """A detector is still wrong about a subset of ``count`` faces if all of a random set of needed ones is in it."""
    needed = set(data.draw(st.lists(st.integers(0, count - 1), unique=True)))

    def is_still_wrong(faces):
        return needed <= set(faces.tolist())

    assert set(minimal_subset(np.arange(count), is_still_wrong).tolist()) == needed


@given(count=st.integers(1, 25), seed=st.integers(0, 2**32))
def test_nothing_left_can_be_removed_alone_despite_chance(count, seed):
    """Whether a detector is still wrong about a subset is drawn at random, 4 of 10, and remembered.

    The smallest subset is one about which it is wrong, and right as soon as any single face is taken away.
    """
    random = np.random.default_rng(seed)
    drawn = {tuple(range(count)): True}

    def is_still_wrong(faces):
        return drawn.setdefault(tuple(faces.tolist()), bool(random.random() < 0.4))

    smallest = minimal_subset(np.arange(count), is_still_wrong)
    assert is_still_wrong(smallest)
    assert not any(is_still_wrong(np.delete(smallest, index)) for index in range(len(smallest)))


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    """A run of ten frames of 10 ms of two cubes: ``slow`` samples at 25 Hz, every fourth; ``exact2`` misses nothing."""
    folder = tmp_path_factory.mktemp("shrink")
    write_session(unit_cubes_on_x({"a": [0] * 10, "b": X_OF_SECOND_CUBE}), folder / "s.mcap")
    detectors = "slow=discrete[rate_hz=25],exact2=hybrid"
    run(folder / "s.mcap", detectors=detectors, out=folder / "run", picture=False)
    return folder / "run"


def shrunk_fault(fault):
    """The wrong answer when nothing more can be left out of it; the detector is still wrong."""
    shrinking = Shrinking(fault)
    smallest = shrinking.run()
    assert smallest.is_reproduced()
    assert shrinking.questions > 0
    return smallest


def one_part_fewer(fault):
    """Yields the wrong answer without each frame but the last, and without each face of both bodies."""
    count = len(fault.motion)
    for frame in range(count - 1):
        yield replace(fault, motion=fault.motion.take(np.delete(np.arange(count), frame)))
    for number in fault.pairs[0].tolist():
        body = fault.bodies[number]
        for face in range(len(body.mesh.faces) if len(body.mesh.faces) > 1 else 0):
            mesh = TriangleMesh(body.mesh.vertices, np.delete(body.mesh.faces, face, axis=0))
            yield replace(fault, bodies=(*fault.bodies[:number], replace(body, mesh=mesh), *fault.bodies[number + 1 :]))


def test_miss_between_samples_ends_at_two_frames_and_two_faces(run_folder):
    """``slow`` samples frames 0, 4 and 8 and misses frames 2 and 3: it needs a frame with a sample, one of contact.

    Without any frame or face of what remains the answer is right, or there is a new doubt whether engines agree on it.
    """
    fault = fault_of_run(read_run_folder(run_folder), miss=1, label="slow")
    assert fault.contact
    smallest = shrunk_fault(fault)
    assert Size.of(smallest) == Size(frames=2, bodies=2, faces=(2, 2))
    for smaller in one_part_fewer(smallest):
        assert not smaller.is_reproduced() or doubts_of(smaller) - doubts_of(smallest)
    assert dict(smallest.settings) == {"rate_hz": 25}
    assert "discrete[rate_hz=25] misses a contact" in sentence(smallest)


@pytest.fixture(scope="module")
def run_with_false_contact(tmp_path_factory):
    """A run of ten frames of 10 ms: contact at the frames 2 to 6; ``slow`` samples 0, 4 and 8, and is false at 7."""
    folder = tmp_path_factory.mktemp("false")
    write_session(unit_cubes_on_x({"a": [0] * 10, "b": [3, 3, 0.9, 0.9, 0.9, 0.9, 0.9, 3, 3, 3]}), folder / "s.mcap")
    run(folder / "s.mcap", detectors="slow=discrete[rate_hz=25]", out=folder / "run", picture=False)
    return folder / "run"


def test_false_contact_is_taken_from_a_run_by_its_number(run_with_false_contact):
    """Contact is in frames 2 to 6 of 10 ms; ``slow`` samples frames 0, 4 and 8.

    The answer of frame 4 stands until the next sample, at 8: wrong in frame 7, at 70 ms, the last of the case.
    """
    opened = read_run_folder(run_with_false_contact)
    assert [(row["number"], row["first"], row["last"]) for row in opened.rows("false")] == [(1, 7, 7)]
    fault = fault_of_run(opened, false=1)
    assert not fault.contact
    assert fault.motion.times[-1] == pytest.approx(0.07)
    with pytest.raises(ShrinkError, match=r"has no false contact 2$"):
        fault_of_run(opened, false=2)


def test_command_shrinks_a_false_contact_by_its_number(run_with_false_contact, tmp_path):
    """A run has one false contact: a case for it is written, whose README says which of the run it is."""
    assert main(["shrink", str(run_with_false_contact), "--false", "1", "--out", str(tmp_path / "case")]) == 0
    assert "false contact 1" in (tmp_path / "case" / "README.md").read_text(encoding="utf-8")


def test_pair_answered_correctly_alone_is_queried_first(tmp_path):
    """The planted detector is blind to its first pair where it has others: bodies a and b touch in frame 1, missed.

    Alone the pair is answered rightly, so that the case keeps all three pairs, that of a and b (0 and 1) first.
    """
    session = unit_cubes_on_x({"a": [0, 0, 0, 0.01], "b": [3, 0.9, 3, 3], "c": [9, 9, 9, 8.99]})
    write_session(session, tmp_path / "s.mcap")
    name = "support.planted_detectors:Distracted"
    run(tmp_path / "s.mcap", detectors=name, out=tmp_path / "run", picture=False)
    fault = fault_of_run(read_run_folder(tmp_path / "run"), miss=1, label=name)
    assert fault.pairs.tolist() == [[0, 1], [0, 2], [1, 2]]


def missed_containment(outer, inner, motion):
    """The wrong answer of hybrid without its question of containment, about a body inside another; exact is right."""
    bodies = (Body("out", outer), Body("in", inner))
    pair = np.array([[0, 1]])
    return WrongAnswer("hybrid", {"containment": False}, "exact", bodies, motion, pair, contact=True)


def test_closed_body_becomes_the_hull_of_fewest_corners():
    """A tetrahedron with a fifth corner, a hull of 6 faces, holds a small box of 12.

    To contain anything it has to stay closed: no single face may go, but the fifth corner may, which leaves 4 faces.
    """
    corners = np.array([[4, 4, 4], [-4, -4, 4], [-4, 4, -4], [4, -4, -4], [3, 3, -3]], dtype=float)
    unmoved = Motion([0.0], np.zeros((1, 2, 3)), np.tile(np.eye(3), (1, 2, 1, 1)))
    fault = missed_containment(hull_of(corners), box_mesh([0.1, 0.1, 0.1]), unmoved)
    assert Size.of(fault).faces == (6, 12)
    assert Size.of(shrunk_fault(fault)).faces == (4, 1)


@pytest.mark.slow
def test_contained_body_is_shrunk_to_a_tetrahedron():
    """A box of 1 m in one of 4 m, both rotated alike, in three frames: the last of them is enough, unrotated.

    The outer box needs four faces to stay closed, the inner one any face to be inside.
    """
    rotated = rotation_from_quaternion(np.tile([0.1, 0.2, 0.3, 0.9], (3, 2, 1)))
    motion = Motion(np.arange(3) / 100.0, np.zeros((3, 2, 3)), rotated)
    smallest = shrunk_fault(missed_containment(box_mesh([4.0, 4.0, 4.0]), box_mesh([1.0, 1.0, 1.0]), motion))
    assert Size.of(smallest) == Size(frames=1, bodies=2, faces=(4, 1))
    assert (smallest.motion.rotations == np.eye(3)).all()


def test_written_test_fails_on_its_detector_and_passes_on_another(run_folder, tmp_path, capsys, monkeypatch, snapshot):
    """The written test asks the detector that the variable DETECTOR names, else the one with the fault, a ``discrete``.

    The snapshot has all written files but those of code.
    """
    out = tmp_path / "case"
    command = ["shrink", str(run_folder), "--miss", "1", "--detector", "slow", "-o", str(out), "--format", "json"]
    assert main(command) == 0
    assert json.loads(capsys.readouterr().out)["after"] == "2 frames x 2 x 2 faces of 2 bodies"
    assert {file.name: file.read_text() for file in sorted(out.iterdir()) if file.suffix != ".py"} == snapshot
    passes = {"": False, "exact": True, "hybrid": True, "discrete": False}
    for detector, is_right in passes.items():
        monkeypatch.setenv("DETECTOR", detector) if detector else monkeypatch.delenv("DETECTOR", raising=False)
        test = runpy.run_path(str(out / "test_case.py"))["test_the_last_frame_is_answered_rightly"]
        with nullcontext() if is_right else pytest.raises(AssertionError):
            test()


def test_written_numbers_read_back_bit_for_bit(run_folder, tmp_path):
    """Times and positions get numbers of 17 digits and of very different sizes, and are written into a test."""
    fault = fault_of_run(read_run_folder(run_folder), miss=1, label="slow")
    positions = fault.motion.translations + np.array([1 / 3, 1e-17, -(2.0**-60)])
    motion = Motion(fault.motion.times + 1 / 7, positions, fault.motion.rotations)
    fault = replace(fault, motion=motion)
    case = write_case(fault, Size.of(fault), tmp_path / "case", source="a test")
    written = runpy.run_path(str(case / "test_case.py"))
    read_motion = written["motion"](len(fault.bodies))
    assert read_motion.times.tobytes() == motion.times.tobytes()
    assert read_motion.translations.tobytes() == motion.translations.tobytes()
    read_body = written["body"]("a", "body-1.obj")
    assert read_body.mesh.vertices.tobytes() == fault.bodies[0].mesh.vertices.tobytes()


@pytest.mark.parametrize(
    ("requested", "message"),
    [
        ({"miss": 1, "label": "hybrid"}, "audited no hybrid; it audited: slow, exact2"),
        ({"miss": 1, "label": "exact2"}, "has no miss 1 of exact2"),
        ({"false": 9, "label": "slow"}, "has no false contact 9 of slow"),
    ],
    ids=["no such detector", "no such miss", "no such false contact"],
)
def test_fault_that_a_run_has_not_is_explained(run_folder, requested, message):
    """The run audited the detectors ``slow``, which misses contacts, and ``exact2``, which misses nothing."""
    with pytest.raises(ShrinkError, match=message):
        fault_of_run(read_run_folder(run_folder), **requested)


@pytest.mark.parametrize(
    ("exact", "slow", "sentence"),
    [
        (True, True, "slow is right; in the run it was wrong: its answer may depend on the clock"),
        (True, None, "slow is undecided; in the run it was wrong: its answer may depend on the clock"),
        (None, False, "exact is undecided; in the run the reference reported contact"),
        (False, True, "exact reports no contact; in the run the reference reported contact"),
    ],
    ids=["right", "undecided", "reference undecided", "reference answers otherwise"],
)
def test_fault_that_does_not_happen_again_is_explained(run_folder, monkeypatch, capsys, exact, slow, sentence):
    """Miss 1 of ``slow``, at 70 ms, with other answers in the rerun: contact, none, or ``None``, undecided."""
    answers = {"exact": exact, "discrete": slow}
    monkeypatch.setattr(WrongAnswer, "reports_contact", lambda _self, name, _settings: answers[name])
    assert main(["shrink", str(run_folder), "--miss", "1", "--detector", "slow"]) == 1
    message = " ".join(capsys.readouterr().err.split())
    assert f"run again on a and b at 0.070 s, {sentence}" in message


def test_answer_that_differs_between_reruns_is_not_called_right(run_folder, monkeypatch):
    """``exact`` reports contact again; ``slow`` does too in the 16 reruns before the last, in which it reports none."""
    answers_of_slow = iter([True] * 16 + [False])
    monkeypatch.setattr(WrongAnswer, "reports_contact", lambda _self, name, _: name == "exact" or next(answers_of_slow))
    with pytest.raises(ShrinkError, match=r"slow changes its answer from one rerun to the next$"):
        fault_of_run(read_run_folder(run_folder), miss=1, label="slow")


def test_command_without_a_fault_names_its_options(run_folder, capsys):
    """A run folder alone, without the number of a miss or a false contact: an error of usage, exit code 2."""
    assert main(["shrink", str(run_folder)]) == 2
    assert "--miss N or --false N" in " ".join(capsys.readouterr().err.split())


def test_run_without_its_recording_cannot_be_shrunk(run_folder, tmp_path):
    """The summary of a copy names another recording: none is beside it, and that of the run is refused."""
    moved = Path(shutil.copytree(run_folder, tmp_path / "run"))
    tamper(moved, "session", digest="0" * 64)
    with pytest.raises(RunFolderError, match=r"the recording .* is not beside it; say where: --session"):
        fault_of_run(read_run_folder(moved), miss=1, label="slow")
    with pytest.raises(RunFolderError, match="is not the recording"):
        fault_of_run(read_run_folder(moved), miss=1, label="slow", session=run_folder.parent / "s.mcap")


@pytest.fixture
def other_scene(tmp_path):
    """A scene file that gives body b a box of 0.9 m in place of its cube of 1 m, as mesh and as shipped collider."""
    scene = tmp_path / "other.toml"
    scene.write_text('[[body]]\nid = "a"\n[[body]]\nid = "b"\nshape = "box"\nsize = [0.9, 0.9, 0.9]\n')
    return scene


def test_run_with_another_scene_is_shrunk_with_that_scene(run_folder, other_scene, tmp_path):
    """The run was made with a scene file in place of the recording's own, which has to be named again.

    A collider that came with the recording (shape shipped) cannot be shrunk: a test holds two meshes alone.
    """
    session = run_folder.parent / "s.mcap"
    detectors = "slow=discrete[rate_hz=25],ours=collider[shape=shipped,rate_hz=25]"
    run(session, detectors=detectors, scene=other_scene, out=tmp_path / "run", picture=False)
    opened = read_run_folder(tmp_path / "run")
    with pytest.raises(RunFolderError, match=r"run replayed with the scene of other.toml; give it with --scene FILE$"):
        fault_of_run(opened, miss=1, label="slow", session=session)
    fault = fault_of_run(opened, miss=1, label="slow", session=session, scene=other_scene)
    assert fault.is_reproduced()
    cube, box = fault.bodies
    assert len(cube.mesh.faces) == len(box.mesh.faces) == 12
    assert np.ptp(box.mesh.vertices, axis=0) == pytest.approx([0.9, 0.9, 0.9])
    with pytest.raises(ShrinkError, match=r"^ours tests colliders that came with the recording, which a test of two"):
        fault_of_run(opened, miss=1, label="ours", session=session, scene=other_scene)
