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
    """Contacts of a detector matched with those of the reference."""
    comparison, truth = compare(subject, oracle, within=within), episodes(oracle)
    return match_episodes(comparison, truth, episodes(subject), count_contacts(comparison, truth), reach)


ROWS = tomllib.loads(Path(__file__).with_name("letters.toml").read_text("utf-8"))["match"]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["why"])
def test_coded_frames_have_their_matches(row):
    """A row of letters.toml: verdicts of subject and oracle, a letter a frame, and how contacts are matched."""
    kinds = row.get("covers", ["instants"] * 2)
    sides = [verdict_column(row[name], covers=kind) for name, kind in zip(("subject", "oracle"), kinds, strict=True)]
    actual = matched(*sides, lambda frames, _: np.isin(frames, row.get("within", [])), row.get("reach", 0))
    assert row.keys() <= vars(actual).keys() | {"why", "subject", "oracle", "covers", "within", "reach"}
    for item, reported in zip(actual.matched, row.get("matched", actual.matched), strict=True):
        figures = [item.truth, item.reported, item.overlap, item.onset_error, item.duration_error]
        assert reported is item or figures == pytest.approx(reported)
    rest = row.keys() & vars(actual).keys() - {"matched"}
    assert {name: list(getattr(actual, name)) for name in rest} == {name: row[name] for name in rest}


def test_each_report_of_a_split_contact_has_its_word():
    """A contact of seven frames is reported in three parts of 1, 3 and 1 frames: the longest is matched."""
    result = matched(verdict_column(".C.CCC.C."), verdict_column(".CCCCCCC."))
    assert result.status() == {1: "piece", 2: "matched", 3: "piece"}


codes = st.lists(st.sampled_from(".CC"), min_size=1, max_size=60)


@given(codes, codes)
def test_the_total_overlap_is_that_of_the_hungarian_method(left, right):
    """A report is matched to at most one contact, and each of either is counted once."""
    size = min(len(left), len(right))
    subject, oracle = verdict_column(left[:size]), verdict_column(right[:size])
    truth, result = episodes(oracle), episodes(subject)
    weight = np.array(
        [[max(0, min(a.last, b.last) - max(a.first, b.first) + 1) for b in result] for a in truth]
    ).reshape(len(truth), len(result))
    rows, partners = linear_sum_assignment(weight, maximize=True)
    actual = matched(subject, oracle)
    assert sum(m.overlap for m in actual.matched) == weight[rows, partners].sum()
    assert len({m.truth for m in actual.matched}) == len({m.reported for m in actual.matched}) == len(actual.matched)
    assert len(actual.matched) + len(actual.missed) + len(actual.absorbed) + len(actual.excused_truth) == len(truth)
    assert len(actual.matched) + len(actual.false_contacts) + len(actual.pieces) + len(actual.excused_reports) == len(
        result
    )
