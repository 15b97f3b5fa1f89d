"""Reports that come a constant number of frames late or early, in letters: C contact, a frame of 10 ms each."""

import numpy as np
import pytest
from support.small_worlds import verdict_column

from replay.auditing.delay import at_frame, constant_delay, frames_wrong, reported_frames

TRUTH = "......CCCC" * 3 + "." * 40
"""Three contacts of four frames: 6 to 9, 16 to 19, 26 to 29 of 70."""


def late(frames, false_frames=0):
    """The letters of ``TRUTH`` so many frames later, with false frames at its end, each alone."""
    moved = "." * frames + TRUTH[: len(TRUTH) - frames]
    return moved[:-35] + ("C....." * false_frames).ljust(35, ".")


@pytest.mark.parametrize(
    ("reported", "delay"),
    [
        pytest.param(late(2), 2, id="two frames late"),
        pytest.param(TRUTH[2:] + "..", -2, id="two frames early"),
        pytest.param(TRUTH, 0, id="right"),
        # A contact that is reported too short is not late.
        pytest.param(TRUTH.replace("CCCC", "..CC"), 0, id="begins late, ends in time"),
        # Two frames late, 3 contacts have 4 wrong frames each: 12. Moving leaves 4 of 16, a quarter, or 5 of 17.
        pytest.param(late(2, false_frames=4), 2, id="a quarter is left"),
        pytest.param(late(2, false_frames=5), 0, id="more than a quarter is left"),
        # Moved to any of the contacts, the only report leaves the other two missed: 8 of 16 wrong frames.
        pytest.param("." * 30 + "CCCC" + "." * 36, 0, id="most contacts are never reported"),
    ],
)
def test_delay_is_constant_where_moving_mends_three_quarters(reported, delay):
    """TRUTH has three contacts of four frames: 6 to 9, 16 to 19, 26 to 29 of 70; ``late(n)`` has them n frames later.

    False frames stand alone at its end. ``delay``: frames by which reports are late, below 0 early; 0 where moving them
    mends less than 3/4 of the wrong frames.
    """
    assert constant_delay(verdict_column(reported), verdict_column(TRUTH), pair=0) == delay


@pytest.mark.parametrize(("frames", "delay"), [(24, 24), (30, 0)])
def test_report_more_than_a_quarter_second_late_is_none(frames, delay):
    """A contact of frames 6 to 9 is reported 0.24 or 0.30 s later: only the former may be of the same moment."""
    truth = "......CCCC" + "." * 40
    reported = ("." * frames + truth)[: len(truth)]
    assert constant_delay(verdict_column(reported), verdict_column(truth), pair=0) == delay


@pytest.mark.parametrize(
    ("reported", "truth", "delay", "wrong", "wrong_when_moved"),
    [
        pytest.param("....CCCC..", "..CCCC....", 2, 4, 0, id="late by the delay"),
        pytest.param("..CCCC....", "....CCCC..", -2, 4, 0, id="early by the delay"),
        pytest.param("...CCCC...", "..CCCC....", 2, 2, 2, id="late by half of it"),
        # What is reported before any frame that it could be moved to stays wrong.
        pytest.param("CC........", "..........", 1, 2, 2, id="false in the first frames"),
    ],
)
def test_wrong_frames_are_counted_as_reported_and_as_moved(reported, truth, delay, wrong, wrong_when_moved):
    """Frames whose report is wrong, as it is and moved ``delay`` frames earlier (later, where that is below 0)."""
    counts = frames_wrong(verdict_column(reported), verdict_column(truth), pair=0, delay=delay)
    assert counts == (wrong, wrong_when_moved)


def test_interval_is_reported_by_a_contact_at_either_end():
    """A detector of instants reports contact in frame 2 of five, an end of the intervals that end with frames 2 and 3.

    Beside a reference of intervals it has reported both of them, beside one of instants frame 2 alone.
    """
    instants = verdict_column("..C..")
    intervals = verdict_column(".....", covers="intervals")
    assert reported_frames(instants, intervals, pair=0).tolist() == [False, False, True, True, False]
    assert reported_frames(instants, instants, pair=0).tolist() == [False, False, True, False, False]


def test_mask_is_false_before_the_first_and_after_last_frame():
    """A mask of frames 0 to 2, which is also true in the first and the last; -1 is not the last one."""
    mask = np.array([True, False, True])
    assert [at_frame(mask, frame) for frame in (0, 1, 2)] == [True, False, True]
    assert not at_frame(mask, -1) and not at_frame(mask, 3)
