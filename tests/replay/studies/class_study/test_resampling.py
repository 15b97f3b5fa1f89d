import numpy as np
import pytest

from replay.base.wilson import wilson
from replay.studies.class_study.resampling import Resampling


def names(count):
    return [f"S{k}" for k in range(count)]


def test_a_ratio_is_the_sum_over_the_sum_and_only_students_with_a_base_stand_behind_it():
    found = Resampling(names(8)).ratio({"S0": 1, "S1": 3, "S7": 9}, {"S0": 4, "S1": 4, "S2": 2, "S3": 0})
    assert (found.value, found.students) == (4 / 10, 3)
    assert 0.0 <= found.low < 0.4 < found.high <= 1.0


@pytest.mark.parametrize("share", [0, 1])
def test_all_or_nothing_has_an_interval_too(share):
    base = dict.fromkeys(names(12), 3)
    found = Resampling(names(12)).ratio({name: share * n for name, n in base.items()}, base)
    assert (found.low, found.high) == wilson(12 * share, 12) and found.low < found.high


def test_intervals_hold_the_truth_in_about_95_of_100_classes():
    """Students differ more than their contacts do: an interval over contacts alone would hold it in 60."""
    random, held, classes = np.random.default_rng(1), 0, 300
    for seed in range(classes):
        who = names(30)
        contacts, tendency = random.integers(5, 40, 30), random.beta(2, 6, 30)
        drawn = Resampling(who, seed)
        lost = random.binomial(contacts, tendency)
        found = drawn.ratio(dict(zip(who, lost, strict=True)), dict(zip(who, contacts, strict=True)))
        held += found.low <= 0.25 <= found.high
    assert 0.90 <= held / classes <= 0.985, held
