"""Mean, standard deviation and variance are three figures; the interval of the mean covers as it says."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.studies.paper.table_one import quartiles, spread


def test_a_known_sample_has_the_known_mean_deviation_and_variance():
    one = spread([2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0])
    assert (one.n, one.mean) == (8, 5.0)
    assert one.variance == pytest.approx(32 / 7) and one.sd == pytest.approx((32 / 7) ** 0.5)


@given(st.lists(st.floats(0, 1), min_size=1, max_size=40))
def test_the_interval_lies_within_the_values_and_the_same_values_give_the_same(values):
    one = spread(values)
    assert min(values) - 1e-12 <= one.low <= one.high <= max(values) + 1e-12
    assert one == spread(values)


def test_95_percent_intervals_cover_the_true_mean_about_that_often():
    rng = np.random.default_rng(1)
    covered = sum(one.low <= 0.5 <= one.high for one in (spread(rng.uniform(size=40)) for _ in range(300)))
    assert 0.89 < covered / 300 < 0.99


def test_nothing_measured_is_refused():
    with pytest.raises(ValueError, match="nothing was measured"):
        spread([])


def test_quartiles_of_one_to_five():
    assert quartiles([5, 1, 4, 2, 3]) == (2.0, 3.0, 4.0)
