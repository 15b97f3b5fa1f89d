import itertools
from functools import lru_cache

import numpy as np
import pytest

from cdcore import Verdict
from sessions.errors import SceneError
from sessions.model.scene import Pose, Scene, SceneBody, SceneEffect
from sessions.synthetic import bump_scripts, planting
from sessions.synthetic.assembly import Recording
from sessions.synthetic.bench import Instruments, with_text
from sessions.synthetic.bench_bumps import PLACED, SECONDS, make_bench_bumps
from sessions.synthetic.bump_scripts import BumpPlan, left_hand, right_hand
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
    assert not {"Blinks", "looks"} & (vars(bump_scripts).keys() | vars(planting).keys())


def test_the_same_seed_gives_the_same_poses_and_another_seed_others():
    first, second, other = make_bench_bumps(seed=1, faces=600)[0], bumps(1)[0], bumps(2)[0]
    for name in ("position", "quaternion_xyzw", "status", "stamp_ns"):
        assert getattr(first.frames, name).tobytes() == getattr(second.frames, name).tobytes()
    assert first.scene.text == second.scene.text
    assert first.frames.position.tobytes() != other.frames.position.tobytes()


SCENE = Scene(
    "a test",
    (
        SceneBody("bench", instrument="bench", fixed=Pose(), tags=("bench",)),
        SceneBody("glass", instrument="beaker_250", group="g", tags=("glass",), extra={"faces": 600, "mass": 0.25}),
    ),
    effects=(SceneEffect("contact", {"between": ["tag:glass", "tag:bench"]}),),
)


def test_an_effect_between_what_is_not_there_is_refused():
    with pytest.raises(SceneError, match="tag:lamp"):
        with_text(Scene("x", SCENE.bodies, effects=(SceneEffect("contact", {"between": ["tag:lamp", "glass"]}),)))


@pytest.fixture(scope="module")
def played():
    how = Recording(seconds=SECONDS, noise="vive", jitter="steady")
    plan = BumpPlan(Instruments(PLACED, 600), how, np.random.default_rng(0))
    return plan, right_hand(plan), left_hand(plan)


def test_every_bump_lies_in_a_window_in_which_its_hand_is_not_lost(played):
    plan, _, _ = played
    left = {"hand-left", "cylinder"}
    for episode in plan.episodes:
        hand = "hand-left" if left & set(episode.pair) else "hand-right"
        assert any(a < episode.possibly[0] and episode.possibly[1] < b for a, b in plan.keep[hand])
