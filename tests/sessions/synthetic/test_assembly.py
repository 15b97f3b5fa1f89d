import numpy as np
import pytest

from sessions.errors import SessionError
from sessions.synthetic.assembly import CLOCKS, START_NS, Recording, recorded, stamps
from sessions.synthetic.paths import Key, KeyPath, still

PATHS = {
    "a": still((0.0, 1.0, 0.0)),
    "b": KeyPath([Key(0.0, (0.0, 0.0, 0.0)), Key(5.0, (1.0, 0.0, 0.0), ease="linear")]),
}


def test_without_noise_the_recorded_poses_are_the_path():
    seen = recorded(PATHS, Recording(seconds=5.0))
    position, _ = seen.poses["b"]
    np.testing.assert_allclose(position[:, 0], seen.stamps * 1e-9 / 5.0, atol=1e-12)
    assert seen.valid["b"].all() and seen.facts == ()


def test_noise_comes_late_and_a_bodys_noise_does_not_depend_on_others():
    how = Recording(seconds=5.0, noise="vive", losses="off", seed=4)
    both, alone = recorded(PATHS, how), recorded({"b": PATHS["b"]}, how)
    np.testing.assert_array_equal(both.poses["b"][0], alone.poses["b"][0])
    lag = both.poses["b"][0][20:, 0] - (both.stamps[20:] * 1e-9 - 0.022) / 5.0
    assert np.abs(lag).max() < 0.001


def test_losses_become_facts_and_spare_what_is_kept():
    facts = [
        fact
        for seed in range(20)
        for fact in recorded(PATHS, Recording(seconds=60.0, noise="vive", seed=seed), keep={"a": [(0.0, 60.0)]}).facts
    ]
    assert facts and all(fact.kind == "loss" and fact.bodies == ("b",) for fact in facts)


def test_tracks_carry_absolute_stamps():
    seen = recorded(PATHS, Recording(seconds=1.0))
    tracks = seen.tracks({"prop": seen.poses["a"]})
    assert list(tracks) == ["a", "b", "prop"]
    assert tracks["prop"].times_ns[0] == START_NS


@pytest.mark.parametrize("wrong", [{"noise": "loud"}, {"jitter": "odd"}, {"losses": "many"}, {"rate_hz": -1.0}])
def test_what_cannot_be_is_refused_by_name(wrong):
    with pytest.raises(SessionError, match=str(next(iter(wrong)))):
        Recording(**wrong)


def make(name, seconds=30.0, seed=0):
    return stamps(seconds, 90.0, CLOCKS[name], np.random.default_rng(seed))


def test_even_stamps_lie_on_the_rate_to_a_nanosecond():
    times = make("even", 2.0)
    assert len(times) == 181
    np.testing.assert_array_equal(times, np.rint(np.arange(181) * 1e9 / 90.0))


@pytest.mark.parametrize("name", CLOCKS)
@pytest.mark.parametrize("seed", range(5))
def test_stamps_start_at_zero_increase_and_end_in_time(name, seed):
    times = make(name, seed=seed)
    steps = np.diff(times) * 1e-9
    assert times[0] == 0
    assert times[-1] <= 30e9
    assert steps.min() >= 0.0023 - 1e-9
    assert steps.max() <= 0.128 + 1e-9


def test_browser_stamps_have_the_gaps_of_real_recordings():
    # Three A-Frame recordings: 59 of 1,126, 114 of 2,567 and 121 of 1,435 steps above 1.5 medians; median 11.2-11.3 ms;
    # standard deviation 2.9-4.9 ms.
    for seed in range(5):
        steps = np.diff(make("browser", seed=seed)) * 1e-6
        gaps = (steps > 1.5 * np.median(steps)).mean()
        assert 0.03 < gaps < 0.10
        assert 10.9 < np.median(steps) < 11.5
        assert 2.5 < steps.std() < 5.5


def test_impossible_rates_are_refused():
    with pytest.raises(ValueError, match="positive"):
        stamps(0.0, 90.0, CLOCKS["even"], np.random.default_rng(0))
    with pytest.raises(ValueError, match="lower the rate"):
        stamps(1.0, 1000.0, CLOCKS["steady"], np.random.default_rng(0))
