import numpy as np
import pytest
from scipy.stats import kstest

from sessions.synthetic.assembly import Recording
from sessions.synthetic.experiments.bench_bumps import carry_cylinder, hold_rod, nearly_touch, stir_and_touch
from sessions.synthetic.experiments.lab import Lab
from sessions.synthetic.experiments.record import experiment


@pytest.fixture
def truths(made):
    """The truths of two made-up sessions in which hands, a rod and a cylinder bump into glassware, 18 times each."""
    return [made("bench-bumps", "vive", seed).truth for seed in range(2)]


@pytest.mark.sampled(3)
@pytest.mark.parametrize("rate_hz", [10.0, 22.5, 45.0, 50.0, 60.0, 90.0])
def test_the_bumps_fall_at_any_phase_of_any_rate(rate_hz, truths):
    """Nothing that plants 36 contacts knows when a detector samples: their middles are even between its samples.

    By the test of Kolmogorov and Smirnov so uneven a phase as theirs is not rarer than one in a thousand.
    """
    middles_s = np.array([np.mean(episode.nominal) for truth in truths for episode in truth.episodes])
    assert len(middles_s) == 36
    phases = middles_s * rate_hz % 1.0
    assert kstest(phases, "uniform").pvalue > 0.001


def losses_of_tracking(truth):
    """Facts of a truth: when the tracker loses which bodies."""
    return [fact for fact in truth.facts if fact.kind == "loss"]


def test_tracker_loses_the_rod_with_the_hand_that_holds_it(truths):
    """The right hand holds the rod in the whole session: both are lost together, or neither is."""
    for truth in truths:
        losses = losses_of_tracking(truth)
        assert losses
        for loss in losses:
            assert ("hand-right" in loss.bodies) == ("rod" in loss.bodies)


def test_hands_are_tracked_while_bumping(truths):
    """A contact of the left hand or its cylinder, or of the right hand or its rod, is in no loss of that hand."""
    for truth in truths:
        for episode in truth.episodes:
            hand = "hand-left" if {"hand-left", "cylinder"} & {*episode.pair} else "hand-right"
            start, end = episode.possibly
            for loss in losses_of_tracking(truth):
                assert hand not in loss.bodies or loss.end <= start or loss.start >= end


def test_hand_is_kept_from_loss_around_its_near_miss():
    """The left hand waits for 0.6 s beside a glass; the tracker must not lose it then (``keep``).

    Nor 0.5 s before and 0.3 s after that, in which it comes and goes, nor 0.1 s more at either end, as poses are late.
    """
    lab = Lab(experiment("bench-bumps"), Recording(noise="vive"), faces=600)
    nearly_touch(lab)
    miss = lab.last("near_miss")
    assert miss.end - miss.start == pytest.approx(0.6)
    assert lab.late > 0.0
    (tracked_interval,) = lab.keep["hand-left"]
    assert tracked_interval == pytest.approx((miss.start - 0.5 - 0.1, miss.end + 0.3 + 0.1))


def test_tracking_is_kept_around_bumps_stirring_and_holds():
    """The right hand stirs with a rod in a beaker, the left hand carries a cylinder.

    From before a hand comes near a glass until it is away, the tracker must not lose it: each such time lies in an
    interval of ``keep``. The rod goes in for 1.1 s before it stirs, and out for 0.9 s after it.
    """
    lab = Lab(experiment("bench-bumps"), Recording(noise="vive"), faces=600)
    hold_rod(lab)
    stir_and_touch(lab)
    carry_cylinder(lab)
    (stirring,) = lab.hands["right"].overlays
    grasp, release = lab.last("grasp"), lab.last("release")
    times_near_glass = [
        ("hand-right", stirring.start - 1.1, stirring.end + 0.9),
        ("hand-left", grasp.start - 0.5, release.end + 0.3),  # some time before and after it has the cylinder
    ]
    for episode in lab.episodes(seconds=600.0):  # of all bumps (none is that late), with 0.1 s more at either end
        hand = "hand-right" if "rod" in episode.pair else "hand-left"
        earliest, latest = episode.possibly
        times_near_glass.append((hand, earliest - 0.1, latest + 0.1))
    for hand, start, end in times_near_glass:
        assert any(first <= start and end <= last for first, last in lab.keep[hand]), (hand, start, end)
