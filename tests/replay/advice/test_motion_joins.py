"""Pieces joined by motion cover what they covered, and report less false contact than as many joined by volume."""

from dataclasses import replace
from functools import cached_property

import numpy as np
import pytest
from support.shapes import box_mesh, revolved_mesh
from support.small_worlds import unit_cubes_on_x

from cdcore.bounding.hull import hull_collider
from cdcore.protocol import Solids, counts_as_contact
from replay.advice import motion_joins
from replay.advice.motion_joins import MOST_PIECES, FalseContacts, joined_by_motion, refined_by_motion
from replay.cutting.convex_solids import outside_by, solids_of
from replay.cutting.piece_store import Cut, convex_pieces
from replay.detection.detector_spec import DetectorSpec
from replay.detection.run_detector import make_detector
from replay.engine import prepare

FINEST = 16
"""Pieces from which all joins begin."""


class StirredBeaker:
    """A beaker in which a rod stirs near one side of the wall, and what its pieces report.

    ``exact``: contact of the meshes, a frame a row; ``hull_is_false``: frames in which the beaker's hull alone touches
    the rod; ``false_contacts``: tests pieces in these frames.
    """

    def __init__(self, session):
        self.assembly = prepare(session, pairs=[("beaker", "rod")]).assembly
        self.mesh = self.assembly.bodies[self.assembly.names.index("beaker")].mesh
        self.exact = self.contact([self.mesh])
        bodies = tuple(
            replace(body, colliders=Solids((hull_collider(body.mesh),), hull_collider(body.mesh)))
            for body in self.assembly.bodies
        )
        self.hull_is_false = self.contact([hull_collider(self.mesh)]) & ~self.exact
        self.false_contacts = FalseContacts(replace(self.assembly, bodies=bodies), "beaker", self.hull_is_false)

    def contact(self, pieces):
        """Whether pieces of the beaker report contact with the rod at each frame, (T, 1)."""
        bodies = tuple(
            replace(body, colliders=solids_of(pieces if body.name == "beaker" else [hull_collider(body.mesh)]))
            for body in self.assembly.bodies
        )
        detector = make_detector(
            DetectorSpec("it", "collider", {"shape": "shipped"}), replace(self.assembly, bodies=bodies), 0
        )
        return counts_as_contact(detector.detect(self.assembly.motion).verdict)

    def false_frames(self, pieces):
        """Number of frames in which pieces of the beaker report contact that its mesh has not."""
        return int((self.contact(pieces) & ~self.exact).sum())

    def missed_frames(self, pieces):
        """Number of frames in which pieces of the beaker report no contact though its mesh has."""
        return int((self.exact & ~self.contact(pieces)).sum())

    def joined_by_volume(self, count):
        """So many pieces of the beaker, by volumes and not by the motion."""
        return [*convex_pieces(Cut(self.mesh, "sectors", count))]

    @cached_property
    def joined_by_motion(self):
        """Number -> as many pieces, joined by motion from ``FINEST``."""
        return joined_by_motion(self.joined_by_volume(FINEST), self.false_contacts, lambda: None)


@pytest.fixture(scope="module")
def stirred_beaker(shared_beakers):
    """A beaker in which a rod stirs, its pieces, and where they would touch falsely."""
    return StirredBeaker(shared_beakers)


def test_false_contacts_of_single_pieces_agree_with_the_detector(stirred_beaker):
    """Six pieces of a beaker, in frames in which the beaker's hull is wrong about the rod: which touch the rod there?

    Expected is what a detector says whose only collider of the beaker is that piece; some do touch.
    """
    pieces = stirred_beaker.joined_by_volume(6)
    frames = stirred_beaker.hull_is_false[:, 0]
    expected = np.array([stirred_beaker.contact([piece])[frames, 0] for piece in pieces])
    assert expected.any()
    assert np.array_equal(stirred_beaker.false_contacts.of(pieces), expected)


def test_joined_pieces_of_each_number_cover_the_beaker(stirred_beaker):
    """16 pieces are joined two by two, where that touches the rod least: 15, 14, ... 1.

    The hulls of each number cover the beaker: no face of it lies outside them by 0.5 mm or more.
    """
    assert sorted(stirred_beaker.joined_by_motion) == [*range(1, FINEST + 1)]
    for count, pieces in stirred_beaker.joined_by_motion.items():
        assert len(pieces) == count
        assert outside_by(stirred_beaker.mesh, pieces) < 5e-4, count


@pytest.mark.parametrize("count", [4, 6])
def test_pieces_joined_by_motion_report_less_false_contact(stirred_beaker, count):
    """16 convex pieces of a beaker become ``count`` hulls: two are joined whose hull touches a rod least, or is small.

    A frame is false where hulls touch the stirring rod and the mesh does not. Hulls joined by the rod's motion have
    fewer such frames, and miss no contact of the mesh, as they still cover its wall. Any small count would do.
    """
    by_motion, by_volume = stirred_beaker.joined_by_motion[count], stirred_beaker.joined_by_volume(count)
    assert stirred_beaker.false_frames(by_motion) < stirred_beaker.false_frames(by_volume)
    assert stirred_beaker.missed_frames(by_motion) == 0


def test_false_contact_never_falls_with_fewer_pieces(stirred_beaker):
    """From 1 to 16 pieces of the beaker, the number of frames in which any of them touches the rod falsely.

    It never rises with more pieces, and is less at 16 than for one.
    """
    false_frames = [
        stirred_beaker.false_contacts.of(pieces).any(axis=0).sum()
        for _count, pieces in sorted(stirred_beaker.joined_by_motion.items())
    ]
    assert false_frames == sorted(false_frames, reverse=True)
    assert false_frames[0] > false_frames[-1]


def test_refined_pieces_cover_the_body_and_report_less(stirred_beaker):
    """Four pieces of a beaker are cut further where they touch the rod falsely: more pieces, false in fewer frames.

    They cover the beaker: no face of it lies outside them, up to rounding.
    """
    coarse = stirred_beaker.joined_by_volume(4)
    fine = refined_by_motion(coarse, stirred_beaker.mesh, stirred_beaker.false_contacts, lambda: None)
    assert 4 < len(fine) <= MOST_PIECES
    assert outside_by(stirred_beaker.mesh, fine) < 1e-9
    assert stirred_beaker.false_frames(fine) < stirred_beaker.false_frames(coarse)


@pytest.mark.parametrize("piece_count", [0, 2])
def test_false_contacts_of_a_body_are_of_its_pairs(piece_count):
    """Three unit cubes in two frames; the pair b-c is false in both, a-b in the second only.

    Pieces of the body a are tested in that frame alone: a row a piece, one column.
    """
    assembly = prepare(unit_cubes_on_x({"a": [0, 1], "b": [0, 0], "c": [0, 2]})).assembly
    pair_names = [assembly.pair_name(column) for column in range(len(assembly.pairs))]
    false_frames = np.zeros((2, len(assembly.pairs)), dtype=np.bool_)
    false_frames[:, pair_names.index("b-c")] = True
    false_frames[1, pair_names.index("a-b")] = True
    box = box_mesh((1.0, 1.0, 1.0))
    bodies = tuple(replace(body, colliders=Solids((box,), box)) for body in assembly.bodies)
    false_contacts = FalseContacts(replace(assembly, bodies=bodies), "a", false_frames)
    assert false_contacts.of([box] * piece_count).shape == (piece_count, 1)


class FirstPieceTouches:
    """False contact of the first piece alone, at 40 moments, and at a moment less each time that pieces are tested."""

    moments = 40

    def of(self, pieces):
        self.moments -= 1
        touches = np.zeros((len(pieces), 40), dtype=np.bool_)
        touches[0, : self.moments] = True
        return touches


def test_refining_stops_at_the_most_pieces(monkeypatch):
    """A box is cut where it touches falsely, into two, of which the first touches again, a little less, and so on.

    The limit is lowered to six pieces.
    """
    monkeypatch.setattr(motion_joins, "MOST_PIECES", 6)
    box = box_mesh((0.1, 0.1, 0.1))
    assert len(refined_by_motion([box], box, FirstPieceTouches(), lambda: None)) == 6


class EveryPieceTouches:
    """False contact of all pieces at all of five moments, however they are cut."""

    def of(self, pieces):
        return np.ones((len(pieces), 5), dtype=np.bool_)


def test_pieces_that_cuts_do_not_help_are_given_up():
    """All pieces touch falsely at all moments, however a box is cut; two useless cuts in a row are allowed.

    The box is cut into two, and each of these into two, four in all, which are cut no further.
    """
    box = box_mesh((0.1, 0.1, 0.1))
    assert motion_joins.MOST_USELESS_CUTS == 2
    assert len(refined_by_motion([box], box, EveryPieceTouches(), lambda: None)) == 4


def test_joining_stops_when_its_time_check_raises(stirred_beaker):
    """The last argument is called now and then; it raises an error when the time is up, which ends the work."""

    class UpError(Exception):
        pass

    def raise_up():
        raise UpError

    with pytest.raises(UpError):
        joined_by_motion(stirred_beaker.joined_by_volume(6), stirred_beaker.false_contacts, raise_up)


def test_refining_stops_when_its_time_check_raises(stirred_beaker):
    """The last argument is called now and then; it raises an error when the time is up, which ends the work."""

    class UpError(Exception):
        pass

    def raise_up():
        raise UpError

    pieces = stirred_beaker.joined_by_volume(6)
    with pytest.raises(UpError):
        refined_by_motion(pieces, stirred_beaker.mesh, stirred_beaker.false_contacts, raise_up)


@pytest.mark.parametrize(
    ("has_false_contact", "tested_frames"),
    [pytest.param(False, 0, id="never false"), pytest.param(True, 2, id="always false, two frames at most")],
)
def test_pieces_are_tested_at_few_frames_with_false_contact(two_beakers, monkeypatch, has_false_contact, tested_frames):
    """A beaker and a rod elsewhere; the beaker's hull is wrong about it in no frame, or in all.

    Pieces are tested in frames in which it is wrong only, here at most two. The answer has a row a piece and a column a
    frame.
    """
    monkeypatch.setattr(motion_joins, "MOST_FRAMES", 2)
    assembly = prepare(two_beakers, pairs=[("beaker", "stirrer")]).assembly
    false_frames = np.full((len(assembly.motion), 1), has_false_contact)  # of the only pair
    cylinder = revolved_mesh([(0, 0), (1, 0), (1, 1), (0, 1)], 8)  # any piece
    touches = FalseContacts(assembly, "beaker", false_frames).of([cylinder])
    assert touches.shape == (1, tested_frames)


@pytest.mark.slow
def test_untested_joins_change_no_level(stirred_beaker, monkeypatch):
    """Joins of two pieces that cannot be the best are not tested, which saves time; here all are tested each time.

    The pieces of each number, 1 to 16, are the same.
    """
    lazy = stirred_beaker.joined_by_motion
    best_join = motion_joins.Joins.best_join

    def best_of_all_tested(joins):
        untested = [number for number, join in enumerate(joins.candidates) if not join.was_tested]
        joins.false_contact_of_joins(untested)
        return best_join(joins)

    monkeypatch.setattr(motion_joins.Joins, "best_join", best_of_all_tested)
    eager = joined_by_motion(stirred_beaker.joined_by_volume(FINEST), stirred_beaker.false_contacts, lambda: None)
    assert sorted(lazy) == sorted(eager)
    for count, pieces in lazy.items():
        for piece, other_piece in zip(pieces, eager[count], strict=True):
            assert np.array_equal(piece.vertices, other_piece.vertices), count
