"""Number the misses of a run and find the cause of each: the first stage that lost the contact.

To find the stage, the missed frames are decided again.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import Any, Final

import numpy as np

from cdcore import Detection, Motion, Verdict
from cdcore.numerics import BoolArray, IntArray
from cdcore.protocol import Explains, Explanation, PairDetector, counts_as_contact
from cdcore.protocol.settings import RateSettings
from replay.auditing.delay import at_frame, constant_delay, reported
from replay.auditing.evidence import measure_misses
from replay.auditing.fault import MISS_CAUSES, Cause, Fault, FaultKind
from replay.auditing.misses import missed_faults
from replay.auditing.outcome import Comparison, Episode, Outcome
from replay.auditing.sample_budget import SampleBudget, grouped, spread_frames
from replay.detection.recorded import RecordedDetector
from replay.detection.run_detector import Run, holds_answers
from replay.detection.sample_times import sampled_frames
from replay.prepare.assembly import Assembly

CAUSE_BUDGET: Final = SampleBudget(per_miss=16, total=4000, at_once=1024)
"""Some seconds of work for each detector; misses beyond one frame each are *not examined*."""

REPORTED: Final = {FaultKind.REPORTED_LATE: Cause.LATE, FaultKind.LOST_EARLY: Cause.EARLY}
"""When an engine reported the rest of a contact that it missed in part."""


@dataclass(frozen=True)
class Causes:
    """Counts of the causes of one detector's misses.

    Parameters
    ----------
    misses : cause -> misses that have it.
    pair_frames : cause -> pair-frames decided again that have it; *within tolerance* counts all pair-frames.
    examined, missed : pair-frames decided again, and pair-frames missed.
    """

    misses: Mapping[Cause, int] = field(default_factory=dict)
    pair_frames: Mapping[Cause, int] = field(default_factory=dict)
    examined: int = 0
    missed: int = 0

    def table(self) -> dict[str, Any]:
        """Return plain data: every cause with its misses and pair-frames, zeros included."""
        return {
            "misses": {cause.value: self.misses.get(cause, 0) for cause in MISS_CAUSES},
            "pair_frames": {cause.value: self.pair_frames.get(cause, 0) for cause in MISS_CAUSES},
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
        """Return the detector's account of its stages at a frame, ``faces`` (k, 2) being those that meet there."""
        if isinstance(self.detector, Explains):
            return self.detector.explain(self.motion, frame, pair, faces)
        return Explanation()

    @cached_property
    def sampled(self) -> BoolArray | None:
        """(T,) frames in which a detector samples; ``None``: it is none of our table, and may sample anywhere."""
        settings = getattr(self.detector, "settings", None)
        if not isinstance(settings, RateSettings):
            return None
        return sampled_frames(self.motion.times, settings.rate_hz, settings.sampling_offset_s)

    @property
    def rate_hz(self) -> float | None:
        """Samples a second of a detector that has a rate."""
        rate = getattr(getattr(self.detector, "settings", None), "rate_hz", None)
        return float(rate) if rate else None

    def contact_reach(self, pair: int) -> float:
        """Metres between two surfaces from which the detector reports contact; 0 where it has no contact offset."""
        return self.detector.contact_reach(pair) if isinstance(self.detector, PairDetector) else 0.0

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


def find_causes(
    misses: Sequence[Fault], comparison: Comparison, by: Audited, faces_of: Faces
) -> tuple[tuple[Fault, ...], Causes]:
    """Return the misses, in order of time, each with the cause of most of its examined frames, and all counts."""
    examined: list[list[Cause]] = [[] for _ in misses]
    for index, cause in _causes(misses, by, faces_of):
        examined[index].append(cause)
    frames = Counter(cause for causes in examined for cause in causes)
    for outcome, verdict in zip(comparison.outcome.T, by.oracle.verdict.T, strict=True):
        frames[Cause.TOLERANCE] += int(counts_as_contact(verdict[outcome == Outcome.WITHIN_TOLERANCE]).sum())
    explained = []
    for miss, causes in zip(misses, examined, strict=True):
        if causes:
            cause, count = Counter(causes).most_common(1)[0]
            miss = replace(miss, cause=cause, agreeing=(count, len(causes)))
        explained.append(miss)
    return tuple(explained), Causes(
        misses=dict(Counter(miss.cause for miss in explained)),
        pair_frames=dict(frames),
        examined=sum(map(len, examined)),
        missed=comparison.count(Outcome.MISSED),
    )


def first_failed(
    stages: Explanation,
    verdict: int,
    *,
    at_instant: bool,
    asks_inside: bool = True,
    timing: Sequence[Cause | None] = (),
) -> Cause:
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
        return Cause.BETWEEN_SAMPLES
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
    no_hit = answers.get("sample_meets") or verdict == Verdict.NOT_FOUND
    return Cause.SEARCH if no_hit else Cause.UNEXPLAINED


def _causes(misses: Sequence[Fault], by: Audited, faces_of: Faces) -> Iterator[tuple[int, Cause]]:
    """Yield the index of a miss and the cause at one of its frames, for every frame examined."""
    instants, subject = by.oracle.covers == "instants", by.subject
    reported_of = cache(lambda pair: reported(subject, by.oracle, pair))
    for group in grouped(_samples(misses), lambda sample: len(sample[2]), CAUSE_BUDGET.at_once):
        frames = np.unique([frame for _, _, sampled in group for frame in sampled])
        if not instants:
            # An interval is also decided at the frame where it begins.
            frames = np.unique(np.concatenate([frames, np.maximum(frames - 1, 0)]))
        truth = faces_of(by.motion.take(frames))
        row = {frame: k for k, frame in enumerate(frames.tolist())}
        contact = counts_as_contact(truth.verdict)
        for index, pair, sampled in group:
            miss = misses[index]
            of_engine: tuple[Cause | None, ...] = ()
            if isinstance(by.detector, RecordedDetector):
                first, last = by.motion.times[[miss.first, miss.last]].tolist()
                stepless = by.detector.stepped(first, last) is False
                of_engine = Cause.BETWEEN_STEPS if stepless else None, REPORTED.get(miss.kind)
            for frame in sampled:
                candidates = (frame,) if instants else (frame, frame - 1)
                ends = [end for end in candidates if end in row and contact[row[end], pair]]
                # An interval whose contact shows where it begins is explained there: at its end there is none to miss.
                at = ends[0] if ends else frame
                refuses = bool(subject.containment) and subject.containment[pair].startswith("refused")
                asks = int(truth.verdict[row[at], pair]) != Verdict.CONTAINED or not refuses
                verdict, at_instant = int(subject.verdict[at, pair]), bool(ends) or instants
                delay = by.delay(pair)
                shifted = delay != 0 and at_frame(reported_of(pair), at + delay)
                timing = (delay_cause(delay) if shifted else None, *of_engine)
                stages = by.stages(at, pair, truth.faces(row[at], pair))
                yield index, first_failed(stages, verdict, at_instant=at_instant, asks_inside=asks, timing=timing)


def delay_cause(delay: int) -> Cause:
    """The word for a constant number of frames, not 0."""
    return Cause.LATE if delay > 0 else Cause.EARLY


Sample = tuple[int, int, list[int]]
"""Index of a miss, its pair, and the frames of it that are examined."""


def _samples(misses: Sequence[Fault]) -> Iterator[Sample]:
    most = CAUSE_BUDGET.frames_per_miss(len(misses))
    every = max(1, -(-len(misses) // CAUSE_BUDGET.total))
    for index, miss in enumerate(misses):
        if index % every == 0:
            yield index, miss.pair, spread_frames(miss.first, miss.last, most).tolist()


def examine(
    comparisons: Mapping[str, Comparison],
    contacts: Sequence[Episode],
    subjects: Mapping[str, Audited],
    trusted: Run,
    assembly: Assembly,
    faces_of: Faces,
) -> tuple[dict[str, tuple[Fault, ...]], dict[str, Causes]]:
    """Return the misses, measured and with their causes, and the counts of causes, per label.

    Parameters
    ----------
    comparisons : label -> comparison, all with one oracle.
    contacts : the oracle's episodes.
    subjects : the detectors of these comparisons.
    trusted : the oracle.
    faces_of : the most trusted answer, with faces, for some frames.
    """
    names = [assembly.things_of(pair) for pair in range(len(assembly.pairs))]
    misses = {
        label: tuple(
            replace(miss, labels=assembly.fault_names(miss.pair))
            for miss in missed_faults(comparison, contacts, names, assembly.motion.times)
        )
        for label, comparison in comparisons.items()
    }
    every = [miss for of_detector in misses.values() for miss in of_detector]
    if not every:
        return misses, {label: Causes() for label in misses}
    own = trusted.detection
    has_faces = own.face_sets is not None and own.covers == "instants" and not holds_answers(trusted.settings)
    source = own if has_faces else faces_of
    measured = iter(measure_misses(assembly, source, every, between=own.covers == "intervals"))
    causes = {}
    for label, of_detector in misses.items():
        own_misses = [next(measured) for _ in of_detector]
        misses[label], causes[label] = find_causes(own_misses, comparisons[label], subjects[label], faces_of)
    return misses, causes
