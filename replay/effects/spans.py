"""Stretches of frames: a flag that flickers becomes spans that do not, by counting frames in and frames out."""

from itertools import pairwise
from typing import Final

import numpy as np

from cdcore.numerics import BoolArray as BoolArray
from cdcore.numerics import FloatArray
from sessions.doctor.runs import runs

FrameRange = tuple[int, int]
"""First frame, and the frame after the last."""

CONFIRMING_FRAMES: Final = 2
"""Frames in a row that begin or end a stretch: one alone is noise. A resting tracker steps by 0.14-0.77 mm from frame
to frame, so that a contact at rest flickers."""


def spans_of(mask: BoolArray) -> list[FrameRange]:
    """Maximal stretches of True in (T,), each ``(first, stop)``."""
    return [(first, last + 1) for first, last in runs(mask).tolist()]


def steady_spans(flag: BoolArray, known: BoolArray, frames_in: int = CONFIRMING_FRAMES) -> list[FrameRange]:
    """Spans that begin with ``frames_in`` frames of True in a row and end with `FRAMES` of False in a row.

    A span begins at the first of the frames that opened it and stops at the first of those that closed it. Frames that
    are not known neither open nor close: they are passed over, and a span stays as it is across them.

    ``flag``, ``known``: (T,) bool.
    ``frames_in``: at least 1.
    """
    rows = np.flatnonzero(known)
    spans: list[FrameRange] = []
    begin = -1
    changes = np.flatnonzero(np.diff(flag[rows])) + 1
    for first, stop in pairwise([0, *changes.tolist(), len(rows)] if len(rows) else []):
        length = stop - first
        if flag[rows[first]]:
            begin = int(rows[first]) if begin < 0 and length >= frames_in else begin
        elif begin >= 0 and length >= CONFIRMING_FRAMES:
            spans.append((begin, int(rows[first])))
            begin = -1
    return [*spans, (begin, len(flag))] if begin >= 0 else spans


def hysteresis_spans(value: FloatArray, on_above: float, off_below: float) -> list[FrameRange]:
    """Spans in which a value is on: from above ``on_above`` until below ``off_below``; NaN changes nothing."""
    spans: list[FrameRange] = []
    begin = -1
    above, below = value > on_above, value < off_below
    for row in np.flatnonzero(above | below).tolist():
        if begin < 0 and above[row]:
            begin = row
        elif begin >= 0 and below[row]:
            spans.append((begin, row))
            begin = -1
    return [*spans, (begin, len(value))] if begin >= 0 else spans
