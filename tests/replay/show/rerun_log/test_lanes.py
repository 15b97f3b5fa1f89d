"""Lanes of the picture: spans of equal words, resets between neighbours, order of pairs and of what people did."""

from types import SimpleNamespace

import numpy as np
import pytest

from replay.auditing.outcome import Outcome
from replay.show.rerun_log.lanes import log_lane, ranked_pairs, session_lanes, spans_of


@pytest.mark.parametrize(
    ("nanoseconds", "labels", "spans"),
    [
        ([0, 10, 20, 30], ["", "a", "a", "b"], [("a", 10, 30), ("b", 30, 40)]),
        ([0, 10, 20, 50], ["a", "", "a", "a"], [("a", 0, 10), ("a", 20, 60)]),
        ([5], ["a"], [("a", 5, 6)]),
        ([], [], []),
    ],
)
def test_span_lasts_to_the_next_word_or_one_frame(nanoseconds, labels, spans):
    """A frame lasts the median step; alone, a nanosecond."""
    writer = SimpleNamespace(clock=SimpleNamespace(ns=np.array(nanoseconds, dtype=np.int64)))
    assert spans_of(writer, np.array(labels, dtype=object)) == spans


@pytest.mark.parametrize(
    ("spans", "states"),
    [
        ([("a", 0, 5), ("b", 5, 9)], [(0, "a"), (4, ""), (5, "b"), (9, "")]),
        ([("a", 3, 5), ("b", 7, 9)], [(0, ""), (3, "a"), (5, ""), (7, "b"), (9, "")]),
        ([], [(0, "")]),
    ],
)
def test_neighbours_in_a_lane_are_parted_by_a_reset(spans, states):
    """Where b begins as a ends, the reset comes a nanosecond earlier."""
    sent = []
    writer = SimpleNamespace(static=lambda *_: None, session_rows=lambda *row: sent.append(row))
    log_lane(writer, "lanes/x", spans, [("a", (0, 0, 0, 255)), ("b", (9, 9, 9, 255))])
    ((path, stamps, columns),) = sent
    (column,) = columns
    values = [value[0] if isinstance(value, list) else value for value in column.as_arrow_array().to_pylist()]
    assert path == "lanes/x" and list(zip(stamps.tolist(), values, strict=True)) == states


def test_pairs_are_ranked_by_missed_false_shared_and_other_contact():
    """A column a pair, a frame a row; the last pair is held, and the one that is in contact never has no lane."""
    missed, false, both = Outcome.MISSED, Outcome.FALSE_CONTACT, Outcome.BOTH
    tolerance, between, neither = Outcome.WITHIN_TOLERANCE, Outcome.BETWEEN_FRAMES, Outcome.NEITHER
    frames_of_pair = [
        [missed, both, both], [missed, missed, neither], [false, false, false], [false, both, both],
        [both, neither, neither], [neither] * 3, [tolerance, between, neither], [between, neither, neither],
        [missed] * 3,
    ]  # fmt: skip
    comparison = SimpleNamespace(by_contact=np.array(frames_of_pair, dtype=np.uint8).T)
    is_grasped = np.arange(len(frames_of_pair)) == 8
    assert ranked_pairs(comparison, is_grasped) == [1, 0, 2, 3, 4, 6, 7, 8]


def test_overlapping_intervals_of_a_kind_have_lanes_of_their_own():
    """The session lasts from 100 to 200 ns; an interval is cut at its ends and counted from its beginning."""
    interval_rows = [
        ("zoo", "", 120, 130), ("feature", "tilt", 110, 120), ("stage", "mix", 90, 150), ("stage", "stir", 140, 160),
        ("stage", "heat", 150, 260), ("stage", "after", 200, 210), ("stage", "before", 50, 100),
    ]  # fmt: skip
    intervals = [SimpleNamespace(kind=kind, name=name, start_ns=a, end_ns=b) for kind, name, a, b in interval_rows]
    stamps = np.array([100, 150, 200])
    result = SimpleNamespace(assembly=SimpleNamespace(stamp_ns=stamps), session=SimpleNamespace(intervals=intervals))
    lanes = {path.rpartition("/")[2]: spans for path, spans in session_lanes(result).items()}
    assert lanes == {
        "1_stage": [("mix", 0, 50), ("heat", 50, 100)],
        "2_stage": [("stir", 40, 60)],
        "3_feature": [("tilt", 10, 20)],
        "4_zoo": [("zoo", 20, 30)],
    }
