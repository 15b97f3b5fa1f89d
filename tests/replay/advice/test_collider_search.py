"""The pieces that a search takes have less loss than hulls, and no body's pieces miss more than they save."""

import pytest

from replay.advice.collider_search import Limits
from replay.running.collider_files import fix_colliders


def pieces_of(fixed):
    return {row["body"]: row["after"]["pieces"] for row in fixed.bodies}


@pytest.mark.sampled(3)
@pytest.mark.parametrize("limit", [0.02, 0.0, 0.2])
def test_pieces_that_miss_more_than_they_save_are_not_taken(two_beakers, missing_pieces, limit):
    fixed = fix_colliders(two_beakers, limits=Limits(limit))
    cuts = {row["body"]: row["how"] for row in fixed.bodies}
    assert cuts["beaker"] != "one hull" and cuts["second"] == "one hull"
    assert fixed.after["loss"] < fixed.before["loss"]
    assert all(more["loss"] < less["loss"] for less, more in zip(fixed.front, fixed.front[1:], strict=False))


def test_good_pieces_of_the_same_body_are_taken(two_beakers):
    assert pieces_of(fix_colliders(two_beakers, limits=Limits(0.02)))["second"] > 1


def test_limit_of_missed_contact_is_among_the_limits():
    assert Limits(0.2).hold(0.2, 1.0)
    assert Limits(0.2, 0.1).hold(0.2, 0.1)
    assert not Limits(0.2, 0.1).hold(0.2, 0.11)
    assert not Limits(0.2, 0.1).hold(0.21, 0.0)
