from __future__ import annotations

import numpy as np
import pytest

from sessions.synthetic.clock import CLOCKS, stamps


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
