"""Mean, standard deviation and variance are three figures; the interval of the mean covers as it says."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.studies.paper.table_one import spread


def test_a_known_sample_has_the_known_mean_deviation_and_variance():
    number, mean, _, _, deviation, variance = spread([2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0])
    assert (number, mean) == (8, 5.0)
    assert variance == pytest.approx(32 / 7) and deviation == pytest.approx((32 / 7) ** 0.5)


@given(st.lists(st.floats(0, 1), min_size=1, max_size=40))
def test_the_interval_lies_within_the_values_and_the_same_values_give_the_same(values):
    _, _, low, high, *_ = spread(values)
    assert min(values) - 1e-12 <= low <= high <= max(values) + 1e-12
    assert spread(values) == spread(values)


def test_95_percent_intervals_cover_the_true_mean_about_that_often():
    rng = np.random.default_rng(1)
    covered = sum(low <= 0.5 <= high for _, _, low, high, *_ in (spread(rng.uniform(size=40)) for _ in range(300)))
    assert 0.89 < covered / 300 < 0.99


def test_nothing_measured_is_refused():
    with pytest.raises(ValueError, match="nothing was measured"):
        spread([])
