import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment
from support.small_worlds import verdict_column

from replay.auditing.compare import compare
from replay.auditing.contact_counts import count_contacts
from replay.auditing.episodes import episodes
from replay.auditing.matching import match_episodes


def matched(subject, oracle, within=None, reach=0):
    """Contacts of a detector matched with those of the reference.

    ``within``: frames and pairs that are within tolerance. ``reach``: frames after its last that a report still covers.
    """
    comparison, truth = compare(subject, oracle, within=within), episodes(oracle)
    return match_episodes(comparison, truth, episodes(subject), count_contacts(comparison, truth), reach)


ROWS = tomllib.loads(Path(__file__).with_name("letters.toml").read_text("utf-8"))["match"]
"""Verdicts of a detector (``subject``) and the reference (``oracle``), a letter a frame, and how contacts are matched.

Contacts of each side are numbered from 1. ``matched`` lists [true contact, reported contact, frames in common, seconds
by which it begins late, seconds by which it lasts too long]; the other keys list numbers of contacts.
"""


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["why"])
def test_coded_frames_have_their_matches(row):
    """A row of letters.toml: what a detector (subject) and the reference (oracle) say, C for contact, a letter a frame.

    ``matched`` lists [true contact, report, frames in common, seconds late, seconds too long]; other keys list numbers
    of contacts or reports, from 1. What a row does not mention is not tested by it.
    """
    kinds = row.get("covers", ["instants"] * 2)
    sides = [verdict_column(row[name], covers=kind) for name, kind in zip(("subject", "oracle"), kinds, strict=True)]
    frames_within_tolerance = row.get("within", [])
    actual = matched(*sides, lambda frames, _: np.isin(frames, frames_within_tolerance), row.get("reach", 0))

    expected = {key: row[key] for key in row.keys() - {"why", "subject", "oracle", "covers", "within", "reach"}}
    assert expected, "the row says what comes out"
    for pair, figures in zip(actual.matched, expected.pop("matched", ()), strict="matched" in row):
        actual_figures = [pair.truth, pair.reported, pair.overlap, pair.onset_error, pair.duration_error]
        assert actual_figures == pytest.approx(figures)
    assert {name: list(getattr(actual, name)) for name in expected} == expected


def test_each_report_of_a_split_contact_has_its_word():
    """A contact of seven frames is reported in three pieces of 1, 3 and 1 frames: the longest, report 2, is matched."""
    result = matched(subject=verdict_column(".C.CCC.C."), oracle=verdict_column(".CCCCCCC."))
    assert result.status() == {1: "piece", 2: "matched", 3: "piece"}


CODES = st.lists(st.sampled_from(".CC"), min_size=1, max_size=60)
"""A letter a frame: C contact, two in three, or . clear."""


@given(CODES, CODES)
def test_the_total_overlap_is_that_of_the_hungarian_method(left, right):
    """Matches share as many frames in all as SciPy's best assignment; each contact of either side is counted once."""
    size = min(len(left), len(right))
    subject, oracle = verdict_column(left[:size]), verdict_column(right[:size])
    contacts, reports = episodes(oracle), episodes(subject)
    frames_in_common = np.zeros((len(contacts), len(reports)), dtype=int)
    for row, contact in enumerate(contacts):
        for column, report in enumerate(reports):
            last, first = min(contact.last, report.last), max(contact.first, report.first)
            frames_in_common[row, column] = max(0, last - first + 1)
    rows, columns = linear_sum_assignment(frames_in_common, maximize=True)

    actual = matched(subject, oracle)
    assert sum(match.overlap for match in actual.matched) == frames_in_common[rows, columns].sum()
    matched_contacts, matched_reports = ([getattr(m, side) for m in actual.matched] for side in ("truth", "reported"))
    contact_numbers = [*matched_contacts, *actual.missed, *actual.absorbed, *actual.excused_truth]
    report_numbers = [*matched_reports, *actual.false_contacts, *actual.pieces, *actual.excused_reports]
    assert sorted(contact_numbers) == list(range(1, len(contacts) + 1))
    assert sorted(report_numbers) == list(range(1, len(reports) + 1))
