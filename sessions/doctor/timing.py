"""Findings about clocks (stamps that do not go forward, gaps, two clocks that disagree), and marks that are counted."""

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sessions.doctor.finding import Finding, Severity, Span
from sessions.doctor.pose_pass import PosePass
from sessions.doctor.runs import runs
from sessions.doctor.track_watch import Mark
from sessions.model.constants import BRIDGE_NS
from sessions.quantities import duration

GAP_STEPS: Final = 3.0  # A step longer than three median steps is a gap
SAME_MOMENT: Final = 0.1  # Of the longer steps: a shorter step is within one moment
LONGER_STEPS: Final = 0.9  # The quantile of the steps that counts as the longer ones, below most gaps
LONG_GAP_NS: Final = 250_000_000
"""A longer gap is worth a warning: a quarter of a second is enough for a hand to touch and leave a glass."""
USUAL_STEPS_NS: Final = (500_000, 500_000_000)
"""Median steps of recordings of 2 to 2,000 samples a second; another one says that the unit of the clock is wrong."""
FEW_FRAMES: Final = 10
"""Frames that say nothing about rates."""
OFTEN_MISSING: Final = 0.4
"""Of the frames: a body without a pose in so many was recorded when it changed, or by another clock."""
SKEW_NS: Final = 1_000_000_000  # A recorder writes a frame within milliseconds of its stamp; a second is two clocks
EPOCH_NS: Final = 86_400_000_000_000  # A day or more apart, the two clocks merely start at different zeros


def time_findings(pose_pass: PosePass) -> Iterator[Finding]:
    """Everything about the clocks of a session."""
    stamps = pose_pass.stamp_ns
    if not len(stamps):
        return
    yield from _order(stamps)
    yield from _gaps(stamps, int(stamps[0]), "")
    yield from _skew(pose_pass)
    yield from _rate(stamps)
    backwards, repeated = out_of_order(stamps)
    plain = ~(backwards | repeated | np.concatenate([[False], (backwards | repeated)[:-1]]))
    for column, name in enumerate(pose_pass.names):
        yield from _findings_of_counts(pose_pass, column)
        present = pose_pass.has(Mark.PRESENT, column)
        if not present.all() and present.any():
            yield from _own_gaps(stamps, present & plain, name)
        yield from _often_missing(stamps, present, name)


COUNTED: Final = (
    ("clock-skew", Mark.SAMPLE_SKEWED, "device stamps are over 0.5 s off their frames"),
    ("turn-outlier", Mark.ROTATION_OUTLIER, "of the samples turned away and back in two steps"),
    ("off-unit-quaternion", Mark.OFF_UNIT, "quaternions are off unit length by more than 1e-6"),
)
"""Marks that are counted in one finding a body: its code and words."""


def out_of_order(stamps: NDArray[np.int64]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Masks (T,) of frames before, and of frames exactly at, the latest stamp so far."""
    peak = np.maximum.accumulate(np.concatenate([[np.iinfo(np.int64).min], stamps]))[:-1]
    return stamps < peak, stamps == peak


def typical_step(times: NDArray[np.int64] | NDArray[np.float64]) -> float:
    """The median step of a clock (n,), in its unit, from moment to moment; 0 where no step goes forward.

    Stamps that follow each other within a tenth of the longer steps are of one moment: two cameras at 60 Hz that stamp
    0.1 ms apart make 60 moments a second, not 10,000.
    """
    step = np.diff(times)
    forward = step[step > 0]
    if not len(forward):
        return 0.0
    begins = forward >= SAME_MOMENT * float(np.quantile(forward, LONGER_STEPS))
    if begins.all():
        return float(np.median(forward))
    ends = np.concatenate([[0], np.cumsum(forward)[begins]])
    return float(np.median(np.diff(ends)))


def gap_rows(stamps: NDArray[np.int64]) -> NDArray[np.int64]:
    """Frames after which there is a gap, (k,)."""
    typical = typical_step(stamps)
    return np.flatnonzero(np.diff(stamps) > GAP_STEPS * typical) if typical else np.zeros(0, np.int64)


def _order(stamps: NDArray[np.int64]) -> Iterator[Finding]:
    backwards, repeated = out_of_order(stamps)
    for first, last in runs(backwards).tolist():
        count = last - first + 1
        step = (int(stamps[first - 1]) - int(stamps[first])) / 1e9
        message = f"time goes back by {duration(step)}; {count} frames lie before the latest stamp"
        first_ns, last_ns = int(stamps[first : last + 1].min()), int(stamps[first : last + 1].max())
        yield Span(first_ns, last_ns, int(stamps[0])).finding("time-backwards", message, count=count)
    for first, last in runs(repeated).tolist():
        count = last - first + 1
        message = f"{count} frames repeat the stamp before"
        yield Span.of(stamps, first, last).finding("duplicate-stamps", message, count=count)


def _gaps(stamps: NDArray[np.int64], zero: int, body: str) -> Iterator[Finding]:
    step, rows = np.diff(stamps), gap_rows(stamps)
    median = typical_step(stamps)
    long = rows[step[rows] > LONG_GAP_NS]
    for row in long.tolist():
        message = f"nothing for {duration(step[row] / 1e9)}, {step[row] / median:.0f} steps of {median / 1e6:.1f} ms"
        span = Span(int(stamps[row]), int(stamps[row + 1]), zero)
        yield span.finding("gap", message, body)
    short = rows[step[rows] <= LONG_GAP_NS]
    if len(short):
        longest = step[short].max() / 1e6
        steps = "1 step" if len(short) == 1 else f"{len(short):,} steps"
        message = f"{steps} over 3 medians of {median / 1e6:.1f} ms, the longest {longest:.0f} ms"
        span = Span(int(stamps[short[0]]), int(stamps[short[-1] + 1]), zero)
        yield span.finding("gap", message, body, len(short), Severity.NOTE)


def _skew(pose_pass: PosePass) -> Iterator[Finding]:
    stamps, skew = pose_pass.stamp_ns, pose_pass.log_ns - pose_pass.stamp_ns
    middle = float(np.median(skew))
    off = np.abs(skew - (middle if abs(middle) > EPOCH_NS else 0.0)) > SKEW_NS
    for first, last in runs(off).tolist():
        message = f"log time and frame time are {float(np.median(skew[first : last + 1])) / 1e9:+.3f} s apart"
        span = Span.of(stamps, first, last)
        yield span.finding("clock-skew", message, count=last - first + 1)


def _rate(stamps: NDArray[np.int64]) -> Iterator[Finding]:
    """A clock in another unit than it was taken for."""
    step = typical_step(stamps)
    if len(stamps) < FEW_FRAMES or not step or USUAL_STEPS_NS[0] <= step <= USUAL_STEPS_NS[1]:
        return
    message = f"the median step from frame to frame is {duration(step / 1e9)}"
    yield Span.of(stamps, 0, len(stamps) - 1).finding("clock-unit", message, count=len(stamps))


def _often_missing(stamps: NDArray[np.int64], present: NDArray[np.bool_], name: str) -> Iterator[Finding]:
    """A body that has no pose in many frames, not even one that its last sample speaks for."""
    last = np.maximum.accumulate(np.where(present, np.arange(len(stamps)), -1))
    is_missing = (last < 0) | (stamps - stamps[last] > BRIDGE_NS)
    count = int(is_missing.sum())
    if len(stamps) >= FEW_FRAMES and count >= OFTEN_MISSING * len(stamps):
        message = f"no pose in {count:,} of {len(stamps):,} frames; its samples: {int(present.sum()):,}"
        yield Span.of(stamps, 0, len(stamps) - 1).finding("often-missing", message, name, count)


def _findings_of_counts(pose_pass: PosePass, column: int) -> Iterator[Finding]:
    for code, mark, what in COUNTED:
        rows = np.flatnonzero(pose_pass.has(mark, column))
        if len(rows):
            span = Span.of(pose_pass.stamp_ns, rows[0], rows[-1])
            yield span.finding(code, f"{len(rows)} {what}", pose_pass.names[column], len(rows))


def _own_gaps(stamps: NDArray[np.int64], present: NDArray[np.bool_], name: str) -> Iterator[Finding]:
    """Gaps of a body alone, which is in the frames ``present``: other frames were recorded within them."""
    ordered = np.sort(stamps)
    for finding in _gaps(stamps[present], int(stamps[0]), name):
        after = np.searchsorted(ordered, finding.start_ns or 0, side="right")
        if ordered[after] < (finding.end_ns or 0):  # the frame at its end comes after its start
            yield finding
