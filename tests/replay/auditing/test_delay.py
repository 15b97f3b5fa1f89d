"""Reports that come a constant number of frames late or early, in letters: C contact, a frame of 10 ms each."""

import numpy as np
import pytest
from support.small_worlds import verdict_column

from replay.auditing.delay import at_frame, constant_delay, frames_wrong, reported_frames

TRUTH = "......CCCC" * 3 + "." * 40


def late(frames, false_frames=0):
    """The letters of ``TRUTH`` so many frames later, with false frames at its end, each alone."""
    moved = "." * frames + TRUTH[: len(TRUTH) - frames]
    return moved[:-35] + ("C....." * false_frames).ljust(35, ".")


@pytest.mark.parametrize(
    ("reported", "delay"),
    [
        (late(2), 2),
        (TRUTH[2:] + "..", -2),
        (TRUTH, 0),
        # A contact that is reported too short is not late.
        (TRUTH.replace("CCCC", "..CC"), 0),
        # 12 frames are wrong through the delay. Of 16 wrong frames a quarter is left, of 17 more than that.
        (late(2, false_frames=4), 2),
        (late(2, false_frames=5), 0),
        # A report that comes after more than 0.25 s is no report of the same moment.
        ("." * 30 + "CCCC" + "." * 36, 0),
    ],
)
def test_delay_is_constant_where_moving_mends_three_quarters(reported, delay):
    """``delay``: frames by which reports are late, below 0 early; 0 where none mends 3/4 of the wrong frames."""
    assert constant_delay(verdict_column(reported), verdict_column(TRUTH), pair=0) == delay


@pytest.mark.parametrize(
    ("reported", "truth", "delay", "wrong"),
    [
        ("....CCCC..", "..CCCC....", 2, (4, 0)),
        ("..CCCC....", "....CCCC..", -2, (4, 0)),
        ("...CCCC...", "..CCCC....", 2, (2, 2)),
        # What is reported before any frame that it could be moved to stays wrong.
        ("CC........", "..........", 1, (2, 2)),
    ],
)
def test_wrong_frames_are_counted_as_reported_and_as_moved(reported, truth, delay, wrong):
    """``wrong``: frames whose report is wrong, first as it is, then moved ``delay`` frames earlier."""
    assert frames_wrong(verdict_column(reported), verdict_column(truth), pair=0, delay=delay) == wrong


def test_interval_is_reported_by_a_contact_at_either_end():
    """Contact is reported at frame 2, an end of the intervals that end with frames 2 and 3."""
    instants = verdict_column("..C..")
    intervals = verdict_column(".....", covers="intervals")
    assert reported_frames(instants, intervals, pair=0).tolist() == [False, False, True, True, False]
    assert reported_frames(instants, instants, pair=0).tolist() == [False, False, True, False, False]


def test_mask_is_false_before_the_first_and_after_last_frame():
    """The mask has frames 0 to 2."""
    mask = np.array([True, False, True])
    assert [at_frame(mask, frame) for frame in (-1, 0, 1, 2, 3)] == [False, True, False, True, False]
