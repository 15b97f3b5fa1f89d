from __future__ import annotations

import numpy as np
import pytest

from sessions.geometry.rotations import rotated
from sessions.synthetic.assembly import Recording
from sessions.synthetic.bench import Layout
from sessions.synthetic.bench_bumps import PLACED, SECONDS
from sessions.synthetic.bump_scripts import Plan, left_hand, right_hand, watching
from sessions.synthetic.planting import Blinks


@pytest.fixture(scope="module")
def played():
    how = Recording(seconds=SECONDS, noise="vive", jitter="steady")
    plan = Plan(Layout(PLACED, 600), Blinks(how.stamps() * 1e-9, how.latency_s), how, np.random.default_rng(0))
    return plan, right_hand(plan), left_hand(plan)


def test_both_scripts_end_within_the_session(played):
    _, right, left = played
    assert 45.0 < right.now < SECONDS
    assert 40.0 < left.now < SECONDS


def test_half_of_the_taps_are_brief(played):
    plan, _, _ = played
    lengths = sorted(episode.nominal[1] - episode.nominal[0] for episode in plan.episodes)
    assert len(lengths) == 18
    assert lengths[8] < 0.026 < 0.15 < lengths[9]
    assert sum("briefly" in episode.note for episode in plan.episodes) == 9


def test_every_bump_lies_in_a_window_in_which_its_hand_is_not_lost(played):
    plan, _, _ = played
    left = {"hand-left", "cylinder"}
    for episode in plan.episodes:
        hand = "hand-left" if left & set(episode.pair) else "hand-right"
        assert any(a < episode.possibly[0] and episode.possibly[1] < b for a, b in plan.keep[hand])


def test_the_eyes_look_down_at_the_bench(played):
    plan, _, _ = played
    times = np.linspace(0.0, SECONDS, 200)
    position, quaternion = watching(plan)(times)
    gaze = rotated(quaternion, np.array([0.0, 0.0, -1.0]))
    reach = (position[:, 1] - 0.98) / -gaze[:, 1]
    spot = position + reach[:, None] * gaze
    assert (gaze[:, 1] < -0.3).all()
    assert (np.abs(spot[:, 0]) < 0.6).all() and (np.abs(spot[:, 2]) < 0.3).all()
