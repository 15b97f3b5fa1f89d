"""Pairs asked through a detector's front door, many in one frame, get the answers they get alone."""

import numpy as np
import pytest

from cdcore import Verdict
from cdcore.errors import CollisionCoreError, UnknownDetectorError
from cdcore.narrow.predicates import triangles_intersect
from replay.stress import posing
from replay.stress.families import FAMILIES
from replay.stress.posing import verdicts_of


@pytest.mark.parametrize("number", [1, 7, 9, 13, 15, 16, 24])
def test_exact_asked_in_batches_says_what_the_predicate_says(number, monkeypatch):
    monkeypatch.setattr(posing, "BATCH", 16)
    pairs = FAMILIES[number - 1].pairs(40)
    assert np.array_equal(verdicts_of("exact", pairs) == Verdict.CONTACT, triangles_intersect(pairs))


def test_no_pairs_have_no_verdicts():
    assert verdicts_of("exact", np.zeros((0, 2, 3, 3))).shape == (0,)


def test_a_refused_pair_stands_alone_and_the_others_are_answered(monkeypatch):
    pairs = FAMILIES[2].pairs(9)
    asked = posing._ask

    def picky(detector, some, settings):
        if (some == pairs[4]).all(axis=(1, 2, 3)).any():
            raise CollisionCoreError("not this one")
        return asked(detector, some, settings)

    monkeypatch.setattr(posing, "_ask", picky)
    expected = [Verdict.CONTACT] * 4 + [Verdict.INVALID] + [Verdict.CONTACT] * 4
    assert verdicts_of("exact", pairs).tolist() == expected


def test_the_cheaper_settings_change_no_verdict(monkeypatch):
    pairs = FAMILIES[0].pairs(60)
    cheap = verdicts_of("discrete", pairs)
    monkeypatch.setattr(posing, "CHEAPER", {})
    assert np.array_equal(verdicts_of("discrete", pairs), cheap)


def test_an_unknown_detector_is_refused():
    with pytest.raises(UnknownDetectorError, match="there are"):
        verdicts_of("spoon", FAMILIES[0].pairs(1))
