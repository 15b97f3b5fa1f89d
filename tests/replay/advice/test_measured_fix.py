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
    """A rod that stirs in a beaker in 60 frames: at its wall in 3 of 15, or those ``touching``, else in its middle.

    The hull of the beaker is full, so that it reports contact in all frames.
    """
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
    """A run that measures a Fix of its detector ``subject``, and a run with the Fix's setting as a detector ``fixed``.

    The Fix of a detector with false contact is to cut bodies into convex pieces; ``measured``: it was tried on the
    session, within 60 s.
    """
    session = stirring_session(BEAKER)
    measured = run(session, detectors=f"subject={request.param},exact", fix_time=60)
    setting = measured.answers[0].fix.setting
    return measured, run(session, detectors=f"fixed={setting},subject={request.param},exact")


def test_sentence_of_a_measured_fix_has_figures_of_its_repetition(measured_and_repeated):
    """A rod stirs in a beaker whose hull is full. A run advises convex pieces of it, with the change that it measured.

    A second run has this advice as a detector ``fixed`` beside the hulls (``subject``): rows of both in its ranking
    give the same text.
    """
    measured, repeated = measured_and_repeated
    fix = measured.answers[0].fix
    rank_of_label = {rank.label: rank for rank in repeated.ranking}
    before, after = (errors_of_rank(rank_of_label[label], seconds=None) for label in ("subject", "fixed"))
    pieces = len(repeated.detectors["fixed"].parts["beaker"])
    assert fix.measured
    assert fix.text.startswith(f"Split beaker into {pieces} convex pieces")
    assert fix.change.startswith(change_text(before, after))


def test_row_of_a_measured_fix_is_that_of_its_repetition(measured_and_repeated):
    """A measured Fix has a row in the ranking of its run, beside the detector ``subject`` that it mends.

    A second run has the Fix's setting as a detector ``fixed``, which has the same row, and less loss than ``subject``.
    """
    measured, repeated = measured_and_repeated
    fix = measured.answers[0].fix
    rank_of_label = {rank.label: rank for rank in repeated.ranking}
    subject, fixed = rank_of_label["subject"], rank_of_label["fixed"]
    row = fixed_rank(subject, fix.figures, fix.setting, measured.document)
    counts = ("missed", "late_or_cut_short", "time_missed", "missed_counts", "late_counts", "false", "loss", "phases")
    for count in counts:
        assert getattr(row, count) == getattr(fixed, count), count
    assert fixed.loss < subject.loss


@pytest.mark.parametrize(
    ("kind", "outcome_code"),
    [pytest.param("right", Outcome.BOTH, id="right"), pytest.param("false", Outcome.FALSE_CONTACT, id="false")],
)
def test_intervals_of_a_measured_fix_are_those_of_its_repetition(measured_and_repeated, kind, outcome_code):
    """A measured Fix has intervals in which it is right or false, for its lane over time.

    A frame is in one exactly if the detector ``fixed`` of a second run, which has the Fix's setting, has that outcome.
    The last frame has no length, so it is in none.
    """
    measured, repeated = measured_and_repeated
    intervals = measured.answers[0].fix.figures.spans[kind]
    times, outcome = repeated.assembly.motion.times[:-1], repeated.comparisons["fixed"].outcome[:-1]
    in_interval = [any(start <= time < end for start, end in intervals) for time in times]
    assert np.array_equal(in_interval, (outcome == outcome_code).any(axis=1))


def test_document_of_a_run_has_the_measured_fix(measured_and_repeated):
    """A run measured a Fix of its detector. Its document, which becomes summary.json, has the answers of its result."""
    measured, _repeated = measured_and_repeated
    assert measured.answers[0].fix.measured
    assert measured.document.answers == measured.answers


@pytest.fixture(scope="module")
def fix_of_short_touches():
    """The session of a rod that touches the beaker in four single frames of 10 ms, and the Fix of hulls at 50 Hz.

    A hull is in contact all the time and misses no touch; pieces at 50 Hz, every second frame, miss some.
    """
    session = stirring_session(BEAKER, touching=np.isin(np.arange(60), (15, 31, 47, 52)))
    return session, run(session, detectors="subject=hull50,exact", fix_time=60).answers[0].fix


def test_pieces_that_miss_more_are_advised_at_every_frame(fix_of_short_touches):
    """A rod touches a beaker in four single frames: pieces at 50 Hz would miss some, so the Fix has no step rate.

    Its note says what pieces at 50 Hz would miss.
    """
    _session, fix = fix_of_short_touches
    _note, trade = fix.notes.split(" At 50 Hz instead: ")
    assert fix.measured
    assert "rate_hz" not in fix.setting
    assert "but missed" not in fix.change
    assert "but missed" in trade


def test_figures_at_both_rates_are_those_of_a_repetition(fix_of_short_touches):
    """A second run has the advised pieces as a detector ``fixed``, and at 50 Hz as ``stepped``; ``subject`` has hulls.

    Text and note of the Fix have the figures of their rows.
    """
    session, fix = fix_of_short_touches
    at_50_hz = f"{fix.setting.removesuffix(']')},rate_hz=50]"
    repeated = run(session, detectors=f"fixed={fix.setting},stepped={at_50_hz},subject=hull50,exact")
    rank_of_label = {rank.label: rank for rank in repeated.ranking}
    before, after, stepped = (
        errors_of_rank(rank_of_label[label], seconds=None) for label in ("subject", "fixed", "stepped")
    )
    pieces = plural(len(repeated.detectors["fixed"].parts["beaker"]), "convex piece")
    assert fix.text == f"Split beaker into {pieces}, with one hull for every other body, and test every frame."
    assert fix.change.startswith(change_text(before, after))
    _note, trade = fix.notes.split(" At 50 Hz instead: ")
    assert trade.startswith(f"{change_text(before, stepped)}.")


@pytest.mark.slow
def test_name_of_any_characters_is_accepted_as_a_spec():
    """The beaker is called "a,b [c]+", by characters that separate settings; the Fix's setting names it.

    A second run takes that setting and cuts the body.
    """
    session = stirring_session(BEAKER, name="a,b [c]+")
    fix = run(session, detectors="subject=hull50,exact", fix_time=60).answers[0].fix
    repeated = run(session, detectors=f"fixed={fix.setting},exact")
    assert fix.measured
    assert len(repeated.detectors["fixed"].parts["a,b [c]+"]) > 1


@pytest.fixture(scope="module")
def unmeasured():
    """A run of a rod that stirs in a beaker, whose hull at 50 Hz is full: pieces are advised, without figures."""
    return compute(stirring_session(BEAKER), detectors="subject=hull50,exact")


def test_without_time_nothing_is_measured(unmeasured):
    """A rod stirs in a beaker; its hull, at 50 Hz (``hull50``), is full, so that pieces are advised, without figures.

    To measure them within 0 s leaves the result as it is.
    """
    assert not unmeasured.answers[0].fix.measured
    assert measured_fixes(unmeasured, 0.0, Silent()) is unmeasured


def test_fix_keeps_the_hull_of_a_mesh_with_holes():
    """A rod stirs in a beaker that lacks one face, so that it has no inside and cannot be cut: the Fix says why.

    ``hull50``: a detector of hulls at 50 Hz.
    """
    mesh_with_hole = TriangleMesh(BEAKER.vertices, BEAKER.faces[1:])
    fix = run(stirring_session(mesh_with_hole), detectors="subject=hull50,exact", fix_time=60).answers[0].fix
    assert not fix.measured
    assert fix.text.startswith("beaker keeps its hull: its surface has holes")


def test_bodies_that_are_not_cut_in_time_are_named(empty_piece_store, monkeypatch):
    """A rod stirs in a beaker. The program that would cut it into pieces sleeps for a minute; 0.3 s are allowed."""
    monkeypatch.setattr(piece_store, "CUTTING_PROGRAM", "import time; time.sleep(60)")
    fix = run(stirring_session(BEAKER), detectors="subject=hull50,exact", fix_time=0.3).answers[0].fix
    assert not fix.measured
    assert fix.text.startswith("Not reached within 300 ms: beaker (about ")


def test_bodies_whose_cutter_fails_are_named_with_the_reason(empty_piece_store, monkeypatch):
    """A rod stirs in a beaker. The program that would cut it into pieces ends with an error, not for lack of time."""
    monkeypatch.setattr(piece_store, "CUTTING_PROGRAM", "import sys; sys.exit(1)")
    fix = run(stirring_session(BEAKER), detectors="subject=hull50,exact", fix_time=60).answers[0].fix
    assert not fix.measured
    assert fix.text.startswith("beaker is not cut: sectors by height and angle cannot cut this mesh.")
    assert "Not reached" not in fix.text


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("fraction_in_run", "fraction_in_fix"),
    [
        pytest.param(1.0, 1.0, id="idle"),
        pytest.param(0.6, 1.0, id="busy in the run"),
        pytest.param(1.0, 0.6, id="busy as the fix is measured"),
    ],
)
def test_measured_fix_has_no_milliseconds_on_a_busy_machine(unmeasured, monkeypatch, fraction_in_run, fraction_in_fix):
    """Fractions are of the processor that detectors had while they were timed; at 0.6 other programs had 40 %.

    Then the change that a Fix promises names no milliseconds. A note of the Fix says so only if the machine was busy
    as the Fix was measured; other sentences of the run, not tested here, speak of a busy run.
    """
    document = unmeasured.document
    detectors = {
        label: structs.replace(row, seconds=structs.replace(row.seconds, processor_fraction=fraction_in_run))
        for label, row in document.detectors.items()
    }
    result = replace(unmeasured, document=structs.replace(document, detectors=detectors))
    run_detector = measured_fix.run_detector
    monkeypatch.setattr(
        measured_fix,
        "run_detector",
        lambda *args, **named: replace(run_detector(*args, **named), processor_fraction=fraction_in_fix),
    )
    (answer,) = measured_fixes(result, 60.0, Silent()).answers
    is_idle = fraction_in_run == fraction_in_fix == 1.0
    assert answer.fix.measured
    assert re.match(r"False \d+ % -> \d+ %", answer.fix.change)
    assert ("ms a frame" in answer.fix.change) == is_idle
    assert ("The machine was busy (40 %)" in answer.fix.notes) == (fraction_in_fix < 1.0)


@pytest.mark.slow
def test_fix_advises_no_pieces_as_wrong_as_the_hull(empty_piece_store, monkeypatch):
    """A rod stirs in a beaker, each piece of which is replaced by the hull of all: as wrong, so no Fix is advised."""
    beaker = revolved_mesh(BEAKER_OUTLINE, 12)
    result = compute(stirring_session(beaker), detectors="subject=hull50,exact")
    monkeypatch.setattr(piece_store, "within_triangles", lambda _piece: hull_of(beaker.vertices))
    (answer,) = measured_fixes(result, 60.0, Silent()).answers
    assert not answer.fix.measured
    assert answer.fix.text == "Convex pieces of beaker make it no better."
    assert "as before" in answer.fix.change


class NotedProgress:
    """Progress that notes each percentage that is reported, in order."""

    def __init__(self):
        self.percentages = []

    @contextmanager
    def stage(self, name, total=None, unit="frames"):
        yield self.percentages.append


def test_progress_of_a_fix_is_the_fraction_of_time_used(unmeasured):
    """A Fix is measured in a few of a million seconds, below 1 %: 0 % is reported until all is done, then 100 %."""
    progress = NotedProgress()
    measured_fixes(unmeasured, 1e6, progress)
    *while_measuring, last = progress.percentages
    assert set(while_measuring) == {0}
    assert last == 100


def test_only_bodies_that_are_not_convex_are_cut():
    """A cube in place of the beaker: its bounding sphere is wrong about the rod, but pieces of a cube are no better.

    So no Fix of pieces is measured.
    """
    session = stirring_session(BEAKER)
    meshes = {**session.meshes, "beaker": cube(edge=0.035)}
    result = compute(replace(session, meshes=meshes), detectors="subject=collider[shape=sphere,rate_hz=50],exact")
    (answer,) = measured_fixes(result, 60.0, Silent()).answers
    assert answer.fix is None or not answer.fix.measured


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "is_measured"),
    [pytest.param([], True, id="default"), pytest.param(["--fix-time", "0"], False, id="0 s")],
)
def test_the_command_line_gives_a_fix_time(options, is_measured, tmp_path, capsys):
    """``replay run`` measures a Fix unless ``--fix-time`` is 0; what it prints is read with all lines joined."""
    write_session(stirring_session(BEAKER), tmp_path / "s.mcap")
    assert main(["run", str(tmp_path / "s.mcap"), "--detectors", "hull50,exact", *options]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert ("In your engine, split beaker into" in printed) == is_measured
    assert bool(re.search(r"False \d+ % -> \d+ %", printed)) == is_measured


needs_the_cutters_of_shipped_pieces = pytest.mark.skipif(
    not all(
        any(piece_store.SHIPPED_FOLDER.glob(f"*-{method}-*-{version(package)}.npz"))
        for method, package in (("vhacd", "vhacdx"), ("coacd", "coacd"))
    ),
    reason="the shipped pieces are of other versions of vhacdx and coacd",
)


@pytest.fixture(scope="module")
def demo_meshes():
    """Name of each body of the demo -> its mesh."""
    session, _truth = synthetic_session("bench-bumps", seed=0, noise=None)
    return {name: TriangleMesh(mesh.vertices, mesh.faces) for name, mesh in session.meshes.items()}


@needs_the_cutters_of_shipped_pieces
@pytest.mark.slow
def test_bodies_of_the_demo_come_cut(demo_meshes):
    """Up to 4, 8, 16 and 32 pieces of each body of the demo are shipped with the program: cutting takes 0 s.

    So are 16 pieces by CoACD, which settings of engines have, of all but the headset, which is in no pair.
    ``auto``: by the quickest method that can cut the body; ``seconds``: how long a cut will take, by estimate.
    """
    cuts = [Cut(mesh, "auto", most_pieces) for mesh in demo_meshes.values() for most_pieces in (4, 8, 16, 32)]
    cuts += [Cut(mesh, "coacd", 16) for body, mesh in demo_meshes.items() if body != "headset"]
    assert {cut.seconds for cut in cuts} == {0.0}


def test_first_cut_of_a_fix_is_among_the_shipped_cuts():
    """A Fix tries up to 16 pieces first; bodies of the demo are shipped cut into up to 4, 8, 16 and 32."""
    assert measured_fix.FIRST_PIECE_COUNT == 16


@needs_the_cutters_of_shipped_pieces
@pytest.mark.slow
@pytest.mark.parametrize(("body", "method"), [("beaker", "auto"), ("hand-left", "auto"), ("cylinder", "coacd")])
def test_shipped_convex_pieces_equal_freshly_cut_pieces(
    body, method, demo_meshes, empty_piece_store, monkeypatch, tmp_path
):
    """A body of the demo in up to 16 pieces: those shipped with the program equal those cut where nothing is stored.

    ``auto``: by the quickest method that can cut the body.
    """
    cut = Cut(demo_meshes[body], method, 16)
    shipped = piece_store.convex_pieces(cut)
    monkeypatch.setattr(piece_store, "SHIPPED_FOLDER", tmp_path / "nothing")
    assert cut.seconds > 0
    freshly_cut = piece_store.convex_pieces(cut)
    assert [piece.content_hash for piece in freshly_cut] == [piece.content_hash for piece in shipped]


def test_bodies_whose_pieces_miss_more_stay_uncut(two_beakers, missing_pieces):
    """Two beakers in each of which a rod stirs; pieces planted for the second (``missing_pieces``) miss every contact.

    The Fix cuts the first only, and says so.
    """
    fix = run(two_beakers, detectors="subject=hull50,exact", fix_time=60).answers[0].fix
    assert fix.measured
    assert fix.text.startswith("Split beaker into ")
    assert "second stays whole: no better cut." in fix.notes
    assert ",cut=beaker" in fix.setting
    assert "second" not in fix.setting


@pytest.mark.slow
def test_good_pieces_of_both_bodies_are_advised(two_beakers):
    """Two beakers, "beaker" and "second", in each of which a rod stirs: both are to be cut."""
    fix = run(two_beakers, detectors="subject=hull50,exact", fix_time=60).answers[0].fix
    assert fix.measured
    assert re.match(r"Split beaker (into \d+ )?and second into ", fix.text)


def test_run_without_a_cutter_names_the_package_to_install(empty_piece_store, monkeypatch, tmp_path, capsys):
    """V-HACD alone could cut the beaker, which counts as not round; its package counts as not installed.

    ``replay run`` says why the beaker keeps its hull.
    """

    def raise_not_installed(package):
        raise PackageNotFoundError

    monkeypatch.setattr(methods, "version", raise_not_installed)
    monkeypatch.setattr(methods, "round_axis", lambda mesh: None)
    uncut_beaker = revolved_mesh(BEAKER_OUTLINE, 22)  # other tests cut one of 24 sides, whose pieces are in memory
    write_session(stirring_session(uncut_beaker), tmp_path / "s.mcap")
    assert main(["run", str(tmp_path / "s.mcap"), "--detectors", "hull50,exact", "--no-picture"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "beaker keeps its hull: V-HACD needs the package vhacdx, which is not installed (pip" in printed


@pytest.mark.parametrize("frame_count", [16 * 96, 16 * 96 + 1, 9999])
def test_pieces_are_timed_in_segments_spread_over_the_motion(frame_count):
    """To measure a Fix, 16 segments of 96 neighbouring frames are timed, the first and the last frame among them."""
    frames = timed_frames(frame_count)
    assert len(frames) == 16 * 96
    assert (frames[0], frames[-1]) == (0, frame_count - 1)
    assert (np.diff(frames.reshape(16, 96), axis=1) == 1).all()
