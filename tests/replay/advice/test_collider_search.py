"""The pieces that a search takes have less loss than hulls, and no body's pieces miss more than they save."""

from time import sleep

import pytest
from support.shapes import box_mesh, merge_meshes, revolved_mesh, shift_mesh

from cdcore import TriangleMesh
from cdcore.bounding.collider_shapes import box_collider
from cdcore.bounding.hull import hull_collider
from replay.advice import collider_search
from replay.advice.collider_search import CONVEX_REASON, Deadline, Ladder, Limits
from replay.advice.report_card import shape_figures
from replay.cutting import piece_store
from replay.cutting.piece_store import Cut
from replay.cutting.sectors import sector_ladder
from replay.running.collider_files import fix_colliders

pytestmark = pytest.mark.usefixtures("quickest_cutter_only")

WALL = [(0, 0), (0.035, 0), (0.035, 0.1), (0.033, 0.1), (0.033, 0.002), (0, 0.002)]
"""Profile (radius, height) of a beaker, metres."""


def piece_counts(fixed):
    """Body -> number of its pieces after the fix."""
    return {row["body"]: row["after"]["pieces"] for row in fixed.bodies}


@pytest.mark.slow
@pytest.mark.parametrize("limit", [0.02, 0.0, 0.2])
def test_pieces_that_miss_more_than_they_save_are_not_taken(two_beakers, missing_pieces, limit):
    """``limit``: of false contact; pieces planted for the second beaker miss every contact, so it keeps its hull.

    Each choice on the front has less loss than the one before.
    """
    fixed = fix_colliders(two_beakers, limits=Limits(limit))
    cuts = {row["body"]: row["how"] for row in fixed.bodies}
    assert cuts["beaker"] != "one hull" and cuts["second"] == "one hull"
    assert fixed.after["loss"] < fixed.before["loss"]
    assert all(more["loss"] < less["loss"] for less, more in zip(fixed.front, fixed.front[1:], strict=False))


@pytest.mark.slow
def test_good_pieces_of_the_same_body_are_taken(two_beakers):
    """The second beaker, without the planted pieces of the test above."""
    assert piece_counts(fix_colliders(two_beakers, limits=Limits(0.02)))["second"] > 1


@pytest.mark.slow
def test_pieces_joined_by_motion_replace_more_of_a_method(two_beakers, quickest_cutter_only, monkeypatch):
    """With and without joins by the motion: fewer pieces of the beaker, and no more loss than counts as alike."""
    by_volume = fix_colliders(two_beakers, limits=Limits(false=0.2), time_limit=None)
    monkeypatch.setattr(collider_search.ColliderSearch, "join_by_motion", quickest_cutter_only)
    joined = fix_colliders(two_beakers, limits=Limits(false=0.2), time_limit=None)
    assert [row["how"] for row in joined.bodies if row["body"] == "beaker"] == [
        "sectors by height and angle, joined by motion"
    ]
    assert piece_counts(joined)["beaker"] < piece_counts(by_volume)["beaker"]
    assert joined.after["loss"] <= by_volume.after["loss"] + collider_search.SIMILAR_LOSS


def test_best_choice_tried_is_taken_when_time_is_up(beaker_and_rod, monkeypatch):
    """32 sectors of a cup were written, and 12 are as good: the time was up before their number was brought down."""

    def up(_search):
        raise collider_search.TimeUpError

    monkeypatch.setattr(collider_search.ColliderSearch, "descend", up)
    fixed = fix_colliders(beaker_and_rod, limits=Limits(0.02), time_limit=None)
    best = min(fixed.front, key=lambda tried: tried["loss"])
    assert fixed.time_up and fixed.after["loss"] < fixed.before["loss"]
    alike = [tried for tried in fixed.front if tried["loss"] <= best["loss"] + collider_search.SIMILAR_LOSS / 2]
    assert sum(piece_counts(fixed).values()) == min(tried["pieces"] for tried in alike)


@pytest.mark.slow
def test_no_body_has_more_pieces_than_the_limit(two_beakers, quickest_cutter_only, monkeypatch):
    """No false contact is allowed, but 5 pieces a body at most."""
    monkeypatch.setattr(collider_search.ColliderSearch, "join_by_motion", quickest_cutter_only)
    fixed = fix_colliders(two_beakers, limits=Limits(0.0, pieces=5), time_limit=None)
    assert 1 < max(piece_counts(fixed).values()) <= 5 and fixed.as_json()["max_pieces"] == 5
    assert fixed.after["loss"] < fixed.before["loss"]


def test_limit_of_missed_contact_is_among_the_limits():
    """``hold(false, missed)``: fractions; without a limit of missed contact all may be missed."""
    assert Limits(false=0.2).hold(0.2, 1.0)
    assert Limits(false=0.2, missed=0.1).hold(0.2, 0.1)
    assert not Limits(false=0.2, missed=0.1).hold(0.2, 0.11)
    assert not Limits(false=0.2, missed=0.1).hold(0.21, 0.0)


def test_kept_pieces_are_not_late_when_time_is_up(beaker_and_rod):
    """No time is left, but pieces made earlier cost none: nothing is reported as not cut."""
    data = beaker_and_rod.meshes["beaker"]
    search = object.__new__(collider_search.ColliderSearch)  # of which only the deadline is used
    search.deadline = Deadline(0.0, lambda _: None)
    kept = Cut(TriangleMesh(data.vertices, data.faces), "hull", 1)
    assert kept.seconds == 0.0 and search.cut_in_time([kept]) == {}


@pytest.mark.parametrize(("limit", "counts"), [(1, (1,)), (4, (1, 2, 3, 4)), (5, (1, 2, 3, 4, 5))])
def test_round_body_is_tried_with_counts_up_to_the_limit(limit, counts):
    """``counts``: into how many sectors around its axis the beaker is cut."""
    ladder = Ladder(revolved_mesh(WALL, 12), Deadline(seconds=None, advance=lambda _: None), limit)
    assert ladder.counts == counts and ladder.finest_cut().name == "sectors"


def test_other_pieces_of_a_body_follow_after_its_own_steps():
    """Own steps cut two boxes into 1 and 4 pieces; added ones are numbered 2, 3 and 4."""
    box = box_mesh((0.1, 0.1, 0.1))
    ladder = Ladder(
        merge_meshes(box, shift_mesh(box, (0.3, 0.0, 0.0))), Deadline(seconds=None, advance=lambda _: None), 4
    )
    finest = ladder.finest_cut()
    steps = ladder.add_pieces([box], "by hand"), ladder.add_step(finest), ladder.add_pieces([box, box], "again")
    assert ladder.counts == (1, 4) and steps == (2, 3, 4) and finest.name == "planes"
    assert (ladder.how(2), ladder.cut(3), ladder.how(4)) == ("by hand", finest, "again")
    assert [len(ladder.pieces(step)) for step in (2, 4)] == [1, 2]


def test_mirrored_bodies_are_cut_and_counted_as_they_are():
    """Faces of a mirrored body look inwards: its volume is negative, and no cut or figure of volumes was given."""
    beaker = revolved_mesh(WALL, 12)
    mirrored = TriangleMesh(beaker.vertices, beaker.faces[:, ::-1])
    box = box_collider(beaker)
    turned_box = TriangleMesh(box.vertices, box.faces[:, ::-1])
    deadline = Deadline(seconds=None, advance=lambda _: None)
    assert Ladder(turned_box, deadline).reason == Ladder(box, deadline).reason == CONVEX_REASON
    ladders = [sector_ladder(mesh) for mesh in (beaker, mirrored)]
    assert len(ladders[0].ends) == len(ladders[1].ends) > 8
    figures = [shape_figures(mesh, [hull_collider(beaker)]) for mesh in (beaker, mirrored)]
    assert figures[0].pop("seams") == figures[1].pop("seams")
    assert figures[0] == pytest.approx(figures[1]) and figures[0]["beyond"] > 1.0


def plant_methods(monkeypatch, shrunk):
    """V-HACD gives a tiny cube far away, and CoACD the sectors, each made smaller about its middle."""
    original = piece_store.convex_pieces

    def planted(cut, *limits):
        if cut.method == "vhacd":
            return tuple(
                TriangleMesh(1e-3 * piece.vertices + 5.0, piece.faces) for piece in original(Cut(cut.mesh, "hull", 1))
            )
        if cut.method == "coacd":
            pieces = original(Cut(cut.mesh, "sectors", 8), *limits)
            middles = [piece.vertices.mean(axis=0) for piece in pieces]
            return tuple(
                TriangleMesh(middle + shrunk * (piece.vertices - middle), piece.faces)
                for piece, middle in zip(pieces, middles, strict=True)
            )
        return original(cut, *limits)

    monkeypatch.setattr(collider_search.ColliderSearch, "join_by_motion", lambda *_: None)
    monkeypatch.setattr(collider_search, "OTHER_METHODS", ("vhacd", "coacd"))
    monkeypatch.setattr(collider_search, "convex_pieces", planted)
    cut_ahead = collider_search.cut_ahead
    monkeypatch.setattr(
        collider_search,
        "cut_ahead",
        lambda cuts, *rest: cut_ahead([cut for cut in cuts if cut.method == "sectors"], *rest),
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shrunk", "method"),
    [(0.9999, "CoACD"), (1.0, "sectors by height and angle")],
)
def test_equally_accurate_pieces_are_chosen_by_least_volume(beaker_and_rod, monkeypatch, shrunk, method):
    """Planted pieces of another method have 0.9999 of the size of the sectors, or all of it."""
    plant_methods(monkeypatch, shrunk)
    fixed = fix_colliders(beaker_and_rod, limits=Limits(false=0.2))
    (beaker,) = [row for row in fixed.bodies if row["body"] == "beaker"]
    assert (beaker["how"], beaker["after"]["pieces"]) == (method, 8)
    assert fixed.after["false"] < 0.2


def test_cut_skipped_for_lack_of_time_names_its_duration(beaker_and_rod, monkeypatch):
    """CoACD is said to take 900 s for the beaker, longer than the time limit of a search."""
    plant_methods(monkeypatch, shrunk=1.0)
    seconds = Cut.seconds.fget
    monkeypatch.setattr(Cut, "seconds", property(lambda cut: 900.0 if cut.method == "coacd" else seconds(cut)))
    fixed = fix_colliders(beaker_and_rod, limits=Limits(false=0.2))
    assert "CoACD of beaker (8 pieces) was not tried: it takes about 15 min." in fixed.remarks
    assert fixed.as_json()["not_tried"] == list(fixed.not_tried)


@pytest.mark.slow
def test_time_of_counting_the_hulls_is_not_in_the_limit(beaker_and_rod, monkeypatch):
    """The first count, of hulls, takes 0.6 s (as where kernels compile), more than the limit of 0.5 s.

    When the search begins, most of the limit is left.
    """
    figures, calls = collider_search.Scoring.figures, []

    def slow(*arguments):
        if not calls:
            sleep(0.6)
        calls.append(1)
        return figures(*arguments)

    monkeypatch.setattr(collider_search.Scoring, "figures", slow)
    began = []
    begin = collider_search.Deadline.begin
    monkeypatch.setattr(
        collider_search.Deadline, "begin", lambda deadline: (begin(deadline), began.append(deadline.left()))
    )
    fix_colliders(beaker_and_rod, limits=Limits(false=1.0), time_limit=0.5)
    assert len(began) == 1 and began[0] > 0.3
