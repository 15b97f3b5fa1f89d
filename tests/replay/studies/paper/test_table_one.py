"""Table I: exact rows are complete, nobody invents; the printed values and the statistics beside them."""

import json
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.studies.paper.calibration import SHARES, Calibration
from replay.studies.paper.contestants import CONTESTANTS
from replay.studies.paper.fixtures import TARGETS
from replay.studies.paper.printed import ACCURACY, OURS, PRINTED, TABLE_1, TIME_TO_RAPID, VARIANCE
from replay.studies.paper.table_one import BUDGETED, ask_group, joined, measure, spread, tables_of


def named(result, key):
    return next(one for one in result.tables if one.key == key)


@pytest.mark.slow
def test_complete_rows_find_every_face_and_every_row_has_precision_one(small):
    for row in named(small, "T1a").rows:
        name, poses, whole, _, faces, pairs, precision, *_ = row
        assert poses == 2 and precision in (1.0, None)
        if CONTESTANTS[name].complete:
            assert (whole, faces, pairs) == (2, 1.0, 1.0)
        assert precision == 1.0 or faces == 0.0


@pytest.mark.slow
def test_recall_does_not_decrease_with_the_budget(small):
    one = named(small, "T1b")
    for name in BUDGETED:
        recalls = [row[5] for row in one.rows if row[0] == name]
        assert len(recalls) == len(SHARES)
        if CONTESTANTS[name].complete:
            assert recalls == sorted(recalls)


@pytest.mark.slow
def test_mean_deviation_and_variance_are_columns_of_their_own(small):
    one = named(small, "F7ab")
    for deviation, variance in zip(one.column("standard deviation"), one.column("variance"), strict=True):
        assert variance == pytest.approx(deviation**2)


@pytest.mark.slow
def test_printed_values_stand_below_the_heading_that_says_what_they_are(small):
    for key in ("Table I", "F7ab", "F7c"):
        heads = [head for head in named(small, key).head if re.search("print", head)]
        assert heads and all(PRINTED in head for head in heads)
    assert named(small, "Table I").column(PRINTED) == [TABLE_1[n][100] for n in TABLE_1]


@pytest.mark.slow
def test_the_same_calibration_gives_the_same_tables_to_the_last_bit(small):
    again = tables_of(joined([ask_group(group, small.calibration) for group in small.groups]), small.calibration)
    first = [vars(one) for one in small.tables[: len(again)]]
    assert json.dumps(first) == json.dumps([vars(one) for one in again])


def test_a_budget_is_what_a_row_does_in_that_time_and_operations_take_their_share_of_it():
    seconds = {"hybrid": {100: [0.002, 0.004]}, "obb": {200: [0.03], 100: [0.01, 0.03]}}
    measured = Calibration({}, seconds, {"hybrid": {100: [0, 0]}, "obb": {100: [300, 500], 200: [1]}})
    assert [measured.budget("obb", 100, share) for share in (1e-9, 0.5, 1.0, 2.0)] == [1, 30, 60, 120]
    assert measured.seconds_of("obb", 100, 20) == pytest.approx(0.001)
    assert measured.all_seconds("obb") == [0.01, 0.03, 0.03]


@pytest.mark.slow
def test_a_slower_calibration_gives_smaller_budgets(small):
    measured = measure(small.groups)
    assert set(measured.seconds) == set(CONTESTANTS)
    for name in BUDGETED:
        slower = {"hybrid": measured.seconds["hybrid"]} | {name: {100: [9.0, 9.0]}}
        changed = type(measured)({}, slower, measured.operations)
        assert changed.budget(name, 100, 1.0) < measured.budget(name, 100, 1.0)


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
