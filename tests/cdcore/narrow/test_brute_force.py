"""The exhaustive test is the predicate on every pair, nothing left out and in order."""

import numpy as np
from support.motions import soup

from cdcore.narrow import brute_force as exhaustive
from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.narrow.triangles.predicates import triangles_intersect


def test_it_finds_exactly_the_pairs_the_predicate_says_meet(monkeypatch):
    rng = np.random.default_rng(0)
    first, second = soup(rng, 23, 1.0), soup(rng, 31, 1.0)
    every = np.array([[a, b] for a in first for b in second])
    want = np.argwhere(triangles_intersect(every).reshape(23, 31))
    assert len(want) > 10
    assert np.array_equal(meeting_faces_exhaustive(first, second), want)
    monkeypatch.setattr(exhaustive, "PAIRS_AT_ONCE", 40)
    assert np.array_equal(meeting_faces_exhaustive(first, second), want)
