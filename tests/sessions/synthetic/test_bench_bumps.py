import itertools
from functools import lru_cache

import numpy as np
import pytest

from cdcore import Verdict
from sessions.synthetic.bench_bumps import PLACED, make_bench_bumps
from sessions.synthetic.truth import CLEAR, PRESENT

HELD = {"rod", "hand-right"}
PAIRS = [pair for pair in itertools.combinations(sorted(PLACED), 2) if set(pair) != HELD]


@lru_cache(maxsize=8)
def bumps(seed=0, noise="vive"):
    return make_bench_bumps(seed=seed, noise=noise, faces=600)


@pytest.fixture(scope="module", params=["off", pytest.param("vive", marks=pytest.mark.slow)])
def made(request, verdicts):
    session, truth = make_bench_bumps(seed=0, noise=request.param)
    return session, truth, verdicts(session, PAIRS)


def contacts(found, pair):
    return np.isin(found[:, PAIRS.index(pair)], (Verdict.CONTACT, Verdict.CONTAINED))


def test_an_engine_sees_the_planted_bumps_and_nothing_else(made):
    session, truth, found = made
    for pair in PAIRS:
        expected = truth.expected(*pair, session.frames.stamp_ns)
        assert contacts(found, pair)[expected == PRESENT].all(), pair
        assert not contacts(found, pair)[expected == CLEAR].any(), pair


def test_without_noise_the_formula_is_right_to_one_frame(made):
    session, truth, found = made
    if truth.noise != "off":
        pytest.skip("with noise the truth leaves five sigma open")
    times = truth.seconds_of(session.frames.stamp_ns)
    step = np.diff(times).max()
    for episode in truth.episodes:
        near = (times > episode.possibly[0] - 0.1) & (times < episode.possibly[1] + 0.1)
        seen = times[contacts(found, episode.pair) & near]
        assert abs(seen[0] - episode.nominal[0]) < step
        assert abs(seen[-1] - episode.nominal[1]) < step


@pytest.mark.parametrize("rate_hz", [10.0, 22.5, 45.0, 50.0, 60.0, 90.0])
def test_the_bumps_fall_at_any_phase_of_any_rate(rate_hz):
    """Nothing that plants them knows when a detector looks: their middles are spread evenly between its ticks."""
    middles = [sum(one.nominal) / 2 for seed in range(3) for one in bumps(seed)[1].episodes]
    phase = np.sort(np.array(middles) * rate_hz % 1.0)
    steps = np.arange(len(phase) + 1) / len(phase)
    away = np.ptp(np.concatenate([steps[1:] - phase, steps[:-1] - phase]))
    assert len(phase) == 54 and away * np.sqrt(len(phase)) < 2.0  # Kuiper: 1 of 1,000 even spreads is further off


def test_no_hand_is_lost_while_it_bumps():
    for seed in range(3):
        _, truth = bumps(seed)
        losses = [fact for fact in truth.facts if fact.kind == "loss"]
        assert losses
        for episode in truth.episodes:
            hand = "hand-left" if {"hand-left", "cylinder"} & set(episode.pair) else "hand-right"
            start, end = episode.possibly
            assert not any(hand in fact.bodies and fact.start < end and start < fact.end for fact in losses)
