"""Pieces joined by motion cover what they covered, and report less false contact than as many joined by volume."""

from dataclasses import replace
from functools import cached_property

import numpy as np
import pytest
from support.shapes import box_mesh, revolved_mesh
from support.small_worlds import unit_cubes_on_x

from cdcore.bounding.hull import hull_collider, hull_of
from cdcore.protocol import Solids, counts_as_contact
from replay.advice import motion_joins
from replay.advice.motion_joins import MOST_PIECES, FalseContacts, joined_by_motion, refined_by_motion
from replay.cutting.convex_solids import outside_by, solids_of
from replay.cutting.sectors import sector_ladder
from replay.detection.detector_spec import DetectorSpec
from replay.detection.run_detector import make_detector
from replay.engine import prepare

FINEST = 48
"""Pieces from which all joins begin: more than the 32 that a join gives at most."""


class Stirred:
    """A beaker in which a rod stirs near one side of the wall."""

    def __init__(self, session):
        self.assembly = prepare(session, pairs=[("beaker", "rod")]).assembly
        self.mesh = self.assembly.bodies[self.assembly.names.index("beaker")].mesh
        self.exact = self.contact([self.mesh])
        self.ladder = sector_ladder(self.mesh)
        bodies = tuple(
            replace(body, colliders=Solids((hull_collider(body.mesh),), hull_collider(body.mesh)))
            for body in self.assembly.bodies
        )
        false = self.contact([hull_collider(self.mesh)]) & ~self.exact
        self.false_contacts = FalseContacts(replace(self.assembly, bodies=bodies), "beaker", false)

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

    def false(self, pieces):
        return int((self.contact(pieces) & ~self.exact).sum())

    def by_volume(self, most):
        return [hull_of(corners) for corners in self.ladder.pieces(most)]

    @cached_property
    def joined(self):
        """Number -> as many pieces, joined by motion from ``FINEST``."""
        return joined_by_motion(self.by_volume(FINEST), self.false_contacts, lambda: None)


@pytest.fixture(scope="module")
def stirred_beaker(shared_beakers):
    """A beaker in which a rod stirs, its pieces, and where they would touch falsely."""
    return Stirred(shared_beakers)


def test_false_contacts_of_single_pieces_agree_with_the_detector(stirred_beaker):
    """Each of 6 pieces of a beaker is asked alone, in frames where the hull of the beaker is wrong about the rod."""
    pieces = stirred_beaker.by_volume(6)
    at_risk = (stirred_beaker.contact([hull_collider(stirred_beaker.mesh)]) & ~stirred_beaker.exact)[:, 0]
    expected = np.array([stirred_beaker.contact([piece])[at_risk, 0] for piece in pieces])
    assert expected.any() and np.array_equal(stirred_beaker.false_contacts.of(pieces), expected)


def test_joined_pieces_of_each_number_cover_the_beaker(stirred_beaker):
    """A face of the beaker may reach out of the joined hulls by at most 0.5 mm."""
    assert sorted(stirred_beaker.joined) == [*range(1, 33)]
    for count, pieces in stirred_beaker.joined.items():
        assert len(pieces) == count and outside_by(stirred_beaker.mesh, pieces) < 5e-4


@pytest.mark.parametrize("count", [4, 6])
def test_pieces_joined_by_motion_report_less_false_contact(stirred_beaker, count):
    """Less than as many (``count``) joined by volume; no contact of the mesh is missed."""
    pieces = stirred_beaker.joined[count]
    assert stirred_beaker.false(pieces) < stirred_beaker.false(stirred_beaker.by_volume(count))
    assert not (stirred_beaker.exact & ~stirred_beaker.contact(pieces)).any()


def test_false_contact_never_falls_with_fewer_pieces(stirred_beaker):
    """From 1 to 32 pieces: frames in which any piece touches falsely."""
    levels = [pieces for _, pieces in sorted(stirred_beaker.joined.items())]
    false = [stirred_beaker.false_contacts.of(pieces).any(axis=0).sum() for pieces in levels]
    assert false == sorted(false, reverse=True) and false[0] > false[-1]


def test_refined_pieces_cover_the_body_and_report_less(stirred_beaker):
    """Four pieces by volume are cut further where they touch falsely; no face of the beaker reaches out of them."""
    coarse = stirred_beaker.by_volume(4)
    fine = refined_by_motion(coarse, stirred_beaker.mesh, stirred_beaker.false_contacts, lambda: None)
    assert len(coarse) < len(fine) <= MOST_PIECES and outside_by(stirred_beaker.mesh, fine) < 1e-9
    assert stirred_beaker.false(fine) < stirred_beaker.false(coarse)


def test_false_contacts_of_a_body_are_those_of_its_own_pairs():
    """Three cubes in two frames; the pair b-c is false in both, a-b in the second: of body a one moment counts."""
    assembly = prepare(unit_cubes_on_x({"a": [0, 1], "b": [0, 0], "c": [0, 2]})).assembly
    false = np.zeros((2, len(assembly.pairs)), dtype=np.bool_)
    pairs = [assembly.pair_name(column) for column in range(len(assembly.pairs))]
    false[:, pairs.index("b-c")] = True
    false[1, pairs.index("a-b")] = True
    box = box_mesh((1.0, 1.0, 1.0))
    bodies = tuple(replace(body, colliders=Solids((box,), box)) for body in assembly.bodies)
    false_contacts = FalseContacts(replace(assembly, bodies=bodies), "a", false)
    assert false_contacts.of([box, box]).shape == (2, 1)
    assert false_contacts.of([]).shape == (0, 1)


class FirstPieceTouches:
    """False contact of the first piece alone of those asked, at fewer of 40 moments each time."""

    moments = 40

    def of(self, pieces):
        self.moments -= 1
        touches = np.zeros((len(pieces), 40), dtype=np.bool_)
        touches[0, : self.moments] = True
        return touches


def test_refining_stops_at_the_most_pieces(monkeypatch):
    """Each cut of the box that touches makes two, of which again only the first touches."""
    monkeypatch.setattr(motion_joins, "MOST_PIECES", 6)
    box = box_mesh((0.1, 0.1, 0.1))
    assert len(refined_by_motion([box], box, FirstPieceTouches(), lambda: None)) == 6


class EveryPieceTouches:
    """False contact of all pieces at all of five moments, however they are cut."""

    def of(self, pieces):
        return np.ones((len(pieces), 5), dtype=np.bool_)


def test_pieces_that_cuts_do_not_help_are_given_up():
    """Two useless cuts of a piece in turn: the box gives two pieces, and each of those two that are cut no further."""
    box = box_mesh((0.1, 0.1, 0.1))
    assert motion_joins.MOST_USELESS_CUTS == 2
    assert len(refined_by_motion([box], box, EveryPieceTouches(), lambda: None)) == 4


def test_joining_stops_when_its_time_check_raises(stirred_beaker):
    """The check is called in joins and in refinements; its error comes through."""

    class UpError(Exception):
        pass

    def check():
        raise UpError

    for call in (joined_by_motion, lambda pieces, *rest: refined_by_motion(pieces, stirred_beaker.mesh, *rest)):
        with pytest.raises(UpError):
            call(stirred_beaker.by_volume(6), stirred_beaker.false_contacts, check)


def test_pieces_are_tested_at_no_frame_without_false_contact(two_beakers):
    """Answers are (pieces, frames) of the only piece asked."""
    assembly = prepare(two_beakers, pairs=[("beaker", "stirrer")]).assembly
    never = np.zeros((len(assembly.motion), 1), dtype=np.bool_)  # of one pair
    false_contacts = FalseContacts(assembly, "beaker", never)
    cylinder = revolved_mesh([(0, 0), (1, 0), (1, 1), (0, 1)], 8)
    pieces, frames = false_contacts.of([cylinder]).shape
    assert (pieces, frames) == (1, 0)


def test_pieces_are_tested_at_a_limited_number_of_frames(two_beakers, monkeypatch):
    """All frames have false contact; two are taken."""
    monkeypatch.setattr(motion_joins, "MOST_FRAMES", 2)
    assembly = prepare(two_beakers, pairs=[("beaker", "stirrer")]).assembly
    always = np.ones((len(assembly.motion), 1), dtype=np.bool_)  # of one pair
    cylinder = revolved_mesh([(0, 0), (1, 0), (1, 1), (0, 1)], 8)
    pieces, frames = FalseContacts(assembly, "beaker", always).of([cylinder]).shape
    assert (pieces, frames) == (1, 2)


@pytest.mark.slow
def test_untested_joins_change_no_level(stirred_beaker, monkeypatch):
    """Joins that cannot be the best are not tested; here all are, and the pieces are the same."""
    lazy = stirred_beaker.joined
    original = motion_joins.Joins.best_join

    def test_every_join(joins):
        untested = [number for number, join in enumerate(joins.candidates) if not join.was_tested]
        joins.false_contact_of_joins(untested)
        return original(joins)

    monkeypatch.setattr(motion_joins.Joins, "best_join", test_every_join)
    eager = joined_by_motion(stirred_beaker.by_volume(FINEST), stirred_beaker.false_contacts, lambda: None)
    assert sorted(lazy) == sorted(eager)
    for count, pieces in lazy.items():
        corners = [piece.vertices for piece in pieces]
        assert all(np.array_equal(a, b.vertices) for a, b in zip(corners, eager[count], strict=True))
