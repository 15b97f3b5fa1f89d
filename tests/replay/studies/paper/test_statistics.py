"""Mean, standard deviation and variance are three figures; the interval of the mean covers as it says."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.studies.paper.fixtures import TARGETS
from replay.studies.paper.printed import ACCURACY, OURS, TABLE_1, TIME_TO_RAPID, VARIANCE
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


def test_row_means_and_deviations_of_table_1_are_those_checked_by_hand():
    known = {"solid-style": (0.8659, 0.0472), "rapid-style": (0.8803, 0.0615), "hybrid-qaco": (0.9567, 0.0215)}
    for name, (mean, deviation) in known.items():
        shares = [TABLE_1[name][target] / target for target in TARGETS]
        assert abs(np.mean(shares) - mean) < 5e-5 and abs(np.std(shares) - deviation) < 5e-5
    assert sum(TABLE_1["solid-style"].values()) == 4658


def test_every_printed_row_has_a_row_here_and_all_counts_are_even():
    assert set(TABLE_1) == set(OURS) == set(ACCURACY) == set(VARIANCE) == set(TIME_TO_RAPID)
    assert all(count % 2 == 0 for row in TABLE_1.values() for count in row.values())
    assert (99 / 132, round(105 / 132, 3)) == (TIME_TO_RAPID["hybrid-qaco"], TIME_TO_RAPID["solid-style"])
