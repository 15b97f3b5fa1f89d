"""Findings about poses: each fault of a body with the span it covers."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from sessions.doctor.finding import Finding, Severity, Span
from sessions.doctor.pose_pass import MOST_DECIMALS, PosePass
from sessions.doctor.pose_spans import PoseSpan, pose_spans, rest_spans
from sessions.doctor.track_watch import Mark, marked

MOST_OF_A_KIND: Final = 40
"""Spans of one fault of one body that are listed one by one; the rest is counted in one finding."""

STRETCH_NS: Final = 500_000_000  # Teleports less than half a second apart are told as one stretch

SEVERITIES: Final = {
    "not-finite": Severity.ERROR,
    "zero-quaternion": Severity.ERROR,
    "non-unit-quaternion": Severity.ERROR,
    "out-of-space": Severity.ERROR,
    "identity-while-lost": Severity.ERROR,
    "tracking-lost": Severity.WARNING,
    "frozen": Severity.WARNING,
    "teleport": Severity.WARNING,
}


def pose_findings(looked: PosePass) -> Iterator[Finding]:
    """Everything about single poses, body by body."""
    if not len(looked.stamp_ns):
        return
    grouped: dict[tuple[str, int], list[PoseSpan]] = defaultdict(list)
    for span in pose_spans(looked):
        grouped[span.code, span.column].append(span)
    for (code, _), spans in grouped.items():
        found = _stretches(looked, spans) if code == "teleport" else spans
        yield from (_listed(looked, span) for span in found[:MOST_OF_A_KIND])
        rest = found[MOST_OF_A_KIND:]
        if rest:
            yield _together(looked, rest, SEVERITIES[rest[0].code], "{1} more stretches of the same, {0} samples")
    resting: dict[int, list[PoseSpan]] = defaultdict(list)
    for span in rest_spans(looked):
        resting[span.column].append(span)
    for found in resting.values():
        yield _together(looked, found, Severity.NOTE, "the position repeats bit for bit in {0} samples, {1} stretches")
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
    name = looked.names[span.column]
    seconds = (int(looked.stamp_ns[span.last]) - int(looked.stamp_ns[span.first])) / 1e9
    samples = f"{span.count} sample" if span.count == 1 else f"{span.count} samples ({seconds:.3g} s)"
    hollow = int(marked(looked.marks[span.first : span.last + 1, span.column], Mark.HOLLOW).sum())
    message = {
        "not-finite": f"{samples} with a number that is not finite",
        "zero-quaternion": f"{samples} with a quaternion of zeros",
        "non-unit-quaternion": f"{samples} with a quaternion of norm {looked.worst_norm[span.column]:.6g}"
        + (" at worst" if span.count > 1 else ""),
        "out-of-space": f"{samples} further from the origin than any room is large",
        "identity-while-lost": f"{samples} say the origin, unturned, {span.size:.3g} m from where the body was",
        "tracking-lost": f"{samples} flagged as lost" + (f"; {hollow} hold no pose" if hollow else ""),
        "frozen": f"the position repeats in {samples}, then steps {1e3 * span.size:.3g} mm",
        "teleport": f"{span.size:.3g} m in one step"
        if span.count == 1
        else f"{span.count} steps of up to {span.size:.3g} m within {seconds:.3g} s",
    }[span.code]
    stretch = Span.of(looked.stamp_ns, span.first, span.last)
    return stretch.finding(span.code, SEVERITIES[span.code], message, name, span.count)


def _together(looked: PosePass, found: Sequence[PoseSpan], severity: Severity, words: str) -> Finding:
    """One finding for several spans of one fault of one body."""
    count = sum(span.count for span in found)
    stretch = Span.of(looked.stamp_ns, found[0].first, found[-1].last)
    return stretch.finding(
        found[0].code, severity, words.format(count, len(found)), looked.names[found[0].column], count
    )


def _notes(looked: PosePass, column: int, name: str) -> Iterator[Finding]:
    for code, mark, severity, words in (
        ("turn-outlier", Mark.TURN_OUTLIER, Severity.WARNING, "of the samples turned away and back in two steps"),
        ("sign-flips", Mark.SIGN_FLIP, Severity.NOTE, "times q becomes -q"),
        ("off-unit-quaternion", Mark.OFF_UNIT, Severity.NOTE, "quaternions are off unit length by more than 1e-6"),
    ):
        rows = np.flatnonzero(looked.body_has(column, mark)).tolist()
        if rows:
            stretch = Span.of(looked.stamp_ns, rows[0], rows[-1])
            yield stretch.finding(code, severity, f"{len(rows)} {words}", name, len(rows))
    decimals = _decimals(looked.quaternion[:, column])
    if decimals is not None:
        message = f"quaternions have {decimals} decimals, {np.degrees(10.0**-decimals):.1g} degrees"
        count = int(np.isfinite(looked.quaternion[:, column, 0]).sum())
        yield Finding("rounded-rotations", Severity.NOTE, message, name, count=count)


LEAST_DIFFERENT: Final = 8  # Rotations that must differ before their decimals are judged: 0, 0, 0, 1 has none to judge


def _decimals(quaternions: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> int | None:
    """The number of decimals that all these quaternions were printed with, if they were."""
    there = quaternions[np.isfinite(quaternions).all(axis=1)]
    if len(there) < LEAST_DIFFERENT or len(np.unique(there[:512], axis=0)) < LEAST_DIFFERENT:
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        for decimals in range(1, MOST_DECIMALS + 1):
            if (np.abs(there - np.round(there, decimals)) < 1e-12).all():
                return decimals
    return None
