"""Convex pieces stand for a mesh: closed, few, always the same, kept where a user's programs keep what they made."""

import sys
import time

import numpy as np
import pytest
from support.shapes import box_mesh, revolved_mesh
from trimesh.creation import icosphere

from cdcore import Body, TriangleMesh
from cdcore.bounding.hull import hull_of
from cdcore.errors import MissingEngineError
from cdcore.narrow.containment.closed_parts import parity_is_inside
from replay.prepare import convex_pieces as pieces
from replay.prepare.convex_pieces import convex_pieces, in_convex_pieces, union_of

RIM, INNER, OUTER, FLOOR = 0.1, 0.033, 0.035, 0.002
PROFILE = [(0, 0), (OUTER, 0), (OUTER, RIM), (INNER, RIM), (INNER, FLOOR), (0, FLOOR)]
BEAKER = revolved_mesh(PROFILE, 12)


class StandIn:
    """Cuts the beaker by hand: its twelve staves, and its floor."""

    def __init__(self):
        self.asked = 0

    def set_log_level(self, level):
        assert level == "off"

    def Mesh(self, vertices, faces):  # noqa: N802
        return vertices, faces

    def run_coacd(self, mesh, *, max_convex_hull, seed, **search):
        self.asked += 1
        assert (max_convex_hull, seed) == (16, 0)
        turn = 2 * np.pi * np.arange(13) / 12
        ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)

        def prism(radii, ways, top):
            return np.array([(*(radius * way), z) for radius in radii for way in ways for z in (0.0, top)]), None

        return [*(prism((INNER, OUTER), ring[k : k + 2], RIM) for k in range(12)), prism((OUTER,), ring, FLOOR)]


@pytest.fixture
def engine(monkeypatch, tmp_path):
    made = StandIn()
    monkeypatch.setitem(sys.modules, "coacd", made)
    monkeypatch.setattr(pieces, "version", lambda name: "1")
    monkeypatch.setattr(pieces, "cache_folder", lambda: tmp_path / "cache")
    return made


def volume(mesh):
    a, b, c = np.moveaxis(mesh.triangles, 1, 0)
    return float((np.cross(a, b) * c).sum()) / 6


def test_how_long_cutting_takes_is_known_before_it_begins(engine, monkeypatch):
    monkeypatch.setattr(pieces, "find_spec", lambda name: True)
    assert pieces.seconds_to_cut([BEAKER, BEAKER, box_mesh()], 16) == 2 * pieces.CUT_SECONDS
    convex_pieces(BEAKER, 16)
    assert pieces.seconds_to_cut([BEAKER], 16) == 0 < pieces.seconds_to_cut([BEAKER], 4)
    monkeypatch.setattr(pieces, "find_spec", lambda name: None)
    assert pieces.seconds_to_cut([BEAKER], 16) == float("inf")


def test_the_pieces_of_a_beaker_leave_its_hollow_free(engine):
    parts = convex_pieces(BEAKER, 16)
    assert len(parts) == 13 and all(part.is_closed and volume(part) > 0 for part in parts)
    whole = union_of(parts)
    # What is open is laid beside the others as it is.
    half = TriangleMesh(BEAKER.vertices, BEAKER.faces[: len(BEAKER.faces) // 2])
    assert len(union_of((half, parts[0])).faces) == len(half.faces) + len(parts[0].faces)
    assert volume(whole) == pytest.approx(volume(BEAKER), rel=1e-9)
    assert whole.is_closed and parity_is_inside(whole)


def test_pieces_are_cut_once_and_a_damaged_file_is_made_again(engine, tmp_path):
    first = convex_pieces(BEAKER, 16)
    again = convex_pieces(BEAKER, 16)
    assert engine.asked == 1
    assert [one.content_hash for one in first] == [one.content_hash for one in again]
    (kept,) = (tmp_path / "cache").iterdir()
    kept.write_bytes(kept.read_bytes()[:100])
    assert [one.content_hash for one in convex_pieces(BEAKER, 16)] == [one.content_hash for one in first]
    assert engine.asked == 2 and [file.name for file in kept.parent.iterdir()] == [kept.name]


def test_one_piece_is_the_hull_and_a_flat_mesh_is_its_own(monkeypatch):
    monkeypatch.setitem(sys.modules, "coacd", None)
    (hull,) = convex_pieces(BEAKER, 1)
    assert hull.content_hash == hull_of(BEAKER.vertices).content_hash
    ball = icosphere(subdivisions=3)
    (few,) = convex_pieces(TriangleMesh(ball.vertices, ball.faces), 1)
    assert len(few.faces) <= 255 and np.array_equal(np.ptp(few.vertices, axis=0), np.ptp(ball.vertices, axis=0))
    flat = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    assert convex_pieces(flat, 16) == (flat,) and union_of((flat,)) is flat


def test_without_the_extra_a_compound_is_refused_in_a_sentence(monkeypatch):
    monkeypatch.setitem(sys.modules, "coacd", None)
    with pytest.raises(MissingEngineError, match=r'^coacd is not installed; pip install "vrlab-replay\[engines\]"$'):
        in_convex_pieces([Body("beaker", BEAKER)], 16)


@pytest.mark.slow
@pytest.mark.parametrize("most", [4, 16, 64])
def test_coacd_cuts_a_beaker_alike_twice_and_its_pieces_hold_every_vertex_to_a_twentieth_of_a_millimetre(
    most, monkeypatch, tmp_path
):
    pytest.importorskip("coacd", reason="the extra `engines` is not installed")
    mesh, cut = revolved_mesh(PROFILE, 24), []
    for folder in ("one", "two"):
        monkeypatch.setattr(pieces, "cache_folder", lambda folder=folder: tmp_path / folder)
        cut.append(convex_pieces(mesh, most))
    assert [one.content_hash for one in cut[0]] == [one.content_hash for one in cut[1]]
    assert 1 < len(cut[0]) <= most
    held = np.zeros(len(mesh.vertices), dtype=bool)
    for piece in cut[0]:
        a, b, c = np.moveaxis(piece.triangles, 1, 0)
        out = np.cross(b - a, c - a)
        out /= np.linalg.norm(out, axis=1, keepdims=True)
        held |= (((mesh.vertices[:, None] - a) * out).sum(axis=-1) < 5e-5).all(axis=1)
    assert held.all()
    assert union_of(cut[0]).is_closed


def test_who_waits_for_pieces_can_end_the_cutting(monkeypatch, tmp_path):
    pytest.importorskip("coacd", reason="the extra `engines` is not installed")
    monkeypatch.setattr(pieces, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(pieces, "CHILD", "import time; time.sleep(60)")
    monkeypatch.setattr(pieces, "WATCH_SECONDS", 0.01)
    calls = []

    def watch():
        calls.append(time.monotonic())
        if len(calls) == 3:
            raise TimeoutError

    began = time.monotonic()
    with pytest.raises(TimeoutError):
        convex_pieces(BEAKER, 16, watch)
    assert len(calls) == 3 and time.monotonic() - began < 30
