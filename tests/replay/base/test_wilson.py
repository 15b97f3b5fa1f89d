import numpy as np
import pytest
from scipy.stats import binomtest

from replay.base.wilson import share, wilson


@pytest.mark.parametrize(("count", "of"), [(0, 5), (5, 5), (1, 7), (865, 1000), (3, 100_000)])
def test_the_interval_is_the_one_of_scipy(count, of):
    expected = binomtest(count, of).proportion_ci(0.95, method="wilson")
    assert wilson(count, of) == pytest.approx((expected.low, expected.high), abs=1e-12)


def test_nothing_counted_leaves_everything_open():
    assert wilson(0, 0) == (0.0, 1.0)
    assert share(0, 0) == {"count": 0, "of": 0, "share": None, "low": 0.0, "high": 1.0}


def test_nineteen_of_twenty_intervals_hold_the_truth():
    counts = np.random.default_rng(0).binomial(200, 0.1, 2000)
    held = [low <= 0.1 <= high for low, high in (wilson(int(count), 200) for count in counts)]
    assert 0.93 < np.mean(held) < 0.97
