import numpy as np
import pytest
from support.planted_faults import FRAMES, STEP_NS, clean_draft
from support.small_worlds import session_of_frames

from sessions import Severity, Status
from sessions.doctor.pose_pass import run_pose_pass
from sessions.doctor.timing import FEW_FRAMES, time_findings


def time_findings_of(draft):
    """Findings about the times of a session."""
    return [*time_findings(run_pose_pass([draft.session().frames]))]


@pytest.mark.parametrize(("steps", "expected"), [(2.9, False), (3.1, True)])
def test_a_gap_is_longer_than_three_median_steps(steps, expected):
    """``steps``: length of the step to frame 400."""
    draft = clean_draft()
    draft.shift(slice(400, None), round((steps - 1) * STEP_NS))
    gaps = [item for item in time_findings_of(draft) if item.code == "gap"]
    stamps = draft.arrays["stamp_ns"]
    assert [(item.start_ns, item.end_ns) for item in gaps] == [(stamps[399], stamps[400])] * expected
    assert all(item.severity == Severity.NOTE for item in gaps)


def test_body_absent_for_100_frames_is_reported_as_gap():
    """Absent in frames 300 to 399: from its sample in 299 to that in 400."""
    draft = clean_draft()
    draft.arrays["status"][300:400, 1] = Status.ABSENT
    (item,) = time_findings_of(draft)
    stamps = draft.arrays["stamp_ns"]
    assert (item.code, item.body, item.start_ns, item.end_ns) == ("gap", "hand-left", stamps[299], stamps[400])


def test_pause_of_the_recording_is_no_gap_of_a_body():
    """Nothing is recorded for ten steps before frame 400; elsewhere a body is absent in a single frame."""
    draft = clean_draft()
    draft.arrays["status"][10, 1] = Status.ABSENT
    draft.shift(slice(400, None), 10 * STEP_NS)
    (item,) = time_findings_of(draft)
    assert (item.code, item.body) == ("gap", "")


def test_body_at_a_third_of_rate_has_no_gap():
    """The body has a pose in every third frame."""
    draft = clean_draft()
    draft.arrays["status"][np.arange(FRAMES) % 3 > 0, 1] = Status.ABSENT
    assert time_findings_of(draft) == []


def test_shifted_log_clock_is_accepted_and_its_jump_reported():
    """The log clock is 10^18 ns behind throughout, then jumps by 5 s in frame 600."""
    draft = clean_draft()
    draft.arrays["log_ns"] = draft.arrays["log_ns"] - 10**18
    assert time_findings_of(draft) == []
    draft.arrays["log_ns"][600:] += 5 * 10**9
    (item,) = time_findings_of(draft)
    assert (item.code, item.severity, item.start_ns) == ("clock-skew", Severity.WARNING, draft.arrays["stamp_ns"][600])


@pytest.mark.parametrize(
    ("step_ns", "expected"), [(400_000, True), (600_000, False), (400_000_000, False), (16_666_666_667, True)]
)
def test_clock_of_an_impossible_rate_has_the_wrong_unit(step_ns, expected):
    """2,500 Hz and a frame in 17 s are no rates of a recorder; 1,667 Hz and 2.5 Hz may be."""
    draft = clean_draft()
    draft.arrays["stamp_ns"] = draft.arrays["log_ns"] = draft.arrays["stamp_ns"][0] + step_ns * np.arange(FRAMES)
    reported = [item for item in time_findings_of(draft) if item.code == "clock-unit"]
    assert [(item.severity, item.count) for item in reported] == [(Severity.WARNING, FRAMES)] * expected


@pytest.mark.parametrize(
    ("count", "step_ns", "expected"), [(FEW_FRAMES, 10**10, True), (FEW_FRAMES - 1, 10**10, False), (FRAMES, 0, False)]
)
def test_few_frames_and_equal_stamps_say_no_unit(count, step_ns, expected):
    """A frame in 10 s is a wrong unit from FEW_FRAMES frames on; equal stamps have no rate."""
    session = session_of_frames(step_ns * np.arange(count), np.full((count, 1), Status.VALID))
    codes = {item.code for item in time_findings(run_pose_pass([session.frames]))}
    assert ("clock-unit" in codes) == expected


IN_FIRST_HALF = np.arange(FRAMES) < FRAMES // 2
"""Frames of a first clock, where the others are of a second one."""


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        (np.arange(FRAMES) == 0, True),  # recorded once, as what stands still
        (np.arange(FRAMES) % (FRAMES // 3) == 0, True),  # recorded when it changed
        (IN_FIRST_HALF, True),
        (np.zeros(FRAMES, dtype=bool), True),
        (np.arange(FRAMES) % 4 == 0, False),  # a quarter of the rate
        (np.arange(FRAMES) > FRAMES // 4, False),  # appears
    ],
)
def test_body_without_a_pose_in_most_frames_is_named(rows, expected):
    """``rows``: the frames in which it has a pose."""
    draft = clean_draft()
    draft.arrays["status"][~rows, 1] = Status.ABSENT
    reported = [item for item in time_findings_of(draft) if item.code == "often-missing"]
    assert [item.body for item in reported] == ["hand-left"] * expected
    for item in reported:
        assert f"{item.count:,} of {FRAMES:,} frames; its samples: {int(rows.sum()):,}" in item.message
