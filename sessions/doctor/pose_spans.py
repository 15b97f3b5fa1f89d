"""From marks on samples to spans of one fault each, the rows that a policy changes, and to the findings about them."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sessions.doctor.finding import Finding, Span
from sessions.doctor.pose_pass import PosePass
from sessions.doctor.runs import runs
from sessions.doctor.scale import unit_guess
from sessions.doctor.track_watch import Mark, is_marked
from sessions.quantities import duration, length, number

LEAST_FROZEN: Final = 5  # Repeats of a position that are worth a word; browsers repeat one or two samples in a row
LEAST_FROZEN_NS: Final = 80_000_000

CATCH_UP: Final = 3.0
"""A thawing track that steps so many times further than around it was moving while it stood still ..."""
CATCH_UP_M: Final = 0.002  # ... and at least 2 mm further, which is more than a tracker jitters (0.77 mm at p99).

ODD_FRACTION: Final = 0.005
"""In a track that moves, positions repeat bit for bit in fewer steps than this (0 to 4 in 1,000 for browsers' captures
outside the stretch)."""
LEAST_OTHERS: Final = 300

LOST_JUMP_M: Final = 0.01
"""An exact identity pose that is entered or left by less than a centimetre may be where the body is;"""
LOST_JUMP_STEPS: Final = 5.0  # ... and so it may by less than five of its ordinary steps.


Jumps = dict[str, NDArray[np.int64]]
"""Body -> stamps (k, 2) between which it jumped."""


@dataclass(frozen=True)
class PoseSpan:
    """Consecutive samples of one body with one fault; ``first`` and ``last`` frame are included."""

    code: str
    column: int
    first: int
    last: int
    count: int  # samples
    size: float = 0.0  # metres for jumps


SIMPLE: Final = {
    "not-finite": Mark.NOT_FINITE,
    "zero-quaternion": Mark.ZERO_QUATERNION,
    "non-unit-quaternion": Mark.NON_UNIT,
    "tracking-lost": Mark.LOST,
    "out-of-space": Mark.OUT_OF_SPACE,
}
"""Codes that are one mark."""


def pose_spans(pose_pass: PosePass) -> list[PoseSpan]:
    """Every span in which a sample is no trustworthy pose, by body and then time.

    A body whose positions are not in metres would teleport in every frame, and lie out of every room; of such a body
    neither is said.
    """
    spans: list[PoseSpan] = []
    for column in range(len(pose_pass.names)):
        present = np.flatnonzero(pose_pass.has(Mark.PRESENT, column))
        in_metres = unit_guess(pose_pass, column) is None
        for code, mark in SIMPLE.items():
            if in_metres or code != "out-of-space":
                for first, last in runs(pose_pass.has(mark, column)[present]).tolist():
                    spans.append(PoseSpan(code, column, int(present[first]), int(present[last]), last - first + 1))
        track = _Track(pose_pass, column)
        spans += [*track.identity(), *track.frozen()]
        if in_metres:
            rows = track.rows[track.has(Mark.TELEPORT)].tolist()
            spans += [PoseSpan("teleport", column, row, row, 1, float(pose_pass.steps[row, column])) for row in rows]
    return sorted(spans, key=lambda span: (span.column, span.first, span.code))


def teleports(pose_pass: PosePass) -> Jumps:
    """When each body whose positions are in metres jumped: from its sample before to the one that marks it."""
    jumps: Jumps = {}
    for column, name in enumerate(pose_pass.names):
        usable = pose_pass.usable_rows(column)
        after = np.flatnonzero(pose_pass.has(Mark.TELEPORT, column)[usable])
        if len(after) and unit_guess(pose_pass, column) is None:
            jumps[name] = pose_pass.stamp_ns[np.stack([usable[after - 1], usable[after]], axis=1)]
    return jumps


class _Track:
    """The samples of one body that are poses: their frames, marks, and the steps to them."""

    def __init__(self, pose_pass: PosePass, column: int) -> None:
        self.column = column
        self.rows = pose_pass.usable_rows(column)
        self.stamp_ns = pose_pass.stamp_ns[self.rows]
        self.marks = pose_pass.marks[self.rows, column]
        self.steps = pose_pass.steps[self.rows, column]

    def has(self, mark: Mark) -> NDArray[np.bool_]:
        return is_marked(self.marks, mark)

    def span(self, code: str, first: int, last: int, size: float) -> PoseSpan:
        return PoseSpan(code, self.column, int(self.rows[first]), int(self.rows[last]), last - first + 1, size)

    def identity(self) -> Iterator[PoseSpan]:
        """Exact identity poses that the body jumped into or out of."""
        usual = float(np.nanmedian(self.steps)) if len(self.rows) > 1 else 0.0
        for first, last in runs(self.has(Mark.IDENTITY)).tolist():
            jump = max(self._step(first), self._step(last + 1))
            if jump > max(LOST_JUMP_M, LOST_JUMP_STEPS * usual):
                yield self.span("identity-while-lost", first, last, jump)

    def _step(self, number: int) -> float:
        """Metres to a sample; 0 to the first, and after the last."""
        return float(self.steps[number]) if 0 < number < len(self.steps) else 0.0

    def frozen(self) -> Iterator[PoseSpan]:
        """Stretches of one repeated position in which nothing was measured; a body at rest is in none."""
        same, identity = self.has(Mark.SAME_POSITION), self.has(Mark.IDENTITY)
        for first, last in runs(same).tolist():
            if last - first + 1 < LEAST_FROZEN or self.stamp_ns[last] - self.stamp_ns[first] < LEAST_FROZEN_NS:
                continue
            jump = max(self._step(first - 1), self._step(last + 1))
            if identity[first : last + 1].all() and jump > LOST_JUMP_M:
                continue
            if self._is_frozen(first, last, int(same.sum())):
                # A jump to the place where the body then stands still belongs to the stretch.
                jumped = first > 0 and self.has(Mark.TELEPORT)[first - 1]
                yield self.span("frozen", first - int(jumped), last, self._step(last + 1))

    def _is_frozen(self, first: int, last: int, repeats: int) -> bool:
        near = np.r_[max(1, first - 5) : first, last + 2 : min(last + 7, len(self.rows))].astype(np.int64)
        around = float(self.steps[near[~self.has(Mark.TELEPORT)[near]]].max(initial=0.0))
        if self._step(last + 1) > CATCH_UP * around + CATCH_UP_M:
            return True
        count = last - first + 1
        others = len(self.rows) - count
        turning = not self.has(Mark.SAME_ROTATION)[first : last + 1].any()
        return turning and others >= LEAST_OTHERS and repeats - count <= ODD_FRACTION * others


MOST_OF_A_KIND: Final = 40
"""Spans of one fault of one body that are listed one by one; the rest is counted in one finding."""

MERGED_WITHIN_NS: Final = 500_000_000  # Teleports less than half a second apart are told as one stretch

MESSAGES: Final = {
    "not-finite": "{samples} with a number that is not finite",
    "zero-quaternion": "{samples} with a quaternion of zeros",
    "non-unit-quaternion": "{samples} with a quaternion of norm {norm}",
    "out-of-space": "{samples} further from the origin than any room is large",
    "identity-while-lost": "{samples} say the origin, unturned, {size} from where the body was",
    "tracking-lost": "{samples} flagged as lost",
    "frozen": "the position repeats in {samples}, then steps {size}",
    "teleport": "{count} steps of up to {size} within {duration}",
}
"""Code of a span -> what is said of it."""


def pose_findings(pose_pass: PosePass) -> Iterator[Finding]:
    """Everything about single poses, body by body."""
    grouped: dict[tuple[str, int], list[PoseSpan]] = defaultdict(list)
    for span in pose_spans(pose_pass):
        grouped[span.code, span.column].append(span)
    for (code, column), spans in grouped.items():
        listed_spans = _merged_teleports(pose_pass, spans) if code == "teleport" else spans
        yield from (_finding_of_span(pose_pass, span) for span in listed_spans[:MOST_OF_A_KIND])
        rest = listed_spans[MOST_OF_A_KIND:]
        if rest:
            count = sum(span.count for span in rest)
            interval = Span.of(pose_pass.stamp_ns, rest[0].first, rest[-1].last)
            message = f"{len(rest)} more stretches of the same, {count} samples"
            yield interval.finding(code, message, pose_pass.names[column], count)


def _merged_teleports(pose_pass: PosePass, teleports: Sequence[PoseSpan]) -> list[PoseSpan]:
    """The teleports of a body, those that follow each other closely as one: a shaken tracker jumps in every frame."""
    merged: list[PoseSpan] = []
    for teleport in teleports:
        if merged and pose_pass.stamp_ns[teleport.first] - pose_pass.stamp_ns[merged[-1].last] < MERGED_WITHIN_NS:
            last = merged.pop()
            teleport = replace(teleport, first=last.first, count=last.count + 1, size=max(last.size, teleport.size))
        merged.append(teleport)
    return merged


def _finding_of_span(pose_pass: PosePass, span: PoseSpan) -> Finding:
    seconds = (int(pose_pass.stamp_ns[span.last]) - int(pose_pass.stamp_ns[span.first])) / 1e9
    samples = "1 sample" if span.count == 1 else f"{span.count} samples ({duration(seconds)})"
    message = MESSAGES[span.code].format(
        samples=samples,
        count=span.count,
        duration=duration(seconds),
        size=length(span.size),
        norm=number(pose_pass.worst_norm[span.column], digits=6),
    )
    if span.code == "teleport" and span.count == 1:
        message = f"{length(span.size)} in one step"
    interval = Span.of(pose_pass.stamp_ns, span.first, span.last)
    return interval.finding(span.code, message, pose_pass.names[span.column], span.count)
