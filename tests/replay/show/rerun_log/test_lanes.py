"""Lanes of the picture: spans of equal words, resets between neighbours, order of pairs and of what people did."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.report_states import document_with
from support.small_worlds import verdicts

from replay.auditing.fault import FaultKind
from replay.auditing.outcome import Outcome
from replay.show.rerun_log.blueprint import LANE_POINTS, LOW_POINTS, RULER_POINTS, height_of_lanes
from replay.show.rerun_log.lanes import (
    log_detector_lanes,
    log_lane,
    log_pair_lanes,
    ranked_pairs,
    session_lanes,
    spans_of,
)


@pytest.mark.parametrize(
    ("nanoseconds", "labels", "spans"),
    [
        ([0, 10, 20, 30], ["", "a", "a", "b"], [("a", 10, 30), ("b", 30, 40)]),
        ([0, 10, 20, 50], ["a", "", "a", "a"], [("a", 0, 10), ("a", 20, 60)]),
        ([5], ["a"], [("a", 5, 6)]),
        ([], [], []),
    ],
)
def test_span_lasts_to_the_next_word_or_a_frame(nanoseconds, labels, spans):
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
    """The reset comes a nanosecond before b where b begins as a ends."""
    sent = []
    writer = SimpleNamespace(static=lambda *_: None, session_rows=lambda *row: sent.append(row))
    log_lane(writer, "lanes/x", spans, [("a", (0, 0, 0, 255)), ("b", (9, 9, 9, 255))])
    ((path, stamps, columns),) = sent
    (column,) = columns
    values = [value[0] if isinstance(value, list) else value for value in column.as_arrow_array().to_pylist()]
    assert path == "lanes/x" and list(zip(stamps.tolist(), values, strict=True)) == states


def test_pairs_are_ranked_by_missed_false_shared_and_other_contact():
    """A row of ``frames_of_pair`` is a pair, by its three frames; pair 8 is grasped and comes last.

    Pair 5, in contact never, has no lane.
    """
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


class SentLanes:
    """A writer of a recording with a frame every 10 ns, which keeps the words of lanes: path -> (frame, word)."""

    def __init__(self, frames):
        self.clock, self.lanes = SimpleNamespace(ns=10 * np.arange(frames)), {}

    def static(self, path, drawing):
        """Does nothing: colours are not kept."""

    def session_rows(self, path, stamps, columns):
        (column,) = columns
        values = [value[0] if isinstance(value, list) else value for value in column.as_arrow_array().to_pylist()]
        self.lanes[path] = [(ns // 10, word) for ns, word in zip(stamps.tolist(), values, strict=True) if word]


MISSED, FALSE, BOTH, NEITHER = Outcome.MISSED, Outcome.FALSE_CONTACT, Outcome.BOTH, Outcome.NEITHER


def miss(kind, pair, first, last):
    """A missed, late or cut short contact of a pair in these frames."""
    return SimpleNamespace(kind=kind, pair=pair, first=first, last=last)


def result_of_outcomes(outcomes, misses):
    """A run of ``exact`` and ``hull`` whose audit has these outcomes, a row a frame and a column a pair."""
    outcomes = np.array(outcomes, dtype=np.uint8)
    touched = np.isin(outcomes, (MISSED, BOTH, Outcome.GRASPED))
    reference = verdicts(["".join("C" if contact else "." for contact in row) for row in touched])
    pair_count = outcomes.shape[1]
    return SimpleNamespace(
        oracle="exact",
        ranking=(),
        document=document_with(),
        detections={"exact": reference, "hull": reference},
        comparisons={"hull": SimpleNamespace(outcome=outcomes, by_contact=outcomes)},
        misses={"hull": misses},
        assembly=SimpleNamespace(
            contact_columns=np.arange(pair_count),
            grasped=np.zeros(pair_count, dtype=bool),
            pair_name=lambda column: f"pair{column}",
        ),
    )


def test_lane_of_a_pair_calls_its_own_late_frames_late():
    """Pair 0 is reported two frames late and missed in frame 5; pair 1 is missed in frame 0, and late in frame 5."""
    outcomes = [
        [MISSED, MISSED], [MISSED, NEITHER], [BOTH, NEITHER], [NEITHER, NEITHER], [NEITHER, NEITHER], [MISSED, MISSED],
    ]  # fmt: skip
    misses = [
        miss(FaultKind.REPORTED_LATE, 0, 0, 1), miss(FaultKind.NEVER_REPORTED, 0, 5, 5),
        miss(FaultKind.NEVER_REPORTED, 1, 0, 0), miss(FaultKind.REPORTED_LATE, 1, 5, 5),
    ]  # fmt: skip
    sent = SentLanes(frames=6)
    log_pair_lanes(sent, result_of_outcomes(outcomes, misses), "hull")
    lanes = {path.rpartition("_")[2]: spans for path, spans in sent.lanes.items()}
    assert lanes == {"pair0": [(0, "late"), (2, "both"), (5, "MISSED")], "pair1": [(0, "MISSED"), (5, "late")]}


def test_lane_of_all_pairs_has_the_worst_and_wide_misses():
    """A miss fills at least three of 600 frames, 0.5 %; contact of a held body is none of the reference."""
    outcomes = np.full((600, 2), NEITHER)
    outcomes[10:20], outcomes[12, 1], outcomes[15, 0] = [BOTH, NEITHER], FALSE, MISSED
    outcomes[100, 0], outcomes[200:210, 0], outcomes[300, 0] = MISSED, MISSED, MISSED
    outcomes[400:402, 1] = Outcome.GRASPED
    misses = [
        miss(FaultKind.INTERRUPTED, 0, 15, 15), miss(FaultKind.NEVER_REPORTED, 0, 100, 100),
        miss(FaultKind.NEVER_REPORTED, 0, 200, 209), miss(FaultKind.REPORTED_LATE, 0, 300, 300),
    ]  # fmt: skip
    sent = SentLanes(frames=600)
    log_detector_lanes(sent, result_of_outcomes(outcomes, misses), ["hull"], ["reference", "hull"])
    assert sent.lanes["hull"] == [
        (10, "both"), (12, "false"), (13, "both"), (15, "late"), (18, "both"), (100, "MISSED"), (200, "MISSED"),
        (300, "late"),
    ]  # fmt: skip
    assert sent.lanes["reference"] == [(10, "contact"), (100, "contact"), (200, "contact"), (300, "contact")]


@pytest.mark.parametrize("lanes", [0, 1, 3])
def test_lanes_need_room_for_themselves_and_a_ruler(lanes):
    """Points of a screen; without lanes there is no ruler."""
    assert height_of_lanes(lanes) * LOW_POINTS == (RULER_POINTS + LANE_POINTS * lanes if lanes else 0)
