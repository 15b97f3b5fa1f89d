"""The longest part is checked by the quadratic recurrence; wild stamps are planted among known ones."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sessions.errors import ImportFileError
from sessions.importers.csv_head import is_date_or_time
from sessions.importers.ledger import Ledger, increasing_rows, last_of_each_stamp, longest_increasing
from sessions.importers.wall_clock import DAY_NS, past_midnight, wall_clock_ns

STEP_NS = 11_111_111
STAMPS = STEP_NS * np.arange(180, dtype=np.int64)


def longest_increase(values):
    """Length of the longest increasing selection, by the quadratic recurrence."""
    lengths = []
    for index, value in enumerate(values):
        lengths.append(1 + max((lengths[k] for k in range(index) if values[k] < value), default=0))
    return max(lengths, default=0)


@given(st.lists(st.integers(0, 12), max_size=25))
def test_longest_increasing_subsequence_stays(values):
    """Up to 25 stamps are random: the rows that stay increase, and are as many as the plain recurrence says."""
    stamps = np.array(values, dtype=np.int64)
    stay = longest_increasing(stamps)
    assert (np.diff(stamps[stay]) > 0).all()
    assert stay.sum() == longest_increase(values)


def rows_and_ledger(stamps):
    """A mask of the cup's rows whose stamps increase, each row with another value, and the ledger of the others."""
    ledger = Ledger("log")
    return increasing_rows("cup", stamps, (np.arange(len(stamps), dtype=np.float64),), ledger), ledger


@pytest.mark.parametrize(
    "wild",
    [{60: 2 * 10**14}, {60: 0}, {0: 10**15}, {179: 5}, {3: 10**15, 90: 10**15 + 1, 91: 0, 178: 7}, {17: -5}],
    ids=["late", "zero", "first", "last", "four", "before 0"],
)
def test_only_rows_with_outlying_stamps_are_dropped(wild):
    """180 rows are 11 ms apart but for a few; ``wild``: row -> its stamp in place of the regular one, nanoseconds.

    These few rows alone are dropped, though one may be above all that follow.
    """
    stamps = STAMPS.copy()
    stamps[[*wild]] = [*wild.values()]
    keep, ledger = rows_and_ledger(stamps)
    assert np.flatnonzero(~keep).tolist() == [*wild]
    (entry,) = ledger
    assert (entry.read, entry.kept, entry.lost) == (180, 180 - len(wild), len(wild))


@pytest.mark.parametrize(
    "stamps",
    [
        np.concatenate([STAMPS, STAMPS]),
        np.concatenate([STAMPS, STAMPS[:40] + 7]),
        np.concatenate([STAMPS[:100], STAMPS[100:130] + 10**15, STAMPS[130:]]),
        np.concatenate([STAMPS[100:], STAMPS]),
    ],
    ids=["twice", "a part again", "ahead for a while", "the end first"],
)
def test_a_clock_that_starts_again_is_refused(stamps):
    """After 180 regular stamps, or between them, at least 30 in a row go on from another time."""
    with pytest.raises(ImportFileError, match=r"log: the clock of 'cup' starts again: its samples .* correct the stam"):
        rows_and_ledger(stamps)


def test_equal_stamps_keep_a_single_sample_and_count_others():
    """90 different samples are all stamped 5 ns: the first stays, and the 89 others are counted as dropped."""
    keep, ledger = rows_and_ledger(np.full(90, 5, dtype=np.int64))
    assert np.flatnonzero(keep).tolist() == [0]
    assert ledger.sentences() == ["cup: 89 of 90 samples dropped: with the stamp of another sample"]


def test_a_state_takes_the_last_value_of_each_stamp():
    """Rows 0 to 4 of a trigger have stamps 3, 1, 3, 2, 1: rows 4, 3 and 2 are the last of 1, 2 and 3; two are lost."""
    rows = last_of_each_stamp("trigger", np.array([3, 1, 3, 2, 1]), ledger := Ledger("log"))
    assert rows.tolist() == [4, 3, 2]
    assert [entry.lost for entry in ledger] == [2]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1970-01-01T00:00:01.123456789Z", 1_123_456_789),
        ("1970-01-01T01:00:02,5+01:00", 2_500_000_000),
        ("2024-03-01T09:00:00", 1_709_283_600_000_000_000),
        ("1970-01-01 00:00:00.000000001999Z", 1),
        ("19700101T000001.123456789Z", 1_123_456_789),
    ],
)
def test_a_date_keeps_its_nanoseconds(text, expected):
    """``expected``: nanoseconds since 1970 in UTC, which is meant where no zone is written."""
    assert wall_clock_ns(text) == expected


MINUTE_NS = 60_000_000_000
LATE, EARLY = DAY_NS - MINUTE_NS, MINUTE_NS
"""Times of day a minute before and after midnight."""


@pytest.mark.parametrize(
    ("times", "days"),
    [
        pytest.param([LATE, EARLY, EARLY], [0, 1, 1], id="in order"),
        pytest.param([EARLY, LATE, EARLY], [1, 0, 1], id="out of order"),
        pytest.param([EARLY, EARLY], [0, 0], id="no midnight"),
        pytest.param([], [], id="no times"),
    ],
)
def test_times_of_day_go_on_past_midnight(times, days):
    """So many days are added to times of day, in nanoseconds, that each is two minutes or less from the others."""
    result = past_midnight(np.array(times, dtype=np.int64))
    assert result.tolist() == [time + day * DAY_NS for time, day in zip(times, days, strict=True)]


@pytest.mark.parametrize(
    ("text", "form", "expected"),
    [
        ("01:02:03", "%H:%M:%S", 3_723_000_000_000),  # 3600 + 2 * 60 + 3 seconds
        ("02.01.1971 00:00:01.5", "%d.%m.%Y %H:%M:%S.%f", 366 * DAY_NS + 1_500_000_000),  # 1970 has 365 days
    ],
)
def test_time_in_a_form_counts_from_midnight_or_1970(text, form, expected):
    """``expected``: nanoseconds from midnight, or from 1970 on where there is a date."""
    assert wall_clock_ns(text, form) == expected


def test_dates_and_times_differ_from_other_texts():
    """Dates in three forms, a time, and both are moments; a word, numbers, a date of mixed signs and "" are none."""
    moments = ("2026-03-28", "28.03.2026", "3/28/26", "12:00:01", "2026-03-28T12:00:01")
    assert all(map(is_date_or_time, moments))
    assert not any(map(is_date_or_time, ("cup", "12", "1.5", "2026-03.28", "")))
