"""A detector with a search, watched at its work: how many pairs each stage left, and the looks worth a picture."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from cdcore import Detection, Motion, Verdict
from cdcore.numerics import IntArray
from cdcore.protocol import counts_as_contact
from replay.comparison.misses import by_depth
from replay.detection.run_detector import watched_again
from replay.effects.output import Vector
from replay.pipeline.run_result import RunResult

if TYPE_CHECKING:
    from cdcore.search.result import SearchResult
    from cdcore.search.tracing import LookTrace, Watched

DRAWN_EVALUATIONS: Final = 40_000
"""Evaluations that the looks of one detector draw at most: some 4 MB. Misses come first."""

LOOKS: Final = 60
"""Looks drawn of one detector at most: beyond it nobody steps through them."""

ALL, SPHERES, BOXES, SEARCHED, CONFIRMED = "all pairs", "spheres meet", "boxes meet", "searched", "confirmed"

LOST, CONTACT = "missed", "contact"


@dataclass(frozen=True)
class Moment:
    """A frame that matters, and the look that led to its verdict."""

    frame: int  # row of the verdict
    pair: int  # its column
    looked: int  # frame of the look; earlier where the pair was not searched again since
    kind: str  # ``LOST`` or ``CONTACT``
    first: int  # frames in which it is shown: of a miss all of it, else this frame alone
    last: int
    later: int = 0  # nanoseconds after the frame
    meets: Vector | None = None  # where the surfaces of a missed contact meet, world metres


@dataclass(frozen=True, eq=False)
class WatchedRun:
    """One audited detector at its work."""

    label: str
    detection: Detection
    motion: Motion
    counts: Mapping[str, IntArray]  # stage -> (T,) pairs that it left
    seen: Watched  # what each stage did
    moments: Sequence[Moment]  # at most one per frame, in order of time

    @property
    def worked(self) -> Moment:
        """The moment to begin with: of misses that with the most evaluations, else of contacts."""
        return min(self.moments, key=lambda one: (one.kind != LOST, -self.look(one).evaluations))

    def look(self, moment: Moment) -> SearchResult:
        """What the look of a moment gave."""
        return self.seen.search.noted[moment.looked, moment.pair].result

    def trace(self, moment: Moment) -> LookTrace:
        """Everything that the look of a moment evaluated."""
        return self.seen.search.trace(self.motion, moment.looked, moment.pair)


def watched_runs(result: RunResult) -> list[WatchedRun]:
    """The audited detectors that can be watched, searched again; none of hours."""
    found: list[WatchedRun] = []
    for label in result.comparisons:
        detection, motion = result.detections[label], result.assembly.motion
        seen = watched_again(result.detectors.get(label), motion)
        if seen is not None:
            moments = _moments(result, label, seen)
            found.append(WatchedRun(label, detection, motion, stage_counts(detection, seen), seen, moments))
    return found


def stage_counts(detection: Detection, seen: Watched) -> dict[str, IntArray]:
    """Stage -> pairs that it left, (T,); without boxes there is no such stage."""
    left = {ALL: detection.verdict != Verdict.NO_POSE, SPHERES: seen.spheres, BOXES: seen.boxes}
    if seen.boxes is seen.spheres:
        del left[BOXES]
    left |= {SEARCHED: seen.searched, CONFIRMED: counts_as_contact(detection.verdict)}
    return {stage: pairs.sum(axis=1) for stage, pairs in left.items()}


def _moments(result: RunResult, label: str, seen: Watched) -> list[Moment]:
    chosen: dict[int, Moment] = {}
    spent = 0
    for moment in [*_missed(result, label, seen), *_begun(result, label, seen)]:
        evaluations = seen.search.noted[moment.looked, moment.pair].result.evaluations
        room = len(chosen) < LOOKS and spent + evaluations <= DRAWN_EVALUATIONS
        if moment.frame not in chosen and room:
            chosen[moment.frame] = moment
            spent += evaluations
    return [chosen[frame] for frame in sorted(chosen)]


def _missed(result: RunResult, label: str, seen: Watched) -> Iterator[Moment]:
    """The frame of each miss that shows most, longest cut first, with the last look before it."""
    for miss in by_depth(result.misses[label]):
        looked = np.flatnonzero(seen.searched[: miss.deepest + 1, miss.pair])
        if len(looked):
            yield Moment(miss.deepest, miss.pair, int(looked[-1]), LOST, miss.first, miss.last, meets=miss.point)


def _begun(result: RunResult, label: str, seen: Watched) -> Iterator[Moment]:
    """The first frame of each contact that the search found, spread over the session where there are too many."""
    found = [
        Moment(one.first, one.pair, one.first, CONTACT, one.first, one.first)
        for one in result.episodes[label]
        if (one.first, one.pair) in seen.search.noted
    ]
    for part in range(stride := max(1, -(-len(found) // LOOKS))):
        yield from found[part::stride]
