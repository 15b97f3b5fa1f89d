import numpy as np

from replay.audit.outcome import Comparison, Outcome


def test_counts_over_all_outcomes_make_up_every_pair_frame():
    outcome = np.random.default_rng(0).integers(0, len(Outcome), size=(50, 4)).astype(np.uint8)
    comparison = Comparison("a", "b", outcome)
    assert sum(comparison.count(word) for word in Outcome) == outcome.size
    assert comparison.count(Outcome.MISSED) == (outcome == 2).sum()
