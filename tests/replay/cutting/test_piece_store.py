"""Convex pieces stand for a mesh: closed, few, always the same, kept where a user's programs keep what they made."""

import subprocess
import time
from importlib.metadata import PackageNotFoundError
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
from support.shapes import box_mesh, merge_meshes, revolved_mesh, shift_mesh
from trimesh.creation import icosphere

from cdcore import Body, TriangleMesh
from cdcore.bounding.hull import hull_collider, hull_of
from cdcore.containment.closed_parts import parity_is_inside
from cdcore.detectors.collider import CUT_METHODS, ColliderSettings
from cdcore.errors import InvalidSettingError
from replay.cutting import compound, methods, piece_store
from replay.cutting.compound import names_as_setting, with_pieces
from replay.cutting.convex_solids import MOST_TRIANGLES, outside_by, union_of, volume_of
from replay.cutting.methods import AUTO_METHOD, METHODS
from replay.cutting.piece_store import Cut, NotCut, convex_pieces, cut_ahead, why_not_cut
from replay.detection.detector_spec import parse_detector
from replay.errors import CutError
from sessions.glassware.catalogue import make_instrument

RIM, INNER, OUTER, FLOOR = 0.1, 0.033, 0.035, 0.002
PROFILE = [(0, 0), (OUTER, 0), (OUTER, RIM), (INNER, RIM), (INNER, FLOOR), (0, FLOOR)]
BEAKER = revolved_mesh(PROFILE, 12)
"""A closed mesh with 12 sides, of (radius, height) in metres: hollow above a floor of 2 mm."""
HALF_BEAKER = TriangleMesh(BEAKER.vertices, BEAKER.faces[: len(BEAKER.faces) // 2])
EDGES_OF_BOX = (0.1, 0.05, 0.2)
TWO_BOXES = merge_meshes(box_mesh(EDGES_OF_BOX), shift_mesh(box_mesh(EDGES_OF_BOX), (0.3, 0.0, 0.0)))
"""Two boxes 0.2 m apart, which planes cut into two pieces in no time."""
PAIR = np.array([[0, 1]])
"""The first body of a list with the second."""
FLAT = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
"""A triangle."""


def ball_of(subdivisions):
    """A ball of 20 faces, each cut into four so many times."""
    ball = icosphere(subdivisions=subdivisions)
    return TriangleMesh(ball.vertices, ball.faces)


@pytest.fixture
def empty_cache(monkeypatch, tmp_path):
    """The folder in which pieces are stored, of this test alone and empty; nothing is remembered either."""
    monkeypatch.setattr(piece_store, "in_memory", {})
    monkeypatch.setattr(piece_store, "cache_folder", lambda: tmp_path / "cache")
    return tmp_path / "cache"


def hashes(pieces):
    """Hashes of the contents of pieces."""
    return [piece.content_hash for piece in pieces]


def test_cutter_table_has_a_row_for_every_method():
    """The methods that the setting of a collider allows are those of the table of cutters, and ``auto``."""
    assert set(CUT_METHODS) == {AUTO_METHOD, *METHODS}


METHODS_THAT_COVER = ("hull", "box", "sectors", "planes", "coacd")


@pytest.mark.parametrize(
    "method",
    [pytest.param(name, marks=() if name in ("hull", "box") else pytest.mark.slow) for name in METHODS],
)
def test_pieces_of_each_method_are_closed_few_and_repeat(method, monkeypatch, tmp_path):
    """At most eight pieces of a beaker, or one by a method that makes one, and the same when they are cut again.

    All are closed with outward faces, and within the 255 triangles of engines; some methods cover it to 0.5 mm.
    """
    cut = Cut(BEAKER, method, most=8)
    pieces = convex_pieces(cut)
    monkeypatch.setattr(piece_store, "cache_folder", lambda: tmp_path / "cache")
    assert hashes(convex_pieces(cut)) == hashes(pieces)
    assert 1 <= len(pieces) <= (8 if METHODS[method].counts else 1)
    assert all(piece.is_closed and volume_of(piece) > 0 for piece in pieces)
    assert max(len(piece.faces) for piece in pieces) <= MOST_TRIANGLES == 255
    assert union_of(pieces).is_closed and parity_is_inside(union_of(pieces))
    assert outside_by(BEAKER, pieces) < 5e-4 or method not in METHODS_THAT_COVER


@pytest.mark.parametrize(
    "method", ["sectors", *(pytest.param(name, marks=pytest.mark.slow) for name in ("vhacd", "coacd"))]
)
def test_cut_pieces_leave_the_hollow_of_a_beaker_free(method):
    """At most 16 pieces have less than 0.6 of the volume of the hull, which fills the hollow."""
    (hull,) = convex_pieces(Cut(BEAKER, "hull", most=1))
    pieces = convex_pieces(Cut(BEAKER, method, most=16))
    assert volume_of(union_of(pieces)) < 0.6 * volume_of(hull)


def times_written(folder):
    """When each file of a folder was written."""
    return {file: file.stat().st_mtime_ns for file in folder.iterdir()}


def test_pieces_are_cut_once_and_anew_where_files_are_damaged(empty_cache, monkeypatch):
    """A process cuts two boxes by planes; the second time what it stored is only read: no file is written anew.

    Then every file is cut short to 100 bytes: all are written anew, with the same pieces.
    """
    cut = Cut(TWO_BOXES, "planes", most=16)
    with monkeypatch.context() as patch:
        patch.setattr(piece_store, "subprocess", subprocess)  # else pieces are cut in the process of the tests
        pieces = convex_pieces(cut)
    assert [volume_of(piece) for piece in pieces] == pytest.approx([np.prod(EDGES_OF_BOX)] * 2)
    written = times_written(empty_cache)
    assert written
    assert hashes(convex_pieces(cut)) == hashes(pieces)
    assert times_written(empty_cache) == written
    for file in empty_cache.iterdir():
        file.write_bytes(file.read_bytes()[:100])
    damaged = times_written(empty_cache)
    assert hashes(convex_pieces(cut)) == hashes(pieces)
    remade = times_written(empty_cache)
    assert remade.keys() == damaged.keys()
    assert [file.name for file in damaged if remade[file] == damaged[file]] == []


def test_cut_is_ready_when_its_pieces_are_stored(empty_cache, monkeypatch):
    """Planes cut two boxes once for every number of pieces: once 16 were cut, 2 are ready; those of V-HACD are not.

    ``seconds``: about how long the work takes that is left. The program that cuts leaves an empty file here, and
    ``cut_ahead`` returns the cuts that it could not make: none.
    """
    monkeypatch.setattr(piece_store, "CUTTING_PROGRAM", "import sys; open(sys.argv[4], 'wb')")
    cut = Cut(TWO_BOXES, "planes", most=16)
    assert cut.seconds > 0 and not cut.is_ready
    assert cut_ahead([cut]) == {}
    for stored in (cut, Cut(TWO_BOXES, "planes", most=2)):
        assert stored.seconds == 0 and stored.is_ready
    other = Cut(TWO_BOXES, "vhacd", most=2)
    assert other.seconds > 0 and not other.is_ready


def test_hull_is_always_ready(empty_cache):
    """The one convex hull of a body takes no cutting, though nothing is stored."""
    hull = Cut(TWO_BOXES, "hull", most=1)
    assert hull.seconds == 0 and hull.is_ready


@pytest.mark.slow
def test_seconds_of_vhacd_are_of_the_right_size():
    """Real and estimated seconds differ by much the same factor for every body, whether it takes 0.1 s or 3 s.

    However quick the machine is, each factor is within 2 of what it is here, so that two are within 4.
    """
    factors = []
    for name in ("tongs", "tripod", "hand_left", "beaker_250", "funnel"):
        instrument = make_instrument(name, 5000).mesh  # faces
        mesh = TriangleMesh(instrument.vertices, instrument.faces)
        start = time.process_time()
        METHODS["vhacd"].cut(mesh, 8)
        factors.append((time.process_time() - start) / METHODS["vhacd"].seconds(mesh))
    assert max(factors) / min(factors) < 4.0


@pytest.mark.parametrize(
    ("cores", "seconds"), [(2, 9.0), (16, 8.0), (None, 18.0)], ids=["two cores", "a core for each", "cores not known"]
)
def test_cuts_are_divided_among_the_cores(monkeypatch, cores, seconds):
    """Cuts of 8, 6 and 4 s, 18 s in all, are divided among the cores; the longest takes its 8 s.

    A machine that does not report its cores counts as one core. Two bodies share the cut "b", which is made once.
    """
    monkeypatch.setattr(piece_store.os, "cpu_count", lambda: cores)
    cuts = [
        SimpleNamespace(key=key, seconds=cut_seconds)
        for key, cut_seconds in (("a", 8.0), ("b", 6.0), ("b", 6.0), ("c", 4.0))
    ]
    assert piece_store.seconds_of_cuts(cuts) == seconds


def test_cut_that_was_not_begun_has_spent_no_time(empty_cache, monkeypatch):
    """On one core the second cut waits for the first, whose program sleeps 60 s; 0.2 s are allowed for both."""
    monkeypatch.setattr(piece_store, "CUTTING_PROGRAM", "import time; time.sleep(60)")
    monkeypatch.setattr(piece_store.os, "cpu_count", lambda: 1)
    first, second = Cut(BEAKER, "sectors", most=16), Cut(BEAKER, "vhacd", most=16)
    missing = piece_store.cut_ahead([first, second], time_limit=0.2)
    assert missing[first.key].late and missing[second.key].late
    assert missing[first.key].spent > 0.0
    assert missing[second.key].spent == 0.0


@pytest.mark.slow
def test_pieces_are_cut_where_nothing_can_be_stored(empty_cache):
    """A file stands where the folder of stored pieces should be; two boxes take two pieces."""
    empty_cache.write_text("a file where the folder should be", "utf-8")
    assert len(convex_pieces(Cut(TWO_BOXES, "planes", most=16))) == 2


def test_open_surfaces_are_laid_beside_each_other():
    """Half of a beaker's faces and a piece: no solid can be united with an open one, so all faces stay."""
    piece, *_ = convex_pieces(Cut(BEAKER, "sectors", most=4))
    assert len(union_of((HALF_BEAKER, piece)).faces) == len(HALF_BEAKER.faces) + len(piece.faces)


def test_single_convex_piece_is_the_hull_of_the_mesh():
    """At most one piece of a beaker by CoACD, a method that cuts: nothing is cut."""
    (piece,) = convex_pieces(Cut(BEAKER, "coacd", most=1))
    assert piece.content_hash == hull_of(BEAKER.vertices).content_hash


def test_single_piece_of_many_faces_becomes_coarser_within_its_size():
    """A ball of 1,280 faces; engines take 255. The size is that of the box around it."""
    ball = ball_of(subdivisions=3)
    (piece,) = convex_pieces(Cut(ball, AUTO_METHOD, most=1))
    assert len(piece.faces) <= 255 < len(ball.faces)
    assert np.array_equal(np.ptp(piece.vertices, axis=0), np.ptp(ball.vertices, axis=0))


def test_flat_mesh_is_its_own_piece():
    """A triangle: there is no solid to cut or to unite."""
    assert convex_pieces(Cut(FLAT, "coacd", most=16)) == (FLAT,)
    assert union_of((FLAT,)) is FLAT


@pytest.mark.parametrize(
    ("mesh", "word"), [(FLAT, "flat"), (HALF_BEAKER, "holes")], ids=["triangle", "half of a beaker"]
)
def test_uncuttable_mesh_is_called_flat_or_holed(mesh, word):
    """A closed beaker can be cut: no reason against it."""
    assert why_not_cut(BEAKER) == ""
    assert word in why_not_cut(mesh)


@pytest.mark.parametrize(("most_faces", "word"), [(1280, ""), (1279, "1,280 faces")])
def test_mesh_of_more_faces_than_allowed_is_not_cut(monkeypatch, most_faces, word):
    """A ball of 1,280 faces, where so many are allowed; an empty reason: it can be cut."""
    monkeypatch.setattr(piece_store, "MOST_FACES", most_faces)
    reason = why_not_cut(ball_of(subdivisions=3))
    assert word in reason
    assert (reason == "") == (word == "")


@pytest.mark.slow
def test_method_that_cannot_cut_a_mesh_is_one_clear_error():
    """A box is not round, so it has no sectors."""
    with pytest.raises(CutError, match=r"^sectors by height and angle cannot cut this mesh; take another method"):
        convex_pieces(Cut(box_mesh((0.1, 0.05, 0.2)), "sectors", most=8))


@pytest.fixture
def no_package_installed(monkeypatch):
    """No package of a cutter has a version, as if none were installed."""
    monkeypatch.setattr(methods, "version", Mock(side_effect=PackageNotFoundError))


@pytest.mark.usefixtures("no_package_installed")
@pytest.mark.parametrize(("method", "package"), [("vhacd", "vhacdx"), ("coacd", "coacd")])
def test_missing_cutter_error_names_the_package_to_install(method, package):
    """V-HACD and CoACD are packages of others, which seem not to be installed."""
    sentence = rf"needs the package {package}, which is not installed \(pip install {package}\); take another method"
    with pytest.raises(CutError, match=sentence):
        convex_pieces(Cut(BEAKER, method, most=16))


@pytest.mark.usefixtures("no_package_installed")
def test_sectors_are_cut_without_a_package():
    """A beaker in sixteen sectors by height and angle, which is code of this program."""
    assert len(convex_pieces(Cut(BEAKER, "sectors", most=16))) == 16


@pytest.mark.usefixtures("empty_cache")
def test_cutting_ends_when_the_waiting_caller_interrupts(monkeypatch):
    """The cutting program sleeps 60 s; the caller, asked every 10 ms, interrupts at the third time, before 30 s."""
    monkeypatch.setattr(piece_store, "CUTTING_PROGRAM", "import time; time.sleep(60)")
    monkeypatch.setattr(piece_store, "WATCH_SECONDS", 0.01)
    watch = Mock(side_effect=[None, None, KeyboardInterrupt])
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        convex_pieces(Cut(BEAKER, "coacd", most=16), watch)
    assert watch.call_count == 3
    assert time.monotonic() - start < 30


@pytest.mark.usefixtures("empty_cache")
def test_cuts_that_exceed_the_time_limit_are_named(monkeypatch):
    """The cutting program sleeps 60 s, and 0.2 s are allowed, for two cuts ahead and then for one."""
    monkeypatch.setattr(piece_store, "CUTTING_PROGRAM", "import time; time.sleep(60)")
    coacd, vhacd = Cut(BEAKER, "coacd", most=16), Cut(BEAKER, "vhacd", most=16)
    assert cut_ahead([coacd, vhacd], time_limit=0.2) == {
        coacd.key: NotCut("CoACD did not cut this mesh within 200 ms", late=True),
        vhacd.key: NotCut("V-HACD did not cut this mesh within 200 ms", late=True),
    }
    with pytest.raises(CutError, match=r"^CoACD did not cut this mesh within 200 ms; take another method of cutting$"):
        convex_pieces(coacd, time_limit=0.2)


@pytest.mark.parametrize("name", ["beaker", "a,b [c]", "x+y=z", "12", "none", "%41", "Wasser über"])
def test_any_name_of_a_body_survives_a_setting(name):
    """The name, with signs that settings use, is written into the text of a detector and read back.

    Its body, a beaker, is cut into pieces; the other one, which is not named, stays one hull.
    """
    bodies = [Body(name, BEAKER), Body("other", BEAKER)]
    text = names_as_setting([name])
    spec = parse_detector(f"collider[shape=compound,pieces=8,method=auto,cut={text}]")
    cut, other = with_pieces(bodies, PAIR, ColliderSettings(**spec.settings))
    assert len(cut.colliders.parts) > 1
    assert len(other.colliders.parts) == 1


def test_absent_body_cannot_be_cut():
    """The setting ``cut`` names a cup; the only body is a beaker."""
    with pytest.raises(InvalidSettingError, match=r"cut='cup' is not allowed; .* there are: beaker"):
        with_pieces([Body("beaker", BEAKER)], PAIR, ColliderSettings(shape="compound", cut="cup"))


def test_all_bodies_of_pairs_are_cut_at_once(monkeypatch):
    """Two beakers of different sizes are a pair, cut side by side; a third body, two boxes, is in no pair."""
    cut_together = []
    monkeypatch.setattr(compound, "cut_all", lambda cuts, **_: cut_together.append([cut.mesh for cut in cuts]))
    monkeypatch.setattr(compound, "convex_pieces", lambda cut: (cut.mesh,))
    large_beaker = TriangleMesh(2.0 * BEAKER.vertices, BEAKER.faces)
    bodies = [Body("beaker", TriangleMesh(BEAKER.vertices, BEAKER.faces)), Body("large", large_beaker)]
    boxes = Body("boxes", TWO_BOXES)
    settings = ColliderSettings(shape="compound", method="planes")
    *_, unpaired = with_pieces([*bodies, boxes], PAIR, settings)
    assert cut_together == [[body.mesh for body in bodies]]
    assert unpaired.colliders.parts == (hull_collider(TWO_BOXES),)
