"""Convex pieces stand for a mesh: closed, few, always the same, kept where a user's programs keep what they made."""

import time
from importlib.metadata import PackageNotFoundError

import numpy as np
import pytest
from support.planted_sessions import channel
from support.shapes import box_mesh, revolved_mesh
from trimesh.creation import icosphere

from cdcore import Body, TriangleMesh
from cdcore.bounding.hull import hull_of
from cdcore.containment.closed_parts import parity_is_inside
from cdcore.detectors.collider import CUT_METHODS, ColliderSettings
from cdcore.errors import InvalidSettingError
from replay.cutting import methods, piece_store
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
CHANNEL = TriangleMesh(channel().vertices, channel().faces)
"""A U-shaped body, which planes cut into few boxes in little time."""
FLAT = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])


@pytest.fixture
def empty_cache(monkeypatch, tmp_path):
    """A cache folder of this test alone, in which nothing is kept yet."""
    monkeypatch.setattr(piece_store, "in_memory", {})
    monkeypatch.setattr(piece_store, "cache_folder", lambda: tmp_path / "cache")
    return tmp_path / "cache"


def hashes(pieces):
    """Hashes of the contents of pieces."""
    return [piece.content_hash for piece in pieces]


def test_cutter_table_has_a_row_for_every_method():
    """The methods that a setting allows, and those of the table of cutters, beside ``auto``."""
    assert set(CUT_METHODS) == {AUTO_METHOD, *METHODS}


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in ("hull", "box") else pytest.mark.slow) for name in METHODS],
)
def test_pieces_of_each_method_are_closed_few_and_repeat(name, monkeypatch, tmp_path):
    """At most eight pieces; some methods cover the beaker to 0.5 mm."""
    first = convex_pieces(Cut(BEAKER, name, 8))
    monkeypatch.setattr(piece_store, "cache_folder", lambda: tmp_path / "cache")
    assert hashes(first) == hashes(convex_pieces(Cut(BEAKER, name, 8)))
    assert 1 <= len(first) <= (8 if METHODS[name].counts else 1)
    assert all(piece.is_closed and volume_of(piece) > 0 for piece in first)
    assert max(len(piece.faces) for piece in first) <= MOST_TRIANGLES
    assert union_of(first).is_closed and parity_is_inside(union_of(first))
    if name in ("hull", "box", "sectors", "planes", "coacd"):
        assert outside_by(BEAKER, first) < 5e-4


@pytest.mark.parametrize(
    "name", ["sectors", *(pytest.param(name, marks=pytest.mark.slow) for name in ("vhacd", "coacd"))]
)
def test_cut_pieces_leave_the_hollow_of_a_beaker_free(name):
    """At most 16 pieces have less than 0.6 of the volume of the hull, which fills the hollow."""
    filled = union_of(convex_pieces(Cut(BEAKER, name, 16)))
    assert volume_of(filled) < 0.6 * volume_of(convex_pieces(Cut(BEAKER, "hull", 1))[0])


def times_written(folder):
    """When each file of a folder was written."""
    return {file: file.stat().st_mtime_ns for file in folder.iterdir()}


def test_pieces_are_cut_once_and_damaged_files_remade(empty_cache):
    """A first cut is stored, a second only reads it, and after every stored file was cut short all are written anew.

    Planes cut once for every number of pieces, so 2 are stored after cutting 16; a hull takes no cutting. ``seconds``:
    about how long the work takes that is left.
    """
    cut = Cut(CHANNEL, "planes", 16)
    assert cut.seconds > 0 and not cut.is_ready
    first = hashes(convex_pieces(cut))
    assert len(first) > 1
    assert cut.seconds == Cut(CHANNEL, "planes", 2).seconds == 0 < Cut(CHANNEL, "vhacd", 2).seconds
    assert Cut(CHANNEL, "hull", 1).seconds == 0
    assert cut.is_ready and Cut(CHANNEL, "hull", 1).is_ready and not Cut(CHANNEL, "vhacd", 2).is_ready

    kept = times_written(empty_cache)
    assert hashes(convex_pieces(Cut(CHANNEL, "planes", 16))) == first and times_written(empty_cache) == kept

    for file in kept:
        file.write_bytes(file.read_bytes()[:100])
    damaged = times_written(empty_cache)
    assert hashes(convex_pieces(Cut(CHANNEL, "planes", 16))) == first
    remade = times_written(empty_cache)
    assert remade.keys() == kept.keys() and all(remade[file] != damaged[file] for file in kept)


@pytest.mark.slow
def test_seconds_of_vhacd_are_of_the_right_size():
    """Estimated and real seconds differ by much the same factor for every body, whether it takes 0.1 s or 3 s."""
    factors = []
    for name in ("tongs", "tripod", "hand_left", "beaker_250", "funnel"):
        made = make_instrument(name, 5000).mesh
        mesh = TriangleMesh(made.vertices, made.faces)
        began = time.process_time()
        METHODS["vhacd"].cut(mesh, 8)
        factors.append((time.process_time() - began) / METHODS["vhacd"].seconds(mesh))
    # However quick the machine: each is within a factor of 2 of what it takes here.
    assert max(factors) / min(factors) < 4.0


def test_cut_that_was_not_begun_has_spent_no_time(empty_cache, monkeypatch):
    """On one core two cuts wait for each other; the cutting program sleeps 60 s, and 0.2 s are allowed for both."""
    monkeypatch.setattr(piece_store, "CUTTING_PROGRAM", "import time; time.sleep(60)")
    monkeypatch.setattr(piece_store.os, "cpu_count", lambda: 1)
    cuts = [Cut(BEAKER, "sectors", 16), Cut(BEAKER, "vhacd", 16)]
    missing = piece_store.cut_ahead(cuts, time_limit=0.2)
    assert all(missing[cut.key].late for cut in cuts)
    assert missing[cuts[0].key].spent > 0.0 == missing[cuts[1].key].spent


@pytest.mark.slow
def test_pieces_are_cut_where_nothing_can_be_kept(empty_cache):
    """A file stands where the cache folder should be."""
    empty_cache.write_text("a file where the folder should be", "utf-8")
    assert len(convex_pieces(Cut(CHANNEL, "planes", 16))) > 1


def test_open_surfaces_are_laid_beside_each_other():
    """Half of a beaker's faces and a piece: no solid can be united with an open one, so all faces stay."""
    pieces = convex_pieces(Cut(BEAKER, "sectors", 4))
    half = TriangleMesh(BEAKER.vertices, BEAKER.faces[: len(BEAKER.faces) // 2])
    assert len(union_of((half, pieces[0])).faces) == len(half.faces) + len(pieces[0].faces)


def test_single_convex_piece_is_the_hull_of_the_mesh():
    """A hull of more than 255 faces is made coarser within its size; a flat mesh is its own piece."""
    (hull,) = convex_pieces(Cut(BEAKER, "coacd", 1))
    assert hull.content_hash == hull_of(BEAKER.vertices).content_hash
    ball = icosphere(subdivisions=3)
    (few,) = convex_pieces(Cut(TriangleMesh(ball.vertices, ball.faces), AUTO_METHOD, 1))
    assert len(few.faces) <= 255 and np.array_equal(np.ptp(few.vertices, axis=0), np.ptp(ball.vertices, axis=0))
    assert convex_pieces(Cut(FLAT, "coacd", 16)) == (FLAT,) and union_of((FLAT,)) is FLAT


def test_uncuttable_mesh_is_called_flat_holed_or_too_large(monkeypatch):
    """A ball of 1,280 faces is cut where that many are allowed, and not where 1,279 are."""
    half = TriangleMesh(BEAKER.vertices, BEAKER.faces[: len(BEAKER.faces) // 2])
    ball = icosphere(subdivisions=3)
    many = TriangleMesh(ball.vertices, ball.faces)
    assert why_not_cut(BEAKER) == ""
    assert "flat" in why_not_cut(FLAT) and "holes" in why_not_cut(half)
    monkeypatch.setattr(piece_store, "MOST_FACES", 1280)
    assert why_not_cut(many) == ""
    monkeypatch.setattr(piece_store, "MOST_FACES", 1279)
    assert "1,280 faces" in why_not_cut(many)


@pytest.mark.slow
def test_method_that_cannot_cut_a_mesh_is_one_clear_error():
    """A box is not round, so it has no sectors."""
    with pytest.raises(CutError, match=r"^sectors by height and angle cannot cut this mesh; take another method"):
        convex_pieces(Cut(box_mesh((0.1, 0.05, 0.2)), "sectors", 8))


@pytest.mark.parametrize(("name", "package"), [("vhacd", "vhacdx"), ("coacd", "coacd")])
def test_missing_cutter_error_names_the_package_to_install(name, package, monkeypatch):
    """No package seems installed; sectors are cut without any."""

    def absent(_package):
        raise PackageNotFoundError

    monkeypatch.setattr(methods, "version", absent)
    sentence = rf"needs the package {package}, which is not installed \(pip install {package}\); take another method"
    with pytest.raises(CutError, match=sentence):
        convex_pieces(Cut(BEAKER, name, 16))
    assert len(convex_pieces(Cut(BEAKER, "sectors", 16))) == 16


@pytest.mark.usefixtures("empty_cache")
def test_cutting_ends_when_the_waiting_caller_interrupts(monkeypatch):
    """The cutting program sleeps; the caller interrupts at the third time that it is asked."""
    monkeypatch.setattr(piece_store, "CUTTING_PROGRAM", "import time; time.sleep(60)")
    monkeypatch.setattr(piece_store, "WATCH_SECONDS", 0.01)
    calls = []

    def watch():
        calls.append(time.monotonic())
        if len(calls) == 3:
            raise KeyboardInterrupt

    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        convex_pieces(Cut(BEAKER, "coacd", 16), watch)
    assert len(calls) == 3 and time.monotonic() - began < 30


@pytest.mark.usefixtures("empty_cache")
def test_cuts_that_exceed_the_time_limit_are_named(monkeypatch):
    """The cutting program sleeps 60 s, and 0.2 s are allowed."""
    monkeypatch.setattr(piece_store, "CUTTING_PROGRAM", "import time; time.sleep(60)")
    cuts = [Cut(BEAKER, "coacd", 16), Cut(BEAKER, "vhacd", 16)]
    assert cut_ahead(cuts, time_limit=0.2) == {
        cut.key: NotCut(f"{cut.row.words} did not cut this mesh within 200 ms", late=True) for cut in cuts
    }
    with pytest.raises(CutError, match=r"^CoACD did not cut this mesh within 200 ms; take another method of cutting$"):
        convex_pieces(cuts[0], time_limit=0.2)


@pytest.mark.parametrize("name", ["beaker", "a,b [c]", "x+y=z", "12", "none", "%41", "Wasser über"])
def test_any_name_of_a_body_survives_a_setting(name):
    """The name is written into the text of a detector and read back: its body is cut, and not the other."""
    bodies = [Body(name, BEAKER), Body("other", BEAKER)]
    text = names_as_setting([name])
    spec = parse_detector(f"collider[shape=compound,pieces=8,method=auto,cut={text}]")
    made = with_pieces(bodies, ColliderSettings(**spec.settings))
    assert [len(body.colliders.parts) > 1 for body in made] == [True, False]


def test_absent_body_cannot_be_cut():
    """The setting names a cup; the only body is a beaker."""
    with pytest.raises(InvalidSettingError, match=r"cut='cup' is not allowed; .* there are: beaker"):
        with_pieces([Body("beaker", BEAKER)], ColliderSettings(shape="compound", cut="cup"))
