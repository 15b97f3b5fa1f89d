import numpy as np
import pytest
from support.planted_faults import FRAMES, STEP_NS, clean_draft
from support.small_worlds import session_of_frames

from sessions import Severity, Status
from sessions.doctor.pose_pass import run_pose_pass
from sessions.doctor.timing import FEW_FRAMES, time_findings


def time_findings_of(draft):
    """Findings of the doctor, which examines recordings for damage, about the times of a session."""
    return [*time_findings(run_pose_pass([draft.session().frames]))]


# `clean_draft` makes a recording without faults: 900 frames at 90 Hz of three bodies, of which 1 is "hand-left".
HAND = 1


@pytest.mark.parametrize(("steps", "is_gap"), [(2.9, False), (3.1, True)])
def test_a_gap_is_longer_than_three_median_steps(steps, is_gap):
    """All steps are alike but that to frame 400, which is ``steps`` times as long; a gap so short is a note alone."""
    draft = clean_draft()
    draft.shift(slice(400, None), round((steps - 1) * STEP_NS))
    gaps = [finding for finding in time_findings_of(draft) if finding.code == "gap"]
    stamps = draft.arrays["stamp_ns"]
    expected = [(stamps[399], stamps[400], Severity.NOTE)] if is_gap else []
    assert [(gap.start_ns, gap.end_ns, gap.severity) for gap in gaps] == expected


def test_body_absent_for_100_frames_is_reported_as_gap():
    """A hand is absent in frames 300 to 399: the gap is from its sample in 299 to that in 400."""
    draft = clean_draft()
    draft.arrays["status"][300:400, HAND] = Status.ABSENT
    (gap,) = time_findings_of(draft)
    stamps = draft.arrays["stamp_ns"]
    assert (gap.code, gap.body) == ("gap", "hand-left")
    assert (gap.start_ns, gap.end_ns) == (stamps[299], stamps[400])


def test_pause_of_the_recording_is_no_gap_of_a_body():
    """Nothing is recorded for ten steps before frame 400; in frame 10 a hand is absent, which is too short for a gap.

    The only gap is that of the whole recording, without a body.
    """
    draft = clean_draft()
    draft.arrays["status"][10, HAND] = Status.ABSENT
    draft.shift(slice(400, None), 10 * STEP_NS)
    (gap,) = time_findings_of(draft)
    assert (gap.code, gap.body) == ("gap", "")


def test_body_at_a_third_of_rate_has_no_gap():
    """A hand has a pose in every third frame: that is its own rate, by which its steps are no gaps."""
    draft = clean_draft()
    draft.arrays["status"][np.arange(FRAMES) % 3 > 0, HAND] = Status.ABSENT
    assert time_findings_of(draft) == []


def test_log_clock_that_is_always_behind_is_accepted():
    """Frames are stamped, and logged by another clock, which is 10^18 ns behind throughout."""
    draft = clean_draft()
    draft.arrays["log_ns"] = draft.arrays["log_ns"] - 10**18
    assert time_findings_of(draft) == []


@pytest.mark.parametrize("frames", [pytest.param(1, id="one frame"), pytest.param(300, id="all that follow")])
def test_jump_of_the_log_clock_is_reported(frames):
    """The clock by which frames are logged is 5 s ahead from frame 600 on; that of their stamps goes on.

    Clean frames are logged 2 ms after their stamp.
    """
    draft = clean_draft()
    draft.arrays["log_ns"][600 : 600 + frames] += 5 * 10**9
    (skew,) = time_findings_of(draft)
    assert (skew.code, skew.severity, skew.count) == ("clock-skew", Severity.WARNING, frames)
    assert skew.start_ns == draft.arrays["stamp_ns"][600]
    assert "+5.002 s apart" in skew.message


@pytest.mark.parametrize(
    ("step_ns", "is_reported"),
    [
        pytest.param(400_000, True, id="2,500 Hz"),
        pytest.param(600_000, False, id="1,667 Hz"),
        pytest.param(400_000_000, False, id="2.5 Hz"),
        pytest.param(16_666_666_667, True, id="a frame in 17 s"),
    ],
)
def test_clock_of_an_impossible_rate_has_the_wrong_unit(step_ns, is_reported):
    """No recorder has more than 2,000 or fewer than 2 frames a second; a warning counts all 900 frames."""
    draft = clean_draft()
    draft.arrays["stamp_ns"] = draft.arrays["log_ns"] = draft.arrays["stamp_ns"][0] + step_ns * np.arange(FRAMES)
    reported = [finding for finding in time_findings_of(draft) if finding.code == "clock-unit"]
    expected = [(Severity.WARNING, FRAMES)] if is_reported else []
    assert [(finding.severity, finding.count) for finding in reported] == expected


@pytest.mark.parametrize(
    ("frames", "step_ns", "is_reported"),
    [
        pytest.param(FEW_FRAMES, 10**10, True, id="enough frames, 10 s apart"),
        pytest.param(FEW_FRAMES - 1, 10**10, False, id="a frame fewer"),
        pytest.param(FRAMES, 0, False, id="equal stamps"),
    ],
)
def test_few_frames_and_equal_stamps_say_no_unit(frames, step_ns, is_reported):
    """A recording with a frame in 10 s has the wrong unit, from FEW_FRAMES frames on; equal stamps have no rate."""
    session = session_of_frames(step_ns * np.arange(frames), np.full((frames, 1), Status.VALID))
    codes = {finding.code for finding in time_findings(run_pose_pass([session.frames]))}
    assert ("clock-unit" in codes) == is_reported


FRAME = np.arange(FRAMES)


@pytest.mark.parametrize(
    ("is_present", "is_reported"),
    [
        pytest.param(FRAME == 0, True, id="once, as what stands still"),
        pytest.param(FRAME % (FRAMES // 3) == 0, True, id="three times, when it changed"),
        pytest.param(FRAME < FRAMES // 2, True, id="the first half"),
        pytest.param(FRAME < 0, True, id="never"),
        pytest.param(FRAME % 4 == 0, False, id="a quarter of the rate"),
        pytest.param(FRAME > FRAMES // 4, False, id="appears later"),
    ],
)
def test_body_without_a_pose_in_most_frames_is_named(is_present, is_reported):
    """A hand has a pose in some of 900 frames; without one in 40 % of them it is named.

    A sample counts for the 50 ms behind it, so that a quarter of the rate (44 ms) misses none; a late start misses a
    quarter. The message has the number of frames without it, and of its samples.
    """
    draft = clean_draft()
    draft.arrays["status"][~is_present, HAND] = Status.ABSENT
    reported = [finding for finding in time_findings_of(draft) if finding.code == "often-missing"]
    assert [finding.body for finding in reported] == ["hand-left"] * is_reported
    for finding in reported:
        assert f"{finding.count:,} of 900 frames; its samples: {is_present.sum()}" in finding.message
