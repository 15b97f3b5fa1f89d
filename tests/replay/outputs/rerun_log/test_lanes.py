"""Lanes say exactly when, the worst pair first, and no change is lost between neighbours."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from cdcore.protocol import counts_as_contact
from replay.comparison.outcome import Comparison, Outcome
from replay.outputs.palette import OUTCOMES
from replay.outputs.rerun_log.lanes import detector_lanes, pair_lanes, ranked_pairs, session_lanes
from sessions import Interval

SUBJECT = "22.5Hz"


def states_at(lane, stamps):
    times = [ns for ns, _ in lane]
    return [lane[k][1] for k in np.searchsorted(times, stamps, side="right") - 1]


def lane_of(run, name):
    """The path of the lane of a pair."""
    (path,) = [path for path in pair_lanes(run, SUBJECT) if path.endswith(f"_{name}")]
    return path


def test_a_lane_says_the_outcome_of_every_frame_and_its_name_has_nothing_to_escape(demo, read):
    stamps = demo.assembly.stamp_ns - demo.assembly.stamp_ns[0]
    comparison = demo.comparisons[SUBJECT]
    lanes = pair_lanes(demo, SUBJECT)
    names = [path.rpartition("/")[2] for path in lanes]
    assert names == ["1_beaker-rod", "2_bench-rod", "3_rod-hand_held"]
    for path, column in lanes.items():
        words = [OUTCOMES[code][0] if code else "" for code in comparison.outcome[:, column].tolist()]
        assert states_at(read.lane(path), stamps) == words
        assert all("" in (before, after) for (_, before), (_, after) in pairwise(read.lane(path))), (
            "else merged to grey"
        )


def test_the_lanes_of_all_detectors_say_what_each_is_and_show_the_worst_of_all_pairs(demo, read):
    stamps = demo.assembly.stamp_ns - demo.assembly.stamp_ns[0]
    reference, subject = detector_lanes(demo, [SUBJECT])
    assert (reference, subject) == (
        "1_hybrid_is_the_reference",
        f"2_22.5Hz\u02d0_{demo.ranking[0].what.replace(', ', '_').replace(' ', '_')}",
    )
    contact = [state == "contact" for state in states_at(read.lane(reference), stamps)]
    outcome, verdict = demo.comparisons[SUBJECT].outcome, demo.detections[demo.oracle].verdict
    assert contact == (counts_as_contact(verdict) & (outcome != Outcome.HELD)).any(axis=1).tolist()
    wide = round(0.005 * len(outcome))
    red = {frame for miss in demo.misses[SUBJECT] for frame in range(miss.first, miss.first + wide)}
    seen = states_at(read.lane(subject), stamps)
    codes = (Outcome.MISSED, Outcome.INVENTED, Outcome.BOTH)
    for frame, word in enumerate(seen):
        worst = next((OUTCOMES[code][0] for code in codes if (outcome[frame] == code).any()), "")
        assert word == ("MISSED" if frame in red else worst), frame
    assert all(seen[miss.first] == "MISSED" for miss in demo.misses[SUBJECT])


def test_pairs_are_ranked_by_missed_frames_and_held_ones_come_last():
    outcome = np.zeros((10, 5), dtype=np.uint8)
    outcome[:1, 0], outcome[:3, 1], outcome[:5, 2] = Outcome.MISSED, Outcome.MISSED, Outcome.BOTH
    outcome[:9, 3] = Outcome.MISSED
    held = np.array([False, False, False, True, False])
    assert ranked_pairs(Comparison("s", "o", outcome), held) == [1, 0, 2, 3]


def test_the_last_state_lasts_one_frame(demo, drawn):
    whole = np.full_like(demo.comparisons[SUBJECT].outcome, Outcome.MISSED)
    missed = replace(demo, comparisons={SUBJECT: replace(demo.comparisons[SUBJECT], outcome=whole)})
    seen = drawn(missed)
    stamps = demo.assembly.stamp_ns - demo.assembly.stamp_ns[0]
    lane = seen.lane(lane_of(missed, "beaker-rod"))
    assert lane[-2:] == [(0, "MISSED"), (int(stamps[-1]) + 11_111_111, "")]


S = 1_000_000_000


def during(demo, *intervals):
    """The run with intervals in seconds after its first frame: kind, start, end, name."""
    zero = int(demo.assembly.stamp_ns[0])
    made = [Interval(zero + round(a * S), zero + round(b * S), kind, name) for kind, a, b, name in intervals]
    return replace(demo, session=replace(demo.session, intervals=tuple(made)))


TASKS = [
    ("task", 0.2, 1.0, "stir"), ("task", 0.8, 1.5, "carry"), ("task", 1.0, 2.0, "tap"), ("stage", 0.0, 2.5, "lesson"),
    ("feature", 0.5, 0.6, "hint"), ("quiz", 1.0, 1.2, "q1"),
]  # fmt: skip


def test_stages_come_first_and_spans_that_overlap_have_a_lane_each(demo):
    run = during(demo, *TASKS)
    lanes = session_lanes(run)
    words = {path: [word for word, *_ in spans] for path, spans in lanes.items()}
    assert words == {
        "doing/1_stage": ["lesson"], "doing/2_task": ["stir", "tap"], "doing/3_task": ["carry"],
        "doing/4_feature": ["hint"], "doing/5_quiz": ["q1"],
    }  # fmt: skip
    assert lanes["doing/2_task"] == [("stir", S // 5, S), ("tap", S, 2 * S)]


@pytest.mark.parametrize("span", [("task", -5.0, -1.0, "before"), ("task", 900.0, 901.0, "after")])
def test_what_lies_outside_the_frames_has_no_lane_and_what_reaches_out_is_cut(demo, span):
    assert session_lanes(during(demo, span)) == {}
    last = int(np.ptp(demo.assembly.stamp_ns))
    assert session_lanes(during(demo, ("task", -5.0, 901.0, "all"))) == {"doing/1_task": [("all", 0, last)]}
