"""By how many frames a detector says everything late, or early: a cause of misses and of false contacts."""

from typing import Final

import numpy as np

from cdcore import Detection
from cdcore.numerics import BoolArray, FloatArray
from cdcore.protocol import counts_as_contact

LONGEST_DELAY_S: Final = 0.25
"""Seconds: a report that comes later is no report of the same moment."""

WRONG_FRAMES_DIVISOR: Final = 4
"""A detector is *late* where moving its answers leaves at most a quarter of its wrong frames; steps held leave half."""


def constant_delay(subject: Detection, oracle: Detection, pair: int) -> int:
    """Frames by which all that is said of a pair comes late; negative: early; 0: by no constant number."""
    subject_contact, reference_contact = (
        reported_frames(subject, oracle, pair),
        counts_as_contact(oracle.verdict[:, pair]),
    )
    frames_late = _frames_late(subject_contact, reference_contact, subject.times)
    if frames_late:
        return frames_late
    # Backwards in time what comes early comes late.
    return -_frames_late(subject_contact[::-1], reference_contact[::-1], -subject.times[::-1])


def frames_wrong(subject: Detection, oracle: Detection, pair: int, delay: int) -> tuple[int, int]:
    """Frames in which what is said of a pair is wrong: as it is said, and moved earlier by ``delay`` frames."""
    subject_contact, reference_contact = (
        reported_frames(subject, oracle, pair),
        counts_as_contact(oracle.verdict[:, pair]),
    )
    if delay < 0:
        subject_contact, reference_contact, delay = subject_contact[::-1], reference_contact[::-1], -delay
    wrong_when_moved = int(
        (subject_contact[delay:] != reference_contact[: len(reference_contact) - delay]).sum()
        + subject_contact[:delay].sum()
    )
    return int((subject_contact != reference_contact).sum()), wrong_when_moved


def reported_frames(subject: Detection, oracle: Detection, pair: int) -> BoolArray:
    """(T,) frames in which a contact counts as reported."""
    answers = counts_as_contact(subject.verdict[:, pair])
    if (subject.covers, oracle.covers) == ("instants", "intervals"):
        # An interval is found when a contact is reported at either of its ends.
        answers = answers | np.append(False, answers[:-1])
    return answers


def at_frame(frame_mask: BoolArray, frame: int) -> bool:
    """Return the value of a mask (T,) at a frame; False before the first and after the last."""
    return 0 <= frame < len(frame_mask) and bool(frame_mask[frame])


def _frames_late(subject_contact: BoolArray, reference_contact: BoolArray, times: FloatArray) -> int:
    """By how many frames ``subject_contact`` comes after ``reference_contact``; 0: by no constant number."""
    frame_count = len(subject_contact)
    most_frames = int(np.searchsorted(times, times[0] + LONGEST_DELAY_S))
    # What is said in the first frames has no frame before the recording to come from: it counts as wrong.
    wrong_counts = [
        int((subject_contact[by:] != reference_contact[: frame_count - by]).sum() + subject_contact[:by].sum())
        for by in range(most_frames)
    ]
    delay = int(np.argmin(wrong_counts))
    # What is only lost, and never said too long, is not late.
    return (
        delay
        if delay
        and wrong_counts[delay] * WRONG_FRAMES_DIVISOR <= wrong_counts[0]
        and bool((subject_contact & ~reference_contact).any())
        else 0
    )
