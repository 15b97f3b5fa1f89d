"""Detectors asked in batches and peers see the same triangles; one that raises has refused that pair."""

import numpy as np
import pytest

from cdcore import Verdict
from cdcore.errors import CollisionCoreError, UnknownDetectorError
from cdcore.narrow.triangles.predicates import triangles_intersect
from replay.studies.stress import peers
from replay.studies.stress.families import FAMILIES
from replay.studies.stress.peers import PEERS, installed_peers, verdict_each, verdicts_of

FLOOR = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
PAIRS = np.array([[FLOOR, [[0.2, 0.2, tip], [0.3, 0.2, 0.5], [0.2, 0.3, 0.5]]] for tip in (-0.5, 0.1)])


@pytest.mark.parametrize("name", PEERS)
def test_a_peer_is_right_where_nothing_is_hard(name):
    pytest.importorskip(name)
    assert PEERS[name](PAIRS).tolist() == [Verdict.CONTACT, Verdict.CLEAR]


def test_an_engine_that_raises_has_refused_that_pair():
    def meets(pair):
        if pair[1, 0, 2] > 0:
            raise RuntimeError("no")
        return True

    assert verdict_each(PAIRS, meets).tolist() == [Verdict.CONTACT, Verdict.INVALID]


def test_only_what_is_installed_is_asked(monkeypatch):
    monkeypatch.setattr(peers, "find_spec", lambda name: None if name == "coal" else object())
    assert installed_peers() == ["trimesh"]


@pytest.mark.parametrize("number", [1, 7, 9, 13, 15, 16, 24])
def test_exact_asked_in_batches_says_what_the_predicate_says(number, monkeypatch):
    monkeypatch.setattr(peers, "BATCH", 16)
    pairs = FAMILIES[number - 1].pairs(40)
    assert np.array_equal(verdicts_of("exact", pairs) == Verdict.CONTACT, triangles_intersect(pairs))


def test_no_pairs_have_no_verdicts():
    assert verdicts_of("exact", np.zeros((0, 2, 3, 3))).shape == (0,)


def test_a_refused_pair_stands_alone_and_the_others_are_answered(monkeypatch):
    pairs = FAMILIES[2].pairs(9)
    asked = peers._ask

    def picky(detector, some, settings):
        if (some == pairs[4]).all(axis=(1, 2, 3)).any():
            raise CollisionCoreError("not this one")
        return asked(detector, some, settings)

    monkeypatch.setattr(peers, "_ask", picky)
    expected = [Verdict.CONTACT] * 4 + [Verdict.INVALID] + [Verdict.CONTACT] * 4
    assert verdicts_of("exact", pairs).tolist() == expected


def test_the_cheaper_settings_change_no_verdict(monkeypatch):
    pairs = FAMILIES[0].pairs(60)
    cheap = verdicts_of("discrete", pairs)
    monkeypatch.setattr(peers, "CHEAPER", {})
    assert np.array_equal(verdicts_of("discrete", pairs), cheap)


def test_an_unknown_detector_is_refused():
    with pytest.raises(UnknownDetectorError, match="there are"):
        verdicts_of("spoon", FAMILIES[0].pairs(1))
