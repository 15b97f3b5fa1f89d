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


def test_span_lasts_to_the_next_word_or_a_frame():
    """Time and word of each frame of a lane, "" for none; a span is a word with its begin and end.

    It ends where another word begins; the last frame lasts the median step, 10 ns here, a single one a nanosecond.
    """
    rows = {
        "two words": ([0, 10, 20, 30], ["", "a", "a", "b"], [("a", 10, 30), ("b", 30, 40)]),
        "a gap between": ([0, 10, 20, 50], ["a", "", "a", "a"], [("a", 0, 10), ("a", 20, 60)]),
        "a single frame": ([5], ["a"], [("a", 5, 6)]),
        "no frame": ([], [], []),
    }
    for row, (nanoseconds, texts, spans) in rows.items():
        writer = SimpleNamespace(clock=SimpleNamespace(ns=np.array(nanoseconds, dtype=np.int64)))
        assert spans_of(writer, np.array(texts, dtype=object)) == spans, row


@pytest.mark.parametrize(
    ("spans", "states"),
    [
        pytest.param([("a", 0, 5), ("b", 5, 9)], [(0, "a"), (4, ""), (5, "b"), (9, "")], id="b begins as a ends"),
        pytest.param([("a", 3, 5), ("b", 7, 9)], [(0, ""), (3, "a"), (5, ""), (7, "b"), (9, "")], id="a gap between"),
        pytest.param([], [(0, "")], id="nothing"),
    ],
)
def test_neighbours_in_a_lane_are_parted_by_a_reset(spans, states):
    """Spans (word, begin, end in nanoseconds) are sent as changes of state (time, word); "" resets the lane.

    Two spans without a gap are parted by a reset a nanosecond before the second.
    """
    sent = []
    writer = SimpleNamespace(static=lambda *_: None, session_rows=lambda *row: sent.append(row))
    colours_of_texts = [("a", (0, 0, 0, 255)), ("b", (9, 9, 9, 255))]
    log_lane(writer, "lanes/x", spans, colours_of_texts)
    ((path, stamps, (column,)),) = sent
    texts = [value[0] if isinstance(value, list) else value for value in column.as_arrow_array().to_pylist()]
    assert path == "lanes/x"
    assert list(zip(stamps.tolist(), texts, strict=True)) == states


def test_pairs_are_ranked_by_missed_false_shared_and_other_contact():
    """Outcomes of three frames of each of nine pairs, listed here in the order that their lanes must have.

    Most frames missed come first, then most false, then most that both report, then any within tolerance or between
    frames. A grasped pair (in a hand) comes last whatever it has; a pair never in contact has no lane.
    """
    missed, false, both = Outcome.MISSED, Outcome.FALSE_CONTACT, Outcome.BOTH
    tolerance, between, neither = Outcome.WITHIN_TOLERANCE, Outcome.BETWEEN_FRAMES, Outcome.NEITHER
    outcomes_by_rank = {
        1: [missed, missed, neither],
        0: [missed, both, both],
        2: [false, false, false],
        3: [false, both, both],
        4: [both, neither, neither],
        6: [tolerance, between, neither],
        7: [between, neither, neither],
        8: [missed, missed, missed],  # grasped
    }
    never_in_contact, grasped = 5, 8
    outcomes_of_pair = outcomes_by_rank | {never_in_contact: [neither, neither, neither]}
    by_frame = np.array([outcomes_of_pair[pair] for pair in range(9)], dtype=np.uint8).T
    is_grasped = np.arange(9) == grasped
    assert ranked_pairs(SimpleNamespace(by_contact=by_frame), is_grasped) == [*outcomes_by_rank]


def test_overlapping_intervals_of_a_kind_have_lanes_of_their_own():
    """A session from 100 to 200 ns with intervals (kind, name, begin, end): stages, a feature, one without a name.

    Stages "mix" and "stir" overlap, so there are two lanes of stages; then come other kinds by name. Intervals are cut
    at both ends of the session, counted from its begin, and left out where nothing is left. Without a name an interval
    is called by its kind.
    """
    recorded = [
        ("zoo", "", 120, 130), ("feature", "tilt", 110, 120), ("stage", "mix", 90, 150), ("stage", "stir", 140, 160),
        ("stage", "heat", 150, 260), ("stage", "after", 200, 210), ("stage", "before", 50, 100),
    ]  # fmt: skip
    intervals = [
        SimpleNamespace(kind=kind, name=name, start_ns=begin, end_ns=end) for kind, name, begin, end in recorded
    ]
    assembly = SimpleNamespace(stamp_ns=np.array([100, 150, 200]))
    result = SimpleNamespace(assembly=assembly, session=SimpleNamespace(intervals=intervals))
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
    """A missed, late or cut short contact of a pair from its first to its last frame."""
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
    """Six frames of two pairs. Pair 0 is reported two frames late, and missed in frame 5; pair 1 the other way round.

    Missed frames of a contact that is reported late are "late" in the lane of their pair, others "MISSED".
    """
    outcomes = [  # a row a frame: pair 0, pair 1
        [MISSED, MISSED],
        [MISSED, NEITHER],
        [BOTH, NEITHER],
        [NEITHER, NEITHER],
        [NEITHER, NEITHER],
        [MISSED, MISSED],
    ]
    misses = [
        miss(FaultKind.REPORTED_LATE, pair=0, first=0, last=1),
        miss(FaultKind.NEVER_REPORTED, pair=0, first=5, last=5),
        miss(FaultKind.NEVER_REPORTED, pair=1, first=0, last=0),
        miss(FaultKind.REPORTED_LATE, pair=1, first=5, last=5),
    ]
    sent = SentLanes(frames=6)
    log_pair_lanes(sent, result_of_outcomes(outcomes, misses), "hull")
    lanes = {path.rpartition("_")[2]: spans for path, spans in sent.lanes.items()}
    assert lanes == {"pair0": [(0, "late"), (2, "both"), (5, "MISSED")], "pair1": [(0, "MISSED"), (5, "late")]}


@pytest.fixture(scope="module")
def lanes_of_600_frames():
    """The lane of a detector and that of the reference, over two pairs: (first frame, word) of each span.

    Both pairs in frames 10 to 19: pair 0 is in contact, but for frame 15, which it misses; pair 1 is falsely reported
    in frame 12. Pair 0 alone is missed in frame 100, in 200 to 209, and, late, in 300. In 400 and 401 a hand holds the
    bodies of pair 1.
    """
    outcomes = np.full((600, 2), NEITHER)
    outcomes[10:20, 0] = BOTH
    outcomes[12, 1] = FALSE
    outcomes[15, 0] = MISSED
    outcomes[100, 0] = MISSED
    outcomes[200:210, 0] = MISSED
    outcomes[300, 0] = MISSED
    outcomes[400:402, 1] = Outcome.GRASPED
    misses = [
        miss(FaultKind.INTERRUPTED, pair=0, first=15, last=15),
        miss(FaultKind.NEVER_REPORTED, pair=0, first=100, last=100),
        miss(FaultKind.NEVER_REPORTED, pair=0, first=200, last=209),
        miss(FaultKind.REPORTED_LATE, pair=0, first=300, last=300),
    ]
    sent = SentLanes(frames=600)
    log_detector_lanes(sent, result_of_outcomes(outcomes, misses), ["hull"], ["reference", "hull"])
    return sent.lanes


def test_lane_of_all_pairs_has_the_worst_and_wide_misses(lanes_of_600_frames):
    """Both pairs have outcomes in frames 10 to 19, of which the worse counts: false in frame 12, late in frame 15.

    A miss is widened to three frames at least, 0.5 % of 600, so that it can be seen: frames 15 to 17. Later pair 0 is
    missed in frame 100 and in 200 to 209, and late in 300. Spans are given by their first frame.
    """
    assert lanes_of_600_frames["hull"] == [
        (10, "both"), (12, "false"), (13, "both"), (15, "late"), (18, "both"), (100, "MISSED"), (200, "MISSED"),
        (300, "late"),
    ]  # fmt: skip


def test_reference_lane_leaves_out_contact_of_a_grasped_body(lanes_of_600_frames):
    """The reference has contact in frames 10 to 19, 100, 200 to 209 and 300; in 400 and 401 a hand holds the body.

    Spans are given by their first frame.
    """
    contact_begins = [10, 100, 200, 300]
    assert lanes_of_600_frames["reference"] == [(frame, "contact") for frame in contact_begins]


@pytest.mark.parametrize("lanes", [1, 3])
def test_lanes_need_room_for_themselves_and_a_ruler(lanes):
    """Heights are in points of a screen, as a fraction of the lower part of the view: a ruler, and each lane."""
    assert height_of_lanes(lanes) * LOW_POINTS == RULER_POINTS + LANE_POINTS * lanes


def test_no_lanes_need_no_room():
    """Without lanes there is no ruler of time either."""
    assert height_of_lanes(0) == 0
