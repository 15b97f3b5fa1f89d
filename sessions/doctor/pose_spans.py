"""From marks on samples to spans of one fault each, the rows that a policy changes, and to the findings about them."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sessions.doctor.finding import Finding, Severity, Span
from sessions.doctor.pose_pass import PosePass
from sessions.doctor.runs import runs
from sessions.doctor.scale import unit_guess
from sessions.doctor.track_watch import Mark, marked

LEAST_FROZEN: Final = 5  # Repeats of a position that are worth a word; browsers repeat one or two samples in a row
LEAST_FROZEN_NS: Final = 80_000_000

CATCH_UP: Final = 3.0
"""A thawing track that steps so many times further than around it was moving while it stood still ..."""
CATCH_UP_M: Final = 0.002  # ... and at least 2 mm further, which is more than a tracker jitters (0.77 mm at p99).

ODD_SHARE: Final = 0.005
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
}
"""Codes that are one mark."""


def pose_spans(looked: PosePass) -> list[PoseSpan]:
    """Every span in which a sample is no trustworthy pose, by body and then time.

    A body whose positions are not in metres would teleport in every frame, and lie out of every room; of such a body
    neither is said.
    """
    found: list[PoseSpan] = []
    for column in range(len(looked.names)):
        track = _Track.of(looked, column)
        for code, mark in SIMPLE.items():
            found += track.simple(code, mark)
        found += track.identity()
        found += track.frozen()
        if unit_guess(looked, column) is None:
            found += track.simple("out-of-space", Mark.OUT_OF_SPACE)
            found += track.teleports()
    return sorted(found, key=lambda span: (span.column, span.first, span.code))


def teleports(looked: PosePass, spans: Sequence[PoseSpan] | None = None) -> Jumps:
    """When each body jumped, from its sample before to the one that marks it; ``spans`` are those of this pass."""
    found: Jumps = {}
    spans = pose_spans(looked) if spans is None else spans
    rows = [(one.column, one.first) for one in spans if one.code == "teleport"]
    for column in {column for column, _ in rows}:
        usable = np.flatnonzero(looked.usable[:, column])
        after = np.searchsorted(usable, [row for there, row in rows if there == column])
        found[looked.names[column]] = looked.stamp_ns[np.stack([usable[after - 1], usable[after]], axis=1)]
    return found


@dataclass(frozen=True, eq=False)
class _Track:
    """The samples of one column: rows of all that are there, rows of those that are poses, and marks by row."""

    column: int
    stamp_ns: NDArray[np.int64]
    marks: NDArray[np.uint32]
    steps: NDArray[np.float32]
    present: NDArray[np.int64]
    usable: NDArray[np.int64]

    @classmethod
    def of(cls, looked: PosePass, column: int) -> "_Track":
        marks = looked.marks[:, column]
        there, gone = marked(marks, Mark.PRESENT), marked(marks, Mark.NO_POSE)
        usable = np.flatnonzero(there & ~gone)
        return cls(column, looked.stamp_ns, marks, looked.steps[:, column], np.flatnonzero(there), usable)

    def has(self, mark: Mark, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
        return marked(self.marks[rows], mark)

    def span(self, code: str, rows: NDArray[np.int64], first: int, last: int, size: float = 0.0) -> PoseSpan:
        return PoseSpan(code, self.column, int(rows[first]), int(rows[last]), last - first + 1, size)

    def simple(self, code: str, mark: Mark) -> Iterator[PoseSpan]:
        for first, last in runs(self.has(mark, self.present)).tolist():
            yield self.span(code, self.present, first, last)

    def identity(self) -> Iterator[PoseSpan]:
        """Exact identity poses that the body jumped into or out of."""
        rows = self.usable
        usual = float(np.nanmedian(self.steps[rows])) if len(rows) > 1 else 0.0
        for first, last in runs(self.has(Mark.IDENTITY, rows)).tolist():
            jump = self._jump(first, last + 1)
            if jump > max(LOST_JUMP_M, LOST_JUMP_STEPS * usual):
                yield self.span("identity-while-lost", rows, first, last, jump)

    def _jump(self, first: int, after: int) -> float:
        steps = self.steps[self.usable]
        into = float(steps[first]) if first > 0 else 0.0
        out = float(steps[after]) if after < len(steps) else 0.0
        return max(into, out)

    def teleports(self) -> Iterator[PoseSpan]:
        for row in self.usable[self.has(Mark.TELEPORT, self.usable)].tolist():
            yield PoseSpan("teleport", self.column, row, row, 1, float(self.steps[row]))

    def frozen(self) -> Iterator[PoseSpan]:
        """Stretches of one repeated position in which nothing was measured; a body at rest is in none."""
        rows, same = self.usable, self.has(Mark.SAME_PLACE, self.usable)
        repeats = int(same.sum())
        for first, last in runs(same).tolist():
            duration_ns = self.stamp_ns[rows[last]] - self.stamp_ns[rows[first]]
            if last - first + 1 < LEAST_FROZEN or duration_ns < LEAST_FROZEN_NS:
                continue
            if self.has(Mark.IDENTITY, rows[first : last + 1]).all() and self._jump(first - 1, last + 1) > LOST_JUMP_M:
                continue
            if self._is_frozen(first, last, repeats):
                size = float(self.steps[rows[last + 1]]) if last + 1 < len(rows) else 0.0
                # A jump to the place where the body then stands still belongs to the stretch.
                jumped = first > 0 and self.has(Mark.TELEPORT, rows[first - 1 : first])[0]
                yield self.span("frozen", rows, first - int(jumped), last, size)

    def _is_frozen(self, first: int, last: int, repeats: int) -> bool:
        rows = self.usable
        steps = self.steps[rows]
        thaw = float(steps[last + 1]) if last + 1 < len(steps) else 0.0
        near = np.r_[max(1, first - 5) : first, last + 2 : min(last + 7, len(rows))].astype(np.int64)
        near = near[~self.has(Mark.TELEPORT, rows[near])]
        around = float(steps[near].max(initial=0.0))
        if thaw > CATCH_UP * around + CATCH_UP_M:
            return True
        others = len(rows) - (last - first + 1)
        turning = not self.has(Mark.SAME_ROTATION, rows[first : last + 1]).any()
        elsewhere = repeats - (last - first + 1)
        return turning and others >= LEAST_OTHERS and elsewhere <= ODD_SHARE * others


MOST_OF_A_KIND: Final = 40
"""Spans of one fault of one body that are listed one by one; the rest is counted in one finding."""

STRETCH_NS: Final = 500_000_000  # Teleports less than half a second apart are told as one stretch

WORDS: Final = {
    "not-finite": (Severity.ERROR, "{samples} with a number that is not finite"),
    "zero-quaternion": (Severity.ERROR, "{samples} with a quaternion of zeros"),
    "non-unit-quaternion": (Severity.ERROR, "{samples} with a quaternion of norm {norm:.6g}"),
    "out-of-space": (Severity.ERROR, "{samples} further from the origin than any room is large"),
    "identity-while-lost": (Severity.ERROR, "{samples} say the origin, unturned, {size:.3g} m from where the body was"),
    "tracking-lost": (Severity.WARNING, "{samples} flagged as lost{hollow}"),
    "frozen": (Severity.WARNING, "the position repeats in {samples}, then steps {millimetres:.3g} mm"),
    "teleport": (Severity.WARNING, "{count} steps of up to {size:.3g} m within {seconds:.3g} s"),
}
"""Code of a span -> its severity, and what is said of it."""


def pose_findings(looked: PosePass) -> Iterator[Finding]:
    """Everything about single poses, body by body."""
    if not len(looked.stamp_ns):
        return
    grouped: dict[tuple[str, int], list[PoseSpan]] = defaultdict(list)
    for span in pose_spans(looked):
        grouped[span.code, span.column].append(span)
    for (code, column), spans in grouped.items():
        found = _stretches(looked, spans) if code == "teleport" else spans
        yield from (_listed(looked, span) for span in found[:MOST_OF_A_KIND])
        rest = found[MOST_OF_A_KIND:]
        if rest:
            count = sum(span.count for span in rest)
            stretch = Span.of(looked.stamp_ns, rest[0].first, rest[-1].last)
            message = f"{len(rest)} more stretches of the same, {count} samples"
            yield stretch.finding(code, WORDS[code][0], message, looked.names[column], count)
    for column, name in enumerate(looked.names):
        yield from _notes(looked, column, name)


def _stretches(looked: PosePass, teleports: Sequence[PoseSpan]) -> list[PoseSpan]:
    """The teleports of a body, those that follow each other closely as one: a shaken tracker jumps in every frame."""
    found: list[PoseSpan] = []
    for one in teleports:
        if found and looked.stamp_ns[one.first] - looked.stamp_ns[found[-1].last] < STRETCH_NS:
            last = found.pop()
            one = replace(one, first=last.first, count=last.count + 1, size=max(last.size, one.size))
        found.append(one)
    return found


def _listed(looked: PosePass, span: PoseSpan) -> Finding:
    seconds = (int(looked.stamp_ns[span.last]) - int(looked.stamp_ns[span.first])) / 1e9
    samples = "1 sample" if span.count == 1 else f"{span.count} samples ({seconds:.3g} s)"
    hollow = int(marked(looked.marks[span.first : span.last + 1, span.column], Mark.HOLLOW).sum())
    severity, words = WORDS[span.code]
    message = words.format(
        samples=samples,
        count=span.count,
        seconds=seconds,
        size=span.size,
        norm=looked.worst_norm[span.column],
        millimetres=1e3 * span.size,
        hollow=f"; {hollow} hold no pose" if hollow else "",
    )
    if span.code == "teleport" and span.count == 1:
        message = f"{span.size:.3g} m in one step"
    stretch = Span.of(looked.stamp_ns, span.first, span.last)
    return stretch.finding(span.code, severity, message, looked.names[span.column], span.count)


def _notes(looked: PosePass, column: int, name: str) -> Iterator[Finding]:
    for code, mark, severity, words in (
        ("turn-outlier", Mark.TURN_OUTLIER, Severity.WARNING, "of the samples turned away and back in two steps"),
        ("off-unit-quaternion", Mark.OFF_UNIT, Severity.NOTE, "quaternions are off unit length by more than 1e-6"),
    ):
        rows = np.flatnonzero(looked.body_has(column, mark)).tolist()
        if rows:
            stretch = Span.of(looked.stamp_ns, rows[0], rows[-1])
            yield stretch.finding(code, severity, f"{len(rows)} {words}", name, len(rows))
