import numpy as np
import pytest
from scipy.stats import kstest

from sessions.synthetic.assembly import Recording
from sessions.synthetic.experiments.bench_bumps import carry_cylinder, hold_rod, nearly_touch, stir_and_touch
from sessions.synthetic.experiments.lab import Lab
from sessions.synthetic.experiments.record import experiment


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
    """The tracker loses the rod with the right hand, which holds it, and no hand during its contacts."""
    for truth in truths:
        losses = [fact for fact in truth.facts if fact.kind == "loss"]
        assert losses and all(("hand-right" in loss.bodies) == ("rod" in loss.bodies) for loss in losses)
        for episode in truth.episodes:
            hand = "hand-left" if {"hand-left", "cylinder"} & set(episode.pair) else "hand-right"
            start, end = episode.possibly
            assert not any(hand in loss.bodies and loss.start < end and start < loss.end for loss in losses)


def test_hand_is_kept_from_loss_around_its_near_miss():
    """The hand waits for 0.6 s beside a glass.

    Kept are 0.5 s before and 0.3 s after that, and 0.1 s more at either end.
    """
    lab = Lab(experiment("bench-bumps"), Recording(noise="vive"), faces=600)
    nearly_touch(lab)
    ((start, end),), miss = lab.keep["hand-left"], lab.last("near_miss")
    assert lab.late > 0.0 and miss.end - miss.start == pytest.approx(0.6)
    assert (start, end) == pytest.approx((miss.start - 0.6, miss.end + 0.4))


def test_tracking_is_kept_around_bumps_stirring_and_holds():
    """From before a hand comes near a glass until it is away, the tracker must not lose it."""
    lab = Lab(experiment("bench-bumps"), Recording(noise="vive"), faces=600)
    hold_rod(lab)
    stir_and_touch(lab)
    carry_cylinder(lab)
    (stirred,) = lab.hands["right"].overlays
    grasp, release = lab.last("grasp"), lab.last("release")
    at_risk = [
        ("hand-right", stirred.start - 1.1, stirred.end + 0.9),  # so long the rod goes into the beaker, and out
        ("hand-left", grasp.start - 0.5, release.end + 0.3),
    ]
    for episode in lab.episodes(seconds=600.0):
        hand = "hand-right" if "rod" in episode.pair else "hand-left"
        start, end = episode.possibly
        at_risk.append((hand, start - 0.1, end + 0.1))
    for hand, start, end in at_risk:
        assert any(window[0] <= start and end <= window[1] for window in lab.keep[hand]), (hand, start, end)
