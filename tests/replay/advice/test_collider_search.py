"""The pieces that a search takes have less loss than hulls, and no body's pieces miss more than they save."""

from itertools import pairwise
from time import sleep

import pytest
from support.shapes import box_mesh, merge_meshes, revolved_mesh, shift_mesh

from cdcore import TriangleMesh
from cdcore.bounding.collider_shapes import box_collider
from cdcore.bounding.hull import hull_collider
from replay.advice import collider_search
from replay.advice.collider_search import CONVEX_REASON, Deadline, Ladder, Limits
from replay.advice.report_card import shape_figures
from replay.cutting import piece_store, sectors
from replay.cutting.piece_store import Cut, NotCut, cut_ahead
from replay.cutting.sectors import sector_ladder
from replay.running.collider_files import fix_colliders

pytestmark = pytest.mark.usefixtures("quickest_cutter_only")

WALL = [(0, 0), (0.035, 0), (0.035, 0.1), (0.033, 0.1), (0.033, 0.002), (0, 0.002)]
"""Profile (radius, height) of a beaker, metres."""


def piece_counts(fixed):
    """Body -> number of its pieces after the search."""
    return {row["body"]: row["after"]["pieces"] for row in fixed.bodies}


def unlimited():
    """A deadline that never comes."""
    return Deadline(seconds=None, advance=lambda _: None)


@pytest.mark.slow
@pytest.mark.parametrize("false_limit", [0.02, 0.0, 0.2])
def test_pieces_that_miss_more_than_they_save_are_not_taken(two_beakers, missing_pieces, false_limit):
    """Two beakers in each of which a rod stirs; pieces planted for the second (``missing_pieces``) miss every contact.

    So it keeps its hull, whatever fraction of false contact is good enough. What was tried is listed by pieces (the
    front), and each choice there has less loss than the one before.
    """
    fixed = fix_colliders(two_beakers, limits=Limits(false=false_limit))
    method_of_body = {row["body"]: row["how"] for row in fixed.bodies}
    assert method_of_body["beaker"] != "one hull"
    assert method_of_body["second"] == "one hull"
    assert fixed.after["loss"] < fixed.before["loss"]
    losses = [choice["loss"] for choice in fixed.front]
    assert all(loss_of_more < loss for loss, loss_of_more in pairwise(losses))


@pytest.mark.slow
def test_good_pieces_of_the_same_body_are_taken(two_beakers):
    """A rod stirs in each of two beakers; good pieces of the second are taken. 2 % of false contact are allowed."""
    assert piece_counts(fix_colliders(two_beakers, limits=Limits(false=0.02)))["second"] > 1


@pytest.mark.slow
def test_pieces_joined_by_motion_replace_more_of_a_method(two_beakers, quickest_cutter_only, monkeypatch):
    """Pieces of a beaker are joined by their volumes, or where that touches the stirring rod least (by the motion).

    The latter are fewer, with no more loss than counts as alike; 20 % of false contact are good enough. (The fixture
    ``quickest_cutter_only`` turns joins by motion off, and hands them over.)
    """
    by_volume = fix_colliders(two_beakers, limits=Limits(false=0.2), time_limit=None)
    monkeypatch.setattr(collider_search.ColliderSearch, "join_by_motion", quickest_cutter_only)
    by_motion = fix_colliders(two_beakers, limits=Limits(false=0.2), time_limit=None)
    (method,) = [row["how"] for row in by_motion.bodies if row["body"] == "beaker"]
    assert method == "sectors by height and angle, joined by motion"
    assert piece_counts(by_motion)["beaker"] < piece_counts(by_volume)["beaker"]
    assert by_motion.after["loss"] <= by_volume.after["loss"] + collider_search.SIMILAR_LOSS


def test_best_choice_tried_is_taken_when_time_is_up(beaker_and_rod, monkeypatch):
    """A beaker was tried in up to 8 sectors (2 % of false contact are allowed); the time is up before fewer are tried.

    The choice of fewest pieces is taken of those that are about as good as the best that was tried: with a loss at
    most 0.0005 larger, half of ``SIMILAR_LOSS``. (``front``: the choices that no other beats in loss and pieces.)
    """

    def end(_search):
        raise collider_search.TimeUpError

    monkeypatch.setattr(collider_search.ColliderSearch, "descend", end)
    fixed = fix_colliders(beaker_and_rod, limits=Limits(false=0.02, pieces=8), time_limit=None)
    least_loss = min(choice["loss"] for choice in fixed.front)
    as_good = [choice for choice in fixed.front if choice["loss"] <= least_loss + collider_search.SIMILAR_LOSS / 2]
    assert fixed.time_up
    assert fixed.after["loss"] < fixed.before["loss"]
    assert sum(piece_counts(fixed).values()) == min(choice["pieces"] for choice in as_good)


@pytest.mark.slow
def test_no_body_has_more_pieces_than_the_limit(two_beakers, quickest_cutter_only, monkeypatch):
    """No false contact is good enough, which would take many pieces of each beaker; but five a body are the most.

    Joins of pieces by the motion are on, which the fixture ``quickest_cutter_only`` turns off elsewhere.
    """
    monkeypatch.setattr(collider_search.ColliderSearch, "join_by_motion", quickest_cutter_only)
    fixed = fix_colliders(two_beakers, limits=Limits(false=0.0, pieces=5), time_limit=None)
    assert 1 < max(piece_counts(fixed).values()) <= 5
    assert fixed.as_json()["max_pieces"] == 5
    assert fixed.after["loss"] < fixed.before["loss"]


@pytest.mark.parametrize(
    ("limits", "false_fraction", "missed_fraction", "hold"),
    [
        pytest.param(Limits(false=0.2), 0.2, 1.0, True, id="any missed contact allowed"),
        pytest.param(Limits(false=0.2, missed=0.1), 0.2, 0.1, True, id="both at their limits"),
        pytest.param(Limits(false=0.2, missed=0.1), 0.2, 0.11, False, id="missed above"),
        pytest.param(Limits(false=0.2, missed=0.1), 0.21, 0.0, False, id="false above"),
    ],
)
def test_limit_of_missed_contact_is_among_the_limits(limits, false_fraction, missed_fraction, hold):
    """Fractions of contact time that are false or missed, at most; without a limit of missed contact all may be."""
    assert limits.hold(false_fraction, missed_fraction) == hold


@pytest.mark.parametrize("can_be_written", [True, False])
def test_kept_pieces_are_not_late_when_time_is_up(beaker_and_rod, monkeypatch, tmp_path, can_be_written):
    """No time is left, and the store of pieces is empty: 8 sectors of a beaker are late. Once cut, they are not.

    Then they are read from the store, which takes no time; a store that is a file cannot be written, and they are in
    memory. ``cut_in_time`` returns which cuts are not ready, and why.
    """
    store = tmp_path / "store"
    if not can_be_written:
        store.write_text("a file where the folder should be", "utf-8")
    monkeypatch.setattr(piece_store, "in_memory", {})
    monkeypatch.setattr(piece_store, "cache_folder", lambda: store)
    data = beaker_and_rod.meshes["beaker"]
    search = object.__new__(collider_search.ColliderSearch)  # of which only the deadline is used
    search.deadline = Deadline(seconds=0.0, advance=lambda _: None)
    sectors_of_beaker = Cut(TriangleMesh(data.vertices, data.faces), "sectors", most=8)
    assert search.cut_in_time([sectors_of_beaker]) == {sectors_of_beaker.key: NotCut(reason="", late=True)}
    assert cut_ahead([sectors_of_beaker]) == {}
    assert search.cut_in_time([sectors_of_beaker]) == {}


@pytest.mark.parametrize(("most_pieces", "counts"), [(1, (1,)), (4, (1, 2, 3, 4)), (5, (1, 2, 3, 4, 5))])
def test_round_body_is_tried_with_counts_up_to_the_limit(most_pieces, counts):
    """A beaker is round about an axis: it is cut into so many sectors around that, each number in turn (``counts``)."""
    ladder = Ladder(revolved_mesh(WALL, 12), unlimited(), most_pieces)
    assert ladder.counts == counts
    assert ladder.finest_cut().name == "sectors"


def test_other_pieces_of_a_body_follow_after_its_own_steps():
    """A body of two boxes 0.2 m apart, of four pieces at most: its own steps, 0 and 1, cut it into 1 and 4, by planes.

    Steps that are added later, of one piece, of the finest cut and of two pieces, are numbered 2, 3 and 4.
    """
    box = box_mesh((0.1, 0.1, 0.1))
    two_boxes = merge_meshes(box, shift_mesh(box, (0.3, 0.0, 0.0)))
    ladder = Ladder(two_boxes, unlimited(), 4)
    finest = ladder.finest_cut()
    assert ladder.counts == (1, 4)
    assert finest.name == "planes"
    assert ladder.add_pieces([box], "by hand") == 2
    assert ladder.add_step(finest) == 3
    assert ladder.add_pieces([box, box], "again") == 4
    assert (ladder.how(2), ladder.cut(3), ladder.how(4)) == ("by hand", finest, "again")
    assert (len(ladder.pieces(2)), len(ladder.pieces(4))) == (1, 2)


def with_inward_faces(mesh):
    """The mesh of a mirrored body, whose faces look inwards, so that its volume by them is negative."""
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def test_mirrored_convex_body_keeps_its_hull():
    """A box (that around a beaker) whose faces look inwards is convex all the same, and not cut."""
    box = box_collider(revolved_mesh(WALL, 12))
    assert Ladder(box, unlimited()).reason == CONVEX_REASON
    assert Ladder(with_inward_faces(box), unlimited()).reason == CONVEX_REASON


def test_mirrored_body_is_cut_into_as_many_sectors(monkeypatch):
    """A beaker of 12 sides, and the same with faces that look inwards: both have 2 * 4 pieces.

    Each is cut across, a little above its floor, and both parts are cut into four by angle.
    """
    monkeypatch.setattr(sectors, "SECTOR_COUNT", 4)  # usually 16, which takes longer
    beaker = revolved_mesh(WALL, 12)
    sector_counts, mirrored_sector_counts = (
        len(sector_ladder(mesh).ends) for mesh in (beaker, with_inward_faces(beaker))
    )
    assert sector_counts == mirrored_sector_counts == 2 * 4


def test_mirrored_body_has_the_figures_of_its_volume():
    """A beaker and its hull, which has over twice its volume (``beyond``: what is added); faces may look inwards."""
    beaker = revolved_mesh(WALL, 12)
    hull = hull_collider(beaker)
    figures, mirrored_figures = (shape_figures(mesh, [hull]) for mesh in (beaker, with_inward_faces(beaker)))
    assert figures["beyond"] > 1.0
    assert mirrored_figures.pop("seams") == figures.pop("seams")
    assert mirrored_figures == pytest.approx(figures)


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
    ("size", "method"),
    [
        pytest.param(0.9999, "CoACD", id="a little smaller"),
        pytest.param(1.0, "sectors by height and angle", id="equal: the sectors, which come first"),
    ],
)
def test_equally_accurate_pieces_are_chosen_by_least_volume(beaker_and_rod, monkeypatch, size, method):
    """A beaker is cut into 8 sectors; another method, CoACD, is said to give the same, ``size`` times as large.

    Both are as accurate, and good enough for 20 % of false contact; ``method`` says which are taken.
    """
    plant_methods(monkeypatch, shrunk=size)
    fixed = fix_colliders(beaker_and_rod, limits=Limits(false=0.2))
    (beaker,) = [row for row in fixed.bodies if row["body"] == "beaker"]
    assert (beaker["how"], beaker["after"]["pieces"]) == (method, 8)
    assert fixed.after["false"] < 0.2


def test_cut_skipped_for_lack_of_time_names_its_duration(beaker_and_rod, monkeypatch):
    """CoACD, a method to cut bodies, is said to take 900 s (15 min) for the beaker, longer than the 60 s of a search.

    The search says so in a remark, and its JSON lists the cut.
    """
    plant_methods(monkeypatch, shrunk=1.0)
    seconds = Cut.seconds.fget
    monkeypatch.setattr(Cut, "seconds", property(lambda cut: 900.0 if cut.method == "coacd" else seconds(cut)))
    fixed = fix_colliders(beaker_and_rod, limits=Limits(false=0.2, pieces=8))
    assert "CoACD of beaker (8 pieces) was not tried: it takes about 15 min." in fixed.remarks
    assert fixed.as_json()["not_tried"] == list(fixed.not_tried) != []


@pytest.mark.slow
def test_time_of_counting_the_hulls_is_not_in_the_limit(beaker_and_rod, monkeypatch):
    """The first count, of the hulls, takes 0.6 s (as where kernels compile), more than the limit of 0.5 s.

    When the search begins after that, most of the limit is left: over 0.3 s.
    """
    count_faults, counts = collider_search.Scoring.figures, []

    def count_slowly_at_first(*arguments):
        if not counts:
            sleep(0.6)
        counts.append(1)
        return count_faults(*arguments)

    monkeypatch.setattr(collider_search.Scoring, "figures", count_slowly_at_first)
    seconds_left = []
    begin = collider_search.Deadline.begin

    def begin_and_note(deadline):
        begin(deadline)
        seconds_left.append(deadline.left())

    monkeypatch.setattr(collider_search.Deadline, "begin", begin_and_note)
    fix_colliders(beaker_and_rod, limits=Limits(false=1.0), time_limit=0.5)
    (left_at_begin,) = seconds_left
    assert left_at_begin > 0.3
