"""Table I: exact rows are complete, nobody invents, printed values stand only below their own heading."""

import json
import re

import pytest

from replay.studies.paper.calibration import SHARES
from replay.studies.paper.contestants import CONTESTANTS
from replay.studies.paper.printed import PRINTED, TABLE_1
from replay.studies.paper.table_one import BUDGETED, ask_group, joined, measure, tables_of

pytestmark = pytest.mark.slow


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


@pytest.mark.slow
def test_a_slower_calibration_gives_smaller_budgets(small):
    measured = measure(small.groups, {"seed": 0})
    assert measured.experiment == {"seed": 0} and set(measured.seconds) == set(CONTESTANTS)
    for name in BUDGETED:
        slower = {"hybrid": measured.seconds["hybrid"]} | {name: {"100": [9.0, 9.0]}}
        changed = type(measured)({}, {}, slower, measured.operations)
        assert changed.budget(name, 100, 1.0) < measured.budget(name, 100, 1.0)
