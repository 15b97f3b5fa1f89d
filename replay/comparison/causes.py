"""Numbers the misses of a run and says why each contact was missed: the first stage that lost it.

To find the stage, the missed frames are decided again.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cache, cached_property
from typing import Any, Final

import numpy as np

from cdcore import Detection, Motion, Verdict
from cdcore.numerics import BoolArray, IntArray
from cdcore.protocol import Explains, Explanation, HeldLooks, counts_as_contact
from cdcore.protocol.settings import RateSettings
from replay.comparison.delay import at_frame, constant_delay, reported
from replay.comparison.evidence import grouped, longest_cuts, looks
from replay.comparison.misses import FOUND_LATE, LOST_EARLY, MissedStretch, misses, stretches
from replay.comparison.outcome import Comparison, Episode, Miss, Outcome
from replay.detection.recorded import RecordedDetector
from replay.detection.run_detector import Run, holds_answers
from replay.prepare.assembly import Assembly

LOOKS_PER_MISS: Final = 16
"""A longer miss is decided again in this many frames, evenly spread with both ends."""

LOOKS_IN_ALL: Final = 4000
"""Pair-frames decided again of one detector, some seconds of work; misses beyond one look each are *not examined*."""

LOOKS_AT_ONCE: Final = 1024
"""Looks whose faces are held together."""


class Cause(StrEnum):
    """The stage that lost a contact."""

    TOLERANCE = "within tolerance"
    """Contact by less than tau: too small to decide, and no miss."""
    BETWEEN_FRAMES = "between frames"
    """No instant shows it; only an oracle of intervals does."""
    BETWEEN_LOOKS = "between samples"
    """The detector did not examine that frame."""
    BETWEEN_STEPS = "between physics steps"
    """No step of the engine falls into what its reports miss."""
    CLOCK = "clock"
    """Within what is not known of the detector's clock."""
    COLLIDER_SHAPE = "collider shape"
    """The colliders that replace the meshes do not meet."""
    LATE = "late"
    """The detector says the same a constant number of frames later, or an engine began to report the contact late."""
    EARLY = "early"
    """The same earlier, or an engine's report of the contact ended early."""
    CONTAINMENT = "inside, not asked"
    """One body is inside the other, and the detector does not ask that."""
    SPHERE_STAGE = "sphere stage"
    """Volumes dismissed it before any triangle was asked."""
    SAMPLING = "sampling"
    """No pair of faces that meets is in the sample."""
    BUDGET = "budget ran out"
    """Ten times the budget finds it, spent from some frames before."""
    SEARCH = "search"
    """In the sample, not found; nor with ten times the budget, where that can be asked."""
    UNEXPLAINED = "unexplained"
    """No stage explains it."""
    NOT_EXAMINED = "not examined"
    """There were too many misses to examine this one."""


REPORTED: Final = {FOUND_LATE: Cause.LATE, LOST_EARLY: Cause.EARLY}
"""When an engine reported the rest of a contact that it missed in part."""


@dataclass(frozen=True)
class Causes:
    """The causes of one detector's misses."""

    of_misses: tuple[Cause, ...] = ()  # one word per miss, that of most of its looks
    agreeing: tuple[tuple[int, int], ...] = ()  # of each miss the frames that have this cause, of those examined
    # cause -> pair-frames decided again that have it; *within tolerance* counts all there are
    pair_frames: Mapping[Cause, int] | None = None
    # examined, missed: pair-frames decided again, and pair-frames missed
    examined: int = 0
    missed: int = 0

    def table(self) -> dict[str, Any]:
        """As plain data: every cause with its misses and pair-frames, zeros included."""
        misses, frames = Counter(self.of_misses), self.pair_frames or {}
        return {
            "misses": {cause.value: misses[cause] for cause in Cause},
            "pair_frames": {cause.value: frames.get(cause, 0) for cause in Cause},
            "examined": self.examined,
            "missed": self.missed,
        }


@dataclass(frozen=True, eq=False)
class Audited:
    """A detector that is compared, which may explain itself, its answer and the oracle's about one motion."""

    motion: Motion
    detector: object
    subject: Detection
    oracle: Detection
    _delays: dict[int, int] = field(default_factory=dict)

    def stages(self, frame: int, pair: int, faces: IntArray) -> Explanation:
        """What the detector says of its stages at a frame, ``faces`` (k, 2) being those that meet there."""
        if isinstance(self.detector, Explains):
            return self.detector.explain(self.motion, frame, pair, faces)
        return Explanation()

    @cached_property
    def sampled(self) -> BoolArray | None:
        """(T,) frames in which a detector samples; ``None``: it is none of our table, and may sample anywhere."""
        settings = getattr(self.detector, "settings", None)
        if not isinstance(settings, RateSettings):
            return None
        return HeldLooks(0, settings.rate_hz, settings.sampling_offset_s).looks(self.motion.times)

    @property
    def rate_hz(self) -> float | None:
        """Samples a second of a detector that has a rate."""
        rate = getattr(getattr(self.detector, "settings", None), "rate_hz", None)
        return float(rate) if rate else None

    def posed(self, pair: int) -> BoolArray:
        """(T,) frames in which both bodies of a pair have a pose."""
        return np.logical_and(*self.motion.valid[:, self.subject.pairs[pair]].T)

    def delay(self, pair: int) -> int:
        """Frames by which all that it says of a pair comes late; negative: early; 0: by no constant number."""
        if pair not in self._delays:
            self._delays[pair] = constant_delay(self.subject, self.oracle, pair)
        return self._delays[pair]


Faces = Callable[[Motion], Detection]
"""An exact answer with faces for some frames."""


def find_causes(places: Sequence[MissedStretch], comparison: Comparison, by: Audited, faces_of: Faces) -> Causes:
    """Decide the frames of the misses (``places``, in order of time) again and give each miss its cause."""
    found: list[list[Cause]] = [[] for _ in places]
    for number, cause in _causes(places, by, faces_of):
        found[number].append(cause)
    frames = Counter(cause for causes in found for cause in causes)
    for outcome, verdict in zip(comparison.outcome.T, by.oracle.verdict.T, strict=True):
        frames[Cause.TOLERANCE] += int(counts_as_contact(verdict[outcome == Outcome.WITHIN_TOLERANCE]).sum())
    words = tuple(Counter(causes).most_common(1)[0][0] if causes else Cause.NOT_EXAMINED for causes in found)
    return Causes(
        of_misses=words,
        agreeing=tuple((causes.count(cause), len(causes)) for cause, causes in zip(words, found, strict=True)),
        pair_frames=dict(frames),
        examined=sum(map(len, found)),
        missed=comparison.count(Outcome.MISSED),
    )


def first_failed(
    stages: Explanation, verdict: int, *, at_instant: bool, asks_inside: bool = True,
    timing: Sequence[Cause | None] = (),
) -> Cause:  # fmt: skip
    """The first stage that lost a contact.

    Parameters
    ----------
    stages, verdict : the detector's explanation and its verdict there.
    at_instant : whether the contact shows at the frame itself.
    asks_inside : False where one body is inside the other and the detector does not decide that.
    timing : causes in time: that the detector says so earlier or later, that no step of an engine falls there.
    """
    # A detector may answer with numpy's booleans, and ``None`` is no answer.
    answers = {name: bool(value) for name, value in vars(stages).items() if value is not None}

    def failed(stage: str) -> bool:
        return answers.get(stage) is False

    if not at_instant:
        return Cause.BETWEEN_FRAMES
    if answers.get("within_clock"):
        return Cause.CLOCK
    # Shape before rate: a look at a shape that does not meet there would not have found the contact either.
    if failed("shapes_meet"):
        return Cause.COLLIDER_SHAPE
    if failed("looked"):
        return Cause.BETWEEN_LOOKS
    for cause in timing:
        if cause is not None:
            return cause
    if not asks_inside:
        return Cause.CONTAINMENT
    if failed("spheres_meet"):
        return Cause.SPHERE_STAGE
    if failed("sample_meets"):
        return Cause.SAMPLING
    if answers.get("found_with_more"):
        return Cause.BUDGET
    found_none = answers.get("sample_meets") or verdict == Verdict.NOT_FOUND
    return Cause.SEARCH if found_none else Cause.UNEXPLAINED


def _causes(places: Sequence[MissedStretch], by: Audited, faces_of: Faces) -> Iterator[tuple[int, Cause]]:
    """Number of a miss and the cause at one of its frames, for every frame examined."""
    instants, subject = by.oracle.covers == "instants", by.subject
    reported_of = cache(lambda pair: reported(subject, by.oracle, pair))
    for group in grouped(_looks(places), lambda look: len(look[2]), LOOKS_AT_ONCE):
        frames = np.unique([frame for _, _, looked in group for frame in looked])
        if not instants:
            # An interval is also decided at the frame where it begins.
            frames = np.unique(np.concatenate([frames, np.maximum(frames - 1, 0)]))
        truth = faces_of(by.motion.take(frames))
        row = {frame: k for k, frame in enumerate(frames.tolist())}
        contact = counts_as_contact(truth.verdict)
        for number, pair, looked in group:
            place = places[number]
            of_engine: tuple[Cause | None, ...] = ()
            if isinstance(by.detector, RecordedDetector):
                first, last = by.motion.times[[place.first, place.last]].tolist()
                stepless = by.detector.stepped(first, last) is False
                of_engine = Cause.BETWEEN_STEPS if stepless else None, REPORTED.get(place.kind)
            for frame in looked:
                asked = (frame,) if instants else (frame, frame - 1)
                ends = [end for end in asked if end in row and contact[row[end], pair]]
                # An interval whose contact shows where it begins is explained there: at its end there is none to miss.
                at = ends[0] if ends else frame
                refuses = bool(subject.containment) and subject.containment[pair].startswith("refused")
                asks = int(truth.verdict[row[at], pair]) != Verdict.CONTAINED or not refuses
                verdict, at_instant = int(subject.verdict[at, pair]), bool(ends) or instants
                delay = by.delay(pair)
                shifted = delay != 0 and at_frame(reported_of(pair), at + delay)
                timing = (delay_cause(delay) if shifted else None, *of_engine)
                stages = by.stages(at, pair, truth.faces(row[at], pair))
                yield number, first_failed(stages, verdict, at_instant=at_instant, asks_inside=asks, timing=timing)


def delay_cause(delay: int) -> Cause:
    """The word for a constant number of frames, not 0."""
    return Cause.LATE if delay > 0 else Cause.EARLY


Look = tuple[int, int, list[int]]
"""Number of a miss, its pair, and frames."""


def _looks(places: Sequence[MissedStretch]) -> Iterator[Look]:
    most = min(LOOKS_PER_MISS, max(1, LOOKS_IN_ALL // max(1, len(places))))
    every = max(1, -(-len(places) // LOOKS_IN_ALL))
    for number, place in enumerate(places):
        if number % every == 0:
            yield number, place.pair, looks(place.first, place.last, most).tolist()


def examine(
    comparisons: Mapping[str, Comparison], contacts: Sequence[Episode], subjects: Mapping[str, Audited], trusted: Run,
    assembly: Assembly, faces_of: Faces,
) -> tuple[dict[str, tuple[Miss, ...]], dict[str, Causes]]:  # fmt: skip
    """Misses and causes per label.

    Parameters
    ----------
    comparisons : label -> comparison, all with one oracle.
    contacts : the oracle's episodes.
    subjects : the detectors of these comparisons.
    trusted : the oracle.
    faces_of : the most trusted answer, with faces, for some frames.
    """
    places = {label: stretches(comparison, contacts) for label, comparison in comparisons.items()}
    asked = [(place.pair, place.first, place.last) for found in places.values() for place in found]
    if not asked:
        return dict.fromkeys(places, ()), {label: Causes() for label in places}
    own = trusted.detection
    has_faces = own.face_sets is not None and own.covers == "instants" and not holds_answers(trusted.settings)
    cuts = longest_cuts(assembly, own if has_faces else faces_of, asked, between=own.covers == "intervals")
    names = [assembly.bodies_of(pair) for pair in range(len(assembly.pairs))]
    times = assembly.motion.times
    numbered = {label: misses(found, names, times, cuts) for label, found in places.items()}
    causes = {}
    for label, found in places.items():
        causes[label] = find_causes(found, comparisons[label], subjects[label], faces_of)
        with_cause = zip(numbered[label], causes[label].of_misses, causes[label].agreeing, strict=True)
        numbered[label] = tuple(
            replace(miss, cause=cause.value, agreeing=agreeing) for miss, cause, agreeing in with_cause
        )
    return numbered, causes
