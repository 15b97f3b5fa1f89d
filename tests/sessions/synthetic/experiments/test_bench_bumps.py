import numpy as np
import pytest
from scipy.stats import kstest


@pytest.fixture
def truths(made):
    return [made("bench-bumps", "vive", seed).truth for seed in range(2)]


@pytest.mark.sampled(3)
@pytest.mark.parametrize("rate_hz", [10.0, 22.5, 45.0, 50.0, 60.0, 90.0])
def test_the_bumps_fall_at_any_phase_of_any_rate(rate_hz, truths):
    """Nothing that plants them knows when a detector looks: their middles are spread evenly between its ticks."""
    middles = [np.mean(episode.nominal) for truth in truths for episode in truth.episodes]
    assert len(middles) == 36 and kstest(np.array(middles) * rate_hz % 1.0, "uniform").pvalue > 0.001


def test_hands_are_tracked_while_bumping_and_rod_follows_hand(truths):
    for truth in truths:
        losses = [fact for fact in truth.facts if fact.kind == "loss"]
        assert losses and all(("hand-right" in loss.bodies) == ("rod" in loss.bodies) for loss in losses)
        for episode in truth.episodes:
            hand = "hand-left" if {"hand-left", "cylinder"} & set(episode.pair) else "hand-right"
            start, end = episode.possibly
            assert not any(hand in loss.bodies and loss.start < end and start < loss.end for loss in losses)
