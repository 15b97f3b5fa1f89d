import numpy as np
import pytest

from sessions.errors import SessionError
from sessions.synthetic.assembly import CLOCKS, Recording, recorded, stamps
from sessions.synthetic.paths import Key, KeyPath, Standing

PATHS = {
    "a": Standing((0.0, 1.0, 0.0)),
    "b": KeyPath([Key(0.0, (0.0, 0.0, 0.0)), Key(5.0, (1.0, 0.0, 0.0), ease="linear")]),
}


def test_noise_comes_late_and_a_bodys_noise_does_not_depend_on_others():
    how = Recording(seconds=5.0, noise="vive", seed=4)
    both, alone = recorded(PATHS, how), recorded({"b": PATHS["b"]}, how)
    np.testing.assert_array_equal(both.poses["b"][0], alone.poses["b"][0])
    assert both.valid["b"].all()
    lag = both.poses["b"][0][20:, 0] - (both.stamps[20:] * 1e-9 - 0.022) / 5.0
    assert np.abs(lag).max() < 0.001


@pytest.mark.parametrize("wrong", [{"noise": "loud"}, {"jitter": "odd"}, {"rate_hz": -1.0}])
def test_what_cannot_be_is_refused_by_name(wrong):
    with pytest.raises(SessionError, match=str(next(iter(wrong)))):
        Recording(**wrong)


def make(name, seconds=30.0, seed=0):
    return stamps(seconds, 90.0, CLOCKS[name], np.random.default_rng(seed))


@pytest.mark.parametrize("name", CLOCKS)
@pytest.mark.parametrize("seed", range(5))
def test_stamps_start_at_zero_increase_and_end_in_time(name, seed):
    times = make(name, seed=seed)
    steps = np.diff(times) * 1e-9
    assert times[0] == 0
    assert times[-1] <= 30e9
    assert steps.min() >= 0.0023 - 1e-9
    assert steps.max() <= 0.128 + 1e-9
