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
"""Of a cube beside one at 0: contacts at the frames 2 and 3, and at 7."""


@given(st.integers(1, 60), st.data())
def test_minimal_subset_keeps_exactly_the_necessary_faces(count, data):
    """A subset of ``count`` faces is still wrong if all of a random set of needed ones is in it."""
    needed = set(data.draw(st.lists(st.integers(0, count - 1), unique=True)))
    assert set(minimal_subset(np.arange(count), lambda kept: needed <= set(kept.tolist())).tolist()) == needed


@given(st.integers(1, 25), st.integers(0, 2**32))
def test_nothing_left_can_be_removed_alone_despite_chance(count, seed):
    """Whether a subset is still wrong is drawn at random, 4 of 10, and remembered."""
    random = np.random.default_rng(seed)
    known = {tuple(range(count)): True}

    def stands(kept):
        return known.setdefault(tuple(kept.tolist()), bool(random.random() < 0.4))

    left = minimal_subset(np.arange(count), stands)
    assert stands(left)
    assert not any(stands(np.delete(left, item)) for item in range(len(left)))


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    """A run of ten frames, whose ``slow`` samples at 25 Hz."""
    at = tmp_path_factory.mktemp("shrink")
    write_session(unit_cubes_on_x({"a": [0] * 10, "b": X_OF_SECOND_CUBE}), at / "s.mcap")
    detectors = "slow=discrete[rate_hz=25],exact2=hybrid"
    run(at / "s.mcap", detectors=detectors, out=at / "run", picture=False)
    return at / "run"


def shrunk_fault(fault):
    """The wrong answer when nothing more can be left out of it."""
    shrinking = Shrinking(fault)
    done = shrinking.run()
    assert done.is_reproduced() and shrinking.questions > 0
    return done


def nothing_can_go(fault):
    """By asking for less in all ways there are, one frame and one face at a time."""
    count = len(fault.motion)
    for frame in range(count - 1):
        yield replace(fault, motion=fault.motion.take(np.delete(np.arange(count), frame)))
    for end in fault.pairs[0].tolist():
        body = fault.bodies[end]
        for face in range(len(body.mesh.faces) if len(body.mesh.faces) > 1 else 0):
            mesh = TriangleMesh(body.mesh.vertices, np.delete(body.mesh.faces, face, axis=0))
            bodies = (*fault.bodies[:end], replace(body, mesh=mesh), *fault.bodies[end + 1 :])
            yield replace(fault, bodies=bodies)


def test_miss_between_samples_ends_at_two_frames_and_two_faces(run_folder):
    """``slow`` samples frames 0, 4 and 8 and misses frames 2 and 3: it needs a frame with a sample, one of contact.

    No frame or face can be left out of what remains without it being right, or in new doubt.
    """
    fault = fault_of_run(read_run_folder(run_folder), miss=1, label="slow")
    done = shrunk_fault(fault)
    assert fault.contact and Size.of(done) == Size(frames=2, bodies=2, faces=(2, 2))
    assert not any(item.is_reproduced() and doubts_of(item) <= doubts_of(done) for item in nothing_can_go(done))
    assert dict(done.settings) == {"rate_hz": 25} and "discrete[rate_hz=25] misses a contact" in sentence(done)


def test_false_contact_is_shrunk_by_number_after_a_correct_start(tmp_path):
    """Contact at the frames 2 to 6; looks at 0, 4 and 8: what is said of 4 is held and false at 7."""
    write_session(unit_cubes_on_x({"a": [0] * 10, "b": [3, 3, 0.9, 0.9, 0.9, 0.9, 0.9, 3, 3, 3]}), tmp_path / "s.mcap")
    run(tmp_path / "s.mcap", detectors="slow=discrete[rate_hz=25]", out=tmp_path / "run", picture=False)
    opened = read_run_folder(tmp_path / "run")
    assert [(row["number"], row["first"], row["last"]) for row in opened.rows("false")] == [(1, 7, 7)]
    fault = fault_of_run(opened, false=1)
    assert not fault.contact and fault.motion.times[-1] == pytest.approx(0.07)
    assert main(["shrink", str(tmp_path / "run"), "--false", "1", "--out", str(tmp_path / "case")]) == 0
    assert "false contact 1" in (tmp_path / "case" / "README.md").read_text(encoding="utf-8")
    with pytest.raises(ShrinkError, match=r"has no false contact 2$"):
        fault_of_run(opened, false=2)


def test_pair_answered_correctly_alone_is_queried_first(tmp_path):
    """The planted detector misses a and b only while others move; the case keeps all three pairs."""
    write_session(
        unit_cubes_on_x({"a": [0, 0, 0, 0.01], "b": [3, 0.9, 3, 3], "c": [9, 9, 9, 8.99]}), tmp_path / "s.mcap"
    )
    name = "support.planted_detectors:Distracted"
    run(tmp_path / "s.mcap", detectors=name, out=tmp_path / "run", picture=False)
    fault = fault_of_run(read_run_folder(tmp_path / "run"), miss=1, label=name)
    assert fault.pairs.tolist() == [[0, 1], [0, 2], [1, 2]]


def test_closed_body_becomes_the_hull_of_fewest_corners():
    """A tetrahedron with a fifth corner holds a small box; no face may go, but the fifth corner may."""
    corners = np.array([[4, 4, 4], [-4, -4, 4], [-4, 4, -4], [4, -4, -4], [3, 3, -3]], dtype=float)
    bodies = (Body("out", hull_of(corners)), Body("in", box_mesh([0.1] * 3)))
    motion = Motion([0.0], np.zeros((1, 2, 3)), np.tile(np.eye(3), (1, 2, 1, 1)))
    fault = WrongAnswer("hybrid", {"containment": False}, "exact", bodies, motion, np.array([[0, 1]]), contact=True)
    assert Size.of(fault).faces == (6, 12)
    assert Size.of(shrunk_fault(fault)).faces == (4, 1)


@pytest.mark.slow
def test_contained_body_is_shrunk_to_a_tetrahedron():
    """The inner box needs one face and the outer four to stay contained."""
    bodies = tuple(Body(name, box_mesh([edge] * 3)) for name, edge in (("out", 4.0), ("in", 1.0)))
    rotated = rotation_from_quaternion(np.tile([0.1, 0.2, 0.3, 0.9], (3, 2, 1)))
    motion = Motion(np.arange(3) / 100.0, np.zeros((3, 2, 3)), rotated)
    done = shrunk_fault(
        WrongAnswer("hybrid", {"containment": False}, "exact", bodies, motion, np.array([[0, 1]]), contact=True)
    )
    assert Size.of(done) == Size(frames=1, bodies=2, faces=(4, 1))
    assert (done.motion.rotations == np.eye(3)).all()


def test_written_test_fails_on_its_detector_and_passes_on_another(run_folder, tmp_path, capsys, monkeypatch, snapshot):
    """The written test asks the detector that DETECTOR names, else the one with the fault, a ``discrete``."""
    out = tmp_path / "case"
    assert (
        main(["shrink", str(run_folder), "--miss", "1", "--detector", "slow", "-o", str(out), "--format", "json"]) == 0
    )
    assert json.loads(capsys.readouterr().out)["after"] == "2 frames x 2 x 2 faces of 2 bodies"
    assert {file.name: file.read_text() for file in sorted(out.iterdir()) if file.suffix != ".py"} == snapshot
    for name, right in ((None, False), ("exact", True), ("hybrid", True), ("discrete", False)):
        monkeypatch.setenv("DETECTOR", name) if name else monkeypatch.delenv("DETECTOR", raising=False)
        test = runpy.run_path(str(out / "test_case.py"))["test_the_last_frame_is_answered_rightly"]
        with nullcontext() if right else pytest.raises(AssertionError):
            test()


def test_written_numbers_read_back_bit_for_bit(run_folder, tmp_path):
    """Numbers with 17 digits, of very different sizes, in times, positions and vertices of a written test."""
    fault = fault_of_run(read_run_folder(run_folder), miss=1, label="slow")
    odd = fault.motion.translations + np.array([1 / 3, 1e-17, -(2.0**-60)])
    motion = Motion(fault.motion.times + 1 / 7, odd, fault.motion.rotations)
    fault = replace(fault, motion=motion)
    read = runpy.run_path(str(write_case(fault, Size.of(fault), tmp_path / "c", source="a test") / "test_case.py"))
    again = read["motion"](2)
    for name in ("times", "translations"):
        assert getattr(again, name).tobytes() == getattr(motion, name).tobytes()
    assert read["body"]("a", "body-1.obj").mesh.vertices.tobytes() == fault.bodies[0].mesh.vertices.tobytes()


def test_unshrinkable_answer_is_explained_in_a_sentence(run_folder, tmp_path, capsys):
    """No such detector, no such fault, no fault named on the command line, or another recording."""
    opened = read_run_folder(run_folder)
    for requested, text in (
        ({"miss": 1, "label": "hybrid"}, "audited no hybrid; it audited: slow, exact2"),
        ({"miss": 1, "label": "exact2"}, "has no miss 1 of exact2"),
        ({"false": 9, "label": "slow"}, "has no false contact 9 of slow"),
    ):
        with pytest.raises(ShrinkError, match=text):
            fault_of_run(opened, **requested)
    assert main(["shrink", str(run_folder)]) == 2
    assert "--miss N or --false N" in capsys.readouterr().err
    moved = Path(shutil.copytree(run_folder, tmp_path / "run"))
    tamper(moved, "session", digest="0" * 64)
    with pytest.raises(RunFolderError, match=r"the recording .* is not beside it; say where: --session"):
        fault_of_run(read_run_folder(moved), miss=1, label="slow")
    with pytest.raises(RunFolderError, match="is not the recording"):
        fault_of_run(read_run_folder(moved), miss=1, label="slow", session=run_folder.parent / "s.mcap")


def test_run_with_another_scene_is_shrunk_with_that_scene(run_folder, tmp_path):
    """The other scene gives body b a box of 0.9 m in place of its mesh."""
    session, scene = run_folder.parent / "s.mcap", tmp_path / "other.toml"
    scene.write_text('[[body]]\nid = "a"\n[[body]]\nid = "b"\nshape = "box"\nsize = [0.9, 0.9, 0.9]\n')
    requested = "slow=discrete[rate_hz=25],ours=collider[shape=shipped,rate_hz=25]"
    run(session, detectors=requested, scene=scene, out=tmp_path / "run", picture=False)
    made = read_run_folder(tmp_path / "run")
    with pytest.raises(RunFolderError, match=r"run replayed with the scene of other.toml; give it with --scene FILE$"):
        fault_of_run(made, miss=1, label="slow", session=session)
    fault = fault_of_run(made, miss=1, label="slow", session=session, scene=scene)
    assert [len(body.mesh.faces) for body in fault.bodies] == [12, 12] and fault.is_reproduced()
    assert np.ptp(fault.bodies[1].mesh.vertices[:, 0]) == pytest.approx(0.9)
    with pytest.raises(ShrinkError, match=r"^ours tests colliders that came with the recording, which a test of two"):
        fault_of_run(made, miss=1, label="ours", session=session, scene=scene)
