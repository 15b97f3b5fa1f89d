"""A Fix of colliders is measured on the session, gives its figures when asked again, and names what it could not do."""

import re
from contextlib import contextmanager
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version

import numpy as np
import pytest
from msgspec import structs
from support.shapes import revolved_mesh
from support.small_worlds import STEP_NS, cube

from cdcore import TriangleMesh
from cdcore.bounding.hull import hull_of
from replay.advice import measured_fix
from replay.advice.measured_fix import measured_fixes, timed_frames
from replay.auditing.outcome import Outcome
from replay.cli.main import main
from replay.cutting import methods, piece_store
from replay.cutting.piece_store import Cut
from replay.detection.progress import Silent
from replay.document.before_after import change_text, errors_of_rank
from replay.document.ranking import fixed_rank
from replay.engine import compute
from replay.running.runner import run
from replay.studies.synthetic_sessions import synthetic_session
from replay.words import plural
from sessions import MeshData, Session, write_session

# Outlines that `revolved_mesh` turns about an axis: (radius, height) in metres.
BEAKER_OUTLINE = [(0, 0), (0.035, 0), (0.035, 0.1), (0.033, 0.1), (0.033, 0.002), (0, 0.002)]
ROD_OUTLINE = [(0, 0), (0.003, 0), (0.003, 0.2), (0, 0.2)]


@pytest.fixture
def empty_piece_store(monkeypatch, tmp_path):
    """No pieces are kept yet, and none that this test makes are used by another one."""
    monkeypatch.setattr(piece_store, "cache_folder", lambda: tmp_path / "cache")


def stirring_session(beaker, name="beaker", touching=None):
    """A rod that stirs in a beaker: free in its middle most of the time, at its wall now and then."""
    meshes = {name: beaker, "rod": revolved_mesh(ROD_OUTLINE, 8)}
    axis = int(np.argmax(np.ptp(beaker.vertices, axis=0)))
    count, side = 60, (axis + 1) % 3
    positions = {body: np.zeros((count, 3)) for body in meshes}
    positions["rod"][:, axis] = 0.05
    positions["rod"][:, side] = np.where(
        np.arange(count) % 15 < 3 if touching is None else touching, 0.031, 0.001 * (np.arange(count) % 15)
    )
    still = np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))
    poses = {body: (position, still) for body, position in positions.items()}
    data = {body: MeshData(mesh.vertices, mesh.faces) for body, mesh in meshes.items()}
    return Session.from_arrays(np.arange(count) * STEP_NS, poses, data)


BEAKER = revolved_mesh(BEAKER_OUTLINE, 24)


@pytest.fixture(
    scope="module",
    params=[
        "hull50",
        *(
            pytest.param(subject, marks=pytest.mark.slow)
            for subject in ("collider[shape=hull]", "collider[shape=box,rate_hz=50]")
        ),
    ],
)
def measured_and_repeated(request):
    """A run that measures a Fix of detector ``subject``, and a run whose detector ``fixed`` has the Fix's setting."""
    session = stirring_session(BEAKER)
    measured = run(session, detectors=f"subject={request.param},exact", fix_time=60)
    setting = measured.answers[0].fix.setting
    return measured, run(session, detectors=f"fixed={setting},subject={request.param},exact")


def test_sentence_of_a_measured_fix_has_figures_of_its_repetition(measured_and_repeated):
    """The second run has the advised setting as a detector ``fixed``: both rows of its ranking give the text."""
    measured, repeated = measured_and_repeated
    fix = measured.answers[0].fix
    ranks = {rank.label: rank for rank in repeated.ranking}
    before, after = (errors_of_rank(ranks[label], seconds=None) for label in ("subject", "fixed"))
    pieces = len(repeated.detectors["fixed"].parts["beaker"])
    assert fix.measured and fix.text.startswith(f"Split beaker into {pieces} convex pieces")
    assert fix.change.startswith(change_text(before, after))


def test_row_of_a_measured_fix_is_that_of_its_repetition(measured_and_repeated):
    """The row beside the mended detector, and it is better than that of the detector."""
    measured, repeated = measured_and_repeated
    fix = measured.answers[0].fix
    ranks = {rank.label: rank for rank in repeated.ranking}
    row = fixed_rank(ranks["subject"], fix.figures, fix.setting, measured.document)
    for field in (
        "missed", "late_or_cut_short", "time_missed", "missed_counts", "late_counts", "false", "loss", "phases",
    ):  # fmt: skip
        assert getattr(row, field) == getattr(ranks["fixed"], field), field
    assert ranks["fixed"].loss < ranks["subject"].loss


def test_intervals_of_a_measured_fix_are_those_of_its_repetition(measured_and_repeated):
    """The last frame has no length: it is in no interval."""
    measured, repeated = measured_and_repeated
    intervals = measured.answers[0].fix.figures.spans
    times, outcome = repeated.assembly.motion.times[:-1], repeated.comparisons["fixed"].outcome[:-1]
    for kind, code in (("right", Outcome.BOTH), ("false", Outcome.FALSE_CONTACT)):
        in_interval = [any(start <= time < end for start, end in intervals[kind]) for time in times]
        assert np.array_equal(in_interval, (outcome == code).any(axis=1)), kind


def test_document_of_a_run_has_the_measured_fix(measured_and_repeated):
    """The document becomes summary.json; the caller of ``run`` gets the same answers."""
    measured, _ = measured_and_repeated
    assert measured.answers[0].fix.measured
    assert measured.document.answers == measured.answers


def test_pieces_that_miss_more_are_advised_at_every_frame():
    """A hull is in contact all the time and misses no touch; pieces at 50 Hz miss touches of one frame of 11 ms."""
    touching = np.isin(np.arange(60), (15, 31, 47, 52))
    session = stirring_session(BEAKER, touching=touching)
    first = run(session, detectors="subject=hull50,exact", fix_time=60)
    fix = first.answers[0].fix
    _, trade = fix.notes.split(" At 50 Hz instead: ")
    assert "but missed" in trade and "but missed" not in fix.change and "rate_hz" not in fix.setting
    again = run(session, detectors=f"it={fix.setting},stepped={fix.setting[:-1]},rate_hz=50],subject=hull50,exact")
    ranks = {rank.label: rank for rank in again.ranking}
    before, after, stepped = (errors_of_rank(ranks[label], seconds=None) for label in ("subject", "it", "stepped"))
    pieces = plural(len(again.detectors["it"].parts["beaker"]), "convex piece")
    assert (
        fix.measured
        and fix.text == f"Split beaker into {pieces}, with one hull for every other body, and test every frame."
    )
    assert fix.change.startswith(change_text(before, after))
    assert trade.startswith(f"{change_text(before, stepped)}.")


@pytest.mark.slow
def test_name_of_any_characters_is_accepted_as_a_spec():
    """The beaker is called by characters that separate settings."""
    first = run(stirring_session(BEAKER, "a,b [c]+"), detectors="subject=hull50,exact", fix_time=60)
    fix = first.answers[0].fix
    again = run(stirring_session(BEAKER, "a,b [c]+"), detectors=f"it={fix.setting},exact")
    assert fix.measured and len(again.detectors["it"].parts["a,b [c]+"]) > 1


def test_without_time_nothing_is_measured():
    """The fix is advised without figures, and 0 s leave the result as it is."""
    result = compute(stirring_session(BEAKER), detectors="subject=hull50,exact")
    assert not result.answers[0].fix.measured
    assert measured_fixes(result, 0.0, Silent()) is result


def test_fix_keeps_the_hull_of_a_mesh_with_holes():
    """The beaker lacks one face."""
    holed = TriangleMesh(BEAKER.vertices, BEAKER.faces[1:])
    result = run(stirring_session(holed), detectors="subject=hull50,exact", fix_time=60)
    fix = result.answers[0].fix
    assert not fix.measured and fix.text.startswith("beaker keeps its hull: its surface has holes")


def test_bodies_that_are_not_cut_in_time_are_named(empty_piece_store, monkeypatch):
    """The cutting program sleeps for a minute; 0.3 s are allowed."""
    monkeypatch.setattr(piece_store, "CUTTING_PROGRAM", "import time; time.sleep(60)")
    result = run(stirring_session(BEAKER), detectors="subject=hull50,exact", fix_time=0.3)
    fix = result.answers[0].fix
    assert not fix.measured and fix.text.startswith("Not reached within 300 ms: beaker (about ")


def test_bodies_whose_cutter_fails_are_named_with_the_reason(empty_piece_store, monkeypatch):
    """The cutting program ends with an error."""
    monkeypatch.setattr(piece_store, "CUTTING_PROGRAM", "import sys; sys.exit(1)")
    fix = run(stirring_session(BEAKER), detectors="subject=hull50,exact", fix_time=60).answers[0].fix
    assert not fix.measured and "Not reached" not in fix.text
    assert fix.text.startswith("beaker is not cut: sectors by height and angle cannot cut this mesh.")


@pytest.mark.sampled(3)
@pytest.mark.parametrize("busy", ["nobody", "run", "fix"])
def test_measured_fix_has_no_milliseconds_on_a_busy_machine(monkeypatch, busy):
    """Other programs had 40 % of the clock while the run or its fix was timed."""
    result = compute(stirring_session(BEAKER), detectors="subject=hull50,exact")
    document = result.document
    detectors = {
        label: structs.replace(
            row, seconds=structs.replace(row.seconds, processor_fraction=0.6 if busy == "run" else 1.0)
        )
        for label, row in document.detectors.items()
    }
    result = replace(result, document=structs.replace(document, detectors=detectors))
    original = measured_fix.run_detector
    monkeypatch.setattr(
        measured_fix,
        "run_detector",
        lambda *args, **named: replace(original(*args, **named), processor_fraction=0.6 if busy == "fix" else 1.0),
    )
    (answer,) = measured_fixes(result, 60.0, Silent()).answers
    assert answer.fix.measured and re.match(r"False \d+ % -> \d+ %", answer.fix.change)
    assert ("ms a frame" in answer.fix.change) == (busy == "nobody")
    # The cost of a busy run says so; of a run on an idle machine nothing does but the fix.
    assert ("The machine was busy (40 %)" in answer.fix.notes) == (busy == "fix")


@pytest.mark.slow
def test_fix_advises_no_pieces_as_wrong_as_the_hull(empty_piece_store, monkeypatch):
    """A hull of the beaker in place of its pieces is as wrong as its hull."""
    beaker = revolved_mesh(BEAKER_OUTLINE, 12)
    result = compute(stirring_session(beaker), detectors="subject=hull50,exact")
    monkeypatch.setattr(piece_store, "within_triangles", lambda _piece: hull_of(beaker.vertices))
    (answer,) = measured_fixes(result, 60.0, Silent()).answers
    assert not answer.fix.measured
    assert answer.fix.text == "Convex pieces of beaker make it no better." and "as before" in answer.fix.change


class Percents:
    """Progress that keeps the percents that are reported, one after the other."""

    def __init__(self):
        self.reported = []

    @contextmanager
    def stage(self, name, total=None, unit="frames"):
        yield self.reported.append


def test_progress_of_a_fix_is_the_fraction_of_time_used():
    """A few of a million seconds are used: 0 %, until all is done."""
    progress = Percents()
    measured_fixes(compute(stirring_session(BEAKER), detectors="subject=hull50,exact"), 1e6, progress)
    assert {*progress.reported[:-1]} == {0} and progress.reported[-1] == 100


def test_only_bodies_that_are_not_convex_are_cut():
    """A cube in place of the beaker: its ball is wrong, but no pieces of a cube are better."""
    session = stirring_session(BEAKER)
    meshes = {**session.meshes, "beaker": cube(edge=0.035)}
    result = compute(replace(session, meshes=meshes), detectors="subject=collider[shape=sphere,rate_hz=50],exact")
    (answer,) = measured_fixes(result, 60.0, Silent()).answers
    assert answer.fix is None or not answer.fix.measured


@pytest.mark.slow
def test_the_command_line_gives_a_fix_time(tmp_path, capsys):
    """By default a fix is measured; with ``--fix-time 0`` none is."""
    write_session(stirring_session(BEAKER), tmp_path / "s.mcap")
    assert main(["run", str(tmp_path / "s.mcap"), "--detectors", "hull50,exact"]) == 0
    output = " ".join(capsys.readouterr().out.split())
    assert "Do In your engine, split beaker into" in output
    assert re.search(r"False \d+ % -> \d+ %", output)
    assert main(["run", str(tmp_path / "s.mcap"), "--detectors", "hull50,exact", "--fix-time", "0"]) == 0
    assert "split beaker into" not in " ".join(capsys.readouterr().out.lower().split())


THIS_CUTTER = pytest.mark.skipif(
    not any(piece_store.SHIPPED_FOLDER.glob(f"*-vhacd-*-{version('vhacdx')}.npz")),
    reason="the shipped pieces are of another version of vhacdx",
)


@THIS_CUTTER
@pytest.mark.slow
def test_bodies_of_the_demo_come_cut():
    """Pieces that are shipped with the program take no seconds."""
    session, _ = synthetic_session("bench-bumps", seed=0, noise=None)
    assert measured_fix.FIRST_PIECE_COUNT == 16
    for mesh in session.meshes.values():
        cuts = [Cut(TriangleMesh(mesh.vertices, mesh.faces), "auto", most) for most in (4, 8, 16, 32)]
        assert [cut.seconds for cut in cuts] == [0.0] * 4


@THIS_CUTTER
@pytest.mark.slow
def test_shipped_convex_pieces_equal_freshly_cut_pieces(empty_piece_store, monkeypatch, tmp_path):
    """Beaker and left hand of the demo, up to 8 pieces, by their hashes."""
    session, _ = synthetic_session("bench-bumps", seed=0, noise=None)
    for name in ("beaker", "hand-left"):
        mesh = session.meshes[name]
        cut = Cut(TriangleMesh(mesh.vertices, mesh.faces), "auto", 8)
        shipped = piece_store.convex_pieces(cut)
        with monkeypatch.context() as patch:
            patch.setattr(piece_store, "SHIPPED_FOLDER", tmp_path / "nothing")
            assert cut.seconds > 0, "nothing is kept: it has to be cut"
            freshly_cut = piece_store.convex_pieces(cut)
        assert [piece.content_hash for piece in freshly_cut] == [piece.content_hash for piece in shipped]


def test_bodies_whose_pieces_miss_more_stay_uncut(two_beakers, missing_pieces):
    """Pieces planted for the second beaker miss every contact."""
    result = run(two_beakers, detectors="subject=hull50,exact", fix_time=60)
    fix = result.answers[0].fix
    assert fix.measured and fix.text.startswith("Split beaker into ")
    assert "second stays whole: no better cut." in fix.notes
    assert ",cut=beaker" in fix.setting and "second" not in fix.setting


@pytest.mark.slow
def test_good_pieces_of_both_bodies_are_advised(two_beakers):
    """Both beakers, without the planted pieces of the test above."""
    fix = run(two_beakers, detectors="subject=hull50,exact", fix_time=60).answers[0].fix
    assert fix.measured and re.match(r"Split beaker (into \d+ )?and second into ", fix.text)


def test_run_without_a_cutter_names_the_package_to_install(empty_piece_store, monkeypatch, tmp_path, capsys):
    """Only V-HACD is left to cut the beaker: it counts as not round, and the packages of all cutters as absent."""

    def raise_not_installed(package):
        raise PackageNotFoundError

    monkeypatch.setattr(methods, "version", raise_not_installed)
    monkeypatch.setattr(methods, "round_axis", lambda mesh: None)
    uncut_beaker = revolved_mesh(BEAKER_OUTLINE, 22)  # other tests cut one of 24 sides, whose pieces are in memory
    write_session(stirring_session(uncut_beaker), tmp_path / "s.mcap")
    assert main(["run", str(tmp_path / "s.mcap"), "--detectors", "hull50,exact", "--no-picture"]) == 0
    output = " ".join(capsys.readouterr().out.split())
    assert "beaker keeps its hull: V-HACD needs the package vhacdx, which is not installed (pip" in output


@pytest.mark.parametrize("count", [1536, 1537, 9999])
def test_pieces_are_timed_in_segments_spread_over_the_motion(count):
    """At most 16 segments of 96 neighbouring frames, the first and the last frame among them."""
    frames = timed_frames(count)
    assert (len(frames), frames[0], frames[-1]) == (1536, 0, count - 1)
    assert (np.diff(frames.reshape(16, 96), axis=1) == 1).all()
