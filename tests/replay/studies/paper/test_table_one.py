"""Table I: exact rows are complete, nobody invents; the printed values and the statistics beside them."""

import re

import numpy as np
import pytest

from replay.studies.paper.fixtures import TARGETS
from replay.studies.paper.printed import ACCURACY, OURS, PRINTED, TABLE_1, TIME_TO_RAPID, VARIANCE
from replay.studies.paper.rows import PoseAnswer
from replay.studies.paper.table_one import budget, spread


@pytest.mark.slow
def test_printed_values_stand_below_the_heading_that_says_what_they_are(small):
    for key in ("Table I", "F7ab", "F7c"):
        heads = [head for head in small[key].head if re.search("print", head)]
        assert heads and all(PRINTED in head for head in heads)
    assert small["Table I"].column(PRINTED) == [TABLE_1[name][100] for name in TABLE_1]


def answer(target, operations, seconds):
    return PoseAnswer(target, 1, 1, 1, 1, 1, operations, seconds)


def test_a_budget_is_what_a_row_does_in_that_time():
    complete = {
        "hybrid": [answer(100, 0, 0.002), answer(100, 0, 0.004), answer(200, 0, 9.0)],
        "obb": [answer(200, 1, 0.03), answer(100, 300, 0.01), answer(100, 500, 0.03)],
    }
    assert [budget(complete, "obb", 100, share) for share in (1e-9, 0.5, 1.0, 2.0)] == [1, 30, 60, 120]


def test_row_means_and_deviations_of_table_1_are_those_checked_by_hand():
    known = {"solid-style": (0.8659, 0.0472), "rapid-style": (0.8803, 0.0615), "hybrid-qaco": (0.9567, 0.0215)}
    for name, (mean, deviation) in known.items():
        shares = [TABLE_1[name][target] / target for target in TARGETS]
        assert abs(np.mean(shares) - mean) < 5e-5 and abs(np.std(shares) - deviation) < 5e-5
    assert sum(TABLE_1["solid-style"].values()) == 4658
    assert set(TABLE_1) == set(OURS) == set(ACCURACY) == set(VARIANCE) == set(TIME_TO_RAPID)
    assert (99 / 132, round(105 / 132, 3)) == (TIME_TO_RAPID["hybrid-qaco"], TIME_TO_RAPID["solid-style"])


def test_a_known_sample_has_the_known_mean_deviation_and_variance():
    number, mean, _, _, deviation, variance = spread([2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0])
    assert (number, mean) == (8, 5.0)
    assert variance == pytest.approx(32 / 7) and deviation == pytest.approx((32 / 7) ** 0.5)
