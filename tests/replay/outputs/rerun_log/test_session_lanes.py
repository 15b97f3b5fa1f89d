"""What people did stands in lanes of its own: every span once, none over another, in its own words."""

from dataclasses import replace

import numpy as np
import pytest

from replay.outputs.rerun_log.session_lanes import session_lanes
from sessions import Interval

S = 1_000_000_000


def during(demo, *intervals, **facts):
    """The run with intervals in seconds after its first frame: kind, start, end, name."""
    zero = int(demo.assembly.stamp_ns[0])
    made = [Interval(zero + round(a * S), zero + round(b * S), kind, name) for kind, a, b, name in intervals]
    return replace(demo, session=replace(demo.session, intervals=tuple(made), facts=facts))


TASKS = [
    ("task", 0.2, 1.0, "stir"), ("task", 0.8, 1.5, "carry"), ("task", 1.0, 2.0, "tap"), ("stage", 0.0, 2.5, "lesson"),
    ("feature", 0.5, 0.6, "hint"), ("quiz", 1.0, 1.2, "q1"),
]  # fmt: skip


def test_stages_come_first_and_spans_that_overlap_have_a_lane_each(demo):
    run = during(demo, *TASKS, vr_type="immersive")
    last = int(np.ptp(run.assembly.stamp_ns))
    lanes = session_lanes(run)
    words = {path: [word for *_, word in spans] for path, spans in lanes.items()}
    assert words == {
        "doing/1_stage": ["lesson"], "doing/2_task": ["stir", "tap"], "doing/3_task": ["carry"],
        "doing/4_feature": ["hint"], "doing/5_vr_type": ["immersive"], "doing/6_quiz": ["q1"],
    }  # fmt: skip
    assert lanes["doing/2_task"] == [(S // 5, S, "stir"), (S, 2 * S, "tap")]
    assert lanes["doing/5_vr_type"] == [(0, last, "immersive")]


@pytest.mark.parametrize("span", [("task", -5.0, -1.0, "before"), ("task", 900.0, 901.0, "after")])
def test_what_lies_outside_the_frames_has_no_lane_and_what_reaches_out_is_cut(demo, span):
    assert session_lanes(during(demo, span)) == {}
    last = int(np.ptp(demo.assembly.stamp_ns))
    assert session_lanes(during(demo, ("task", -5.0, 901.0, "all"))) == {"doing/1_task": [(0, last, "all")]}


def test_the_recording_shows_them_with_hostile_names_escaped(demo, write):
    seen = write(during(demo, *TASKS[:3], ("task", 2.1, 2.4, "\x1b[31mred"), vr_type="desktop"))
    assert [state for _, state in seen.lane("doing/1_task")] == ["", "stir", "", "tap", "", "\\x1b[31mred", ""]
    assert [state for _, state in seen.lane("doing/3_vr_type")] in (["desktop", ""], ["", "desktop", ""])
