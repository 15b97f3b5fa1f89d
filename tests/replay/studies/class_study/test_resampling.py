import numpy as np
import pytest

from replay.auditing.wilson import wilson_interval
from replay.studies.class_study.resampling import Resampling


def test_ratio_is_sum_over_sum_of_students_with_a_base():
    result = Resampling(8).ratio(np.array([1, 3, 0, 0, 0, 0, 0, 9]), np.array([4, 4, 2, 0, 0, 0, 0, 0]))
    assert (result.value, result.students) == (4 / 10, 3)
    assert 0.0 <= result.low < 0.4 < result.high <= 1.0


@pytest.mark.parametrize("fraction", [0, 1])
def test_all_or_nothing_has_an_interval(fraction):
    result = Resampling(12).ratio(np.full(12, 3.0 * fraction), np.full(12, 3.0))
    assert (result.low, result.high) == wilson_interval(12 * fraction, 12) and result.low < result.high


@pytest.mark.slow
def test_intervals_hold_the_truth_in_about_95_of_100_classes():
    """Students differ more than their contacts do: an interval over contacts alone would hold it in 60."""
    random, kept, classes = np.random.default_rng(1), 0, 300
    for seed in range(classes):
        contacts, tendency = random.integers(5, 40, 30), random.beta(2, 6, 30)
        lost = random.binomial(contacts, tendency)
        result = Resampling(30, seed).ratio(lost, contacts)
        kept += result.low <= 0.25 <= result.high
    assert 0.90 <= kept / classes <= 0.985, kept
