"""By how many frames a detector says everything late, or early: a cause of misses and of false contacts."""

from typing import Final

import numpy as np

from cdcore import Detection
from cdcore.numerics import BoolArray, FloatArray
from cdcore.protocol import counts_as_contact

LATEST: Final = 0.25
"""Seconds: a report that comes later is no report of the same moment."""

FEWER_WRONG: Final = 4
"""A detector is *late* where moving its answers leaves at most a quarter of its wrong frames; steps held leave half."""


def constant_delay(subject: Detection, oracle: Detection, pair: int) -> int:
    """Frames by which all that is said of a pair comes late; negative: early; 0: by no constant number."""
    answers, true = reported_frames(subject, oracle, pair), counts_as_contact(oracle.verdict[:, pair])
    frames_late = _frames_late(answers, true, subject.times)
    if frames_late:
        return frames_late
    # Backwards in time what comes early comes late.
    return -_frames_late(answers[::-1], true[::-1], -subject.times[::-1])


def frames_wrong(subject: Detection, oracle: Detection, pair: int, delay: int) -> tuple[int, int]:
    """Frames in which what is said of a pair is wrong: as it is said, and moved earlier by ``delay`` frames."""
    answers, true = reported_frames(subject, oracle, pair), counts_as_contact(oracle.verdict[:, pair])
    if delay < 0:
        answers, true, delay = answers[::-1], true[::-1], -delay
    moved = int((answers[delay:] != true[: len(true) - delay]).sum() + answers[:delay].sum())
    return int((answers != true).sum()), moved


def reported_frames(subject: Detection, oracle: Detection, pair: int) -> BoolArray:
    """(T,) frames in which a contact counts as reported."""
    answers = counts_as_contact(subject.verdict[:, pair])
    if (subject.covers, oracle.covers) == ("instants", "intervals"):
        # An interval is found when a contact is reported at either of its ends.
        answers = answers | np.append(False, answers[:-1])
    return answers


def at_frame(mask: BoolArray, frame: int) -> bool:
    """Return the value of a mask (T,) at a frame; False before the first and after the last."""
    return 0 <= frame < len(mask) and bool(mask[frame])


def _frames_late(answers: BoolArray, true: BoolArray, times: FloatArray) -> int:
    """By how many frames ``said`` comes after ``true``; 0: by no constant number."""
    frames = len(answers)
    most_frames = int(np.searchsorted(times, times[0] + LATEST))
    # What is said in the first frames has no frame before the recording to come from: it counts as wrong.
    wrong = [int((answers[by:] != true[: frames - by]).sum() + answers[:by].sum()) for by in range(most_frames)]
    by = int(np.argmin(wrong))
    # What is only lost, and never said too long, is not late.
    return by if by and wrong[by] * FEWER_WRONG <= wrong[0] and bool((answers & ~true).any()) else 0
