"""The cause of a miss: the first stage of a detector that lost the contact.

To find the stage, a missed frame is decided again.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Final

import numpy as np

from cdcore import Detection, Motion, Verdict
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import REFUSED, Explains, Explanation, PairDetector, counts_as_contact
from cdcore.protocol.settings import RateSettings
from replay.auditing.delay import at_frame, constant_delay, reported_frames
from replay.auditing.fault import MISS_CAUSES, Cause, Fault, FaultKind
from replay.auditing.outcome import Comparison, Outcome
from replay.detection.recorded import RecordedDetector
from replay.detection.sample_times import sampled_frames

CAUSE_OF_REPORT_FAULT: Final = {FaultKind.REPORTED_LATE: Cause.LATE, FaultKind.LOST_EARLY: Cause.EARLY}
"""When an engine reported the rest of a contact that it missed in part."""


@dataclass(frozen=True)
class Causes:
    """Counts of the causes of one detector's misses.

    Parameters
    ----------
    misses : cause -> misses that have it.
    pair_frames : cause -> pair-frames decided again that have it; *within tolerance* counts all pair-frames.
    examined_misses, missed_contacts : pair-frames decided again, and pair-frames missed.
    """

    misses: Mapping[Cause, int] = field(default_factory=dict)
    pair_frames: Mapping[Cause, int] = field(default_factory=dict)
    examined_misses: int = 0
    missed_contacts: int = 0

    def table(self) -> dict[str, Any]:
        """Return plain data: every cause with its misses and pair-frames, zeros included."""
        return {
            "misses": {cause.value: self.misses.get(cause, 0) for cause in MISS_CAUSES},
            "pair_frames": {cause.value: self.pair_frames.get(cause, 0) for cause in MISS_CAUSES},
            "examined": self.examined_misses,
            "missed": self.missed_contacts,
        }


@dataclass(frozen=True, eq=False)
class Audited:
    """A detector that is compared, which may explain itself, its answer and the oracle's about one motion.

    ``prolonged`` (T, P): contact that it reports only because of its release distance; ``None``: it has none.
    """

    motion: Motion
    detector: object
    subject: Detection
    oracle: Detection
    prolonged: BoolArray | None = None
    _delays: dict[int, int] = field(default_factory=dict)
    _reported: dict[int, BoolArray] = field(default_factory=dict)

    def stages(self, frame: int, pair: int, faces: IntArray) -> Explanation:
        """Return the detector's account of its stages at a frame, ``faces`` (k, 2) being those that meet there."""
        if isinstance(self.detector, Explains):
            return self.detector.explain(self.motion, frame, pair, faces)
        return Explanation()

    @cached_property
    def sampled_frames(self) -> BoolArray | None:
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

    def has_pose(self, pair: int) -> BoolArray:
        """(T,) frames in which both bodies of a pair have a pose."""
        return np.logical_and(*self.motion.valid[:, self.subject.pairs[pair]].T)

    def engine_timing(self, first: int, last: int, kind: FaultKind) -> tuple[Cause | None, ...]:
        """Return causes in time of a miss of an engine: no step came in it, or its report began late or ended early."""
        if not isinstance(self.detector, RecordedDetector):
            return ()
        start, end = self.motion.times[[first, last]].tolist()
        no_step_between = self.detector.has_step_between(start, end) is False
        return Cause.BETWEEN_STEPS if no_step_between else None, CAUSE_OF_REPORT_FAULT.get(kind)

    def delay(self, pair: int) -> int:
        """Frames by which all that it says of a pair comes late; negative: early; 0: by no constant number."""
        if pair not in self._delays:
            self._delays[pair] = constant_delay(self.subject, self.oracle, pair)
        return self._delays[pair]

    def frames_reported(self, pair: int) -> BoolArray:
        """(T,) frames in which a contact of a pair counts as reported."""
        if pair not in self._reported:
            self._reported[pair] = reported_frames(self.subject, self.oracle, pair)
        return self._reported[pair]


@dataclass(frozen=True, eq=False)
class ExactAnswer:
    """An exact answer, with faces, about some frames of a motion; its rows are read by their frame.

    Parameters
    ----------
    detection : verdicts and faces of these frames.
    frames : (k,) ascending frames of the motion; ``None``: every frame.
    """

    detection: Detection
    frames: IntArray | None = None

    def row(self, frame: int) -> int:
        """Return the row of the detection that is about a frame."""
        return frame if self.frames is None else int(np.searchsorted(self.frames, frame))

    def verdict(self, frame: int, pair: int) -> int:
        """Return the value of ``Verdict`` of a pair at a frame."""
        return int(self.detection.verdict[self.row(frame), pair])

    def is_contact(self, frame: int, pair: int) -> bool:
        """Return whether a pair is in contact at a frame."""
        detection_row = self.row(frame)
        return bool(counts_as_contact(self.detection.verdict[detection_row : detection_row + 1, pair])[0])

    def faces(self, frame: int, pair: int) -> IntArray:
        """Return the face pairs (k, 2) that meet at a frame."""
        return self.detection.faces(self.row(frame), pair)

    def section(self, frame: int, pair: int) -> FloatArray:
        """Return the segments (k, 2, 3) in which the two surfaces intersect at a frame."""
        return self.detection.section(self.row(frame), pair)


def first_failed(
    stages: Explanation,
    verdict: int,
    *,
    at_instant: bool,
    tests_inside: bool = True,
    timing_causes: Sequence[Cause | None] = (),
) -> Cause:
    """The first stage that lost a contact.

    Parameters
    ----------
    stages, verdict : the detector's explanation and its verdict there.
    at_instant : whether the contact shows at the frame itself.
    tests_inside : False where one body is inside the other and the detector does not decide that.
    timing_causes : causes in time: that the detector says so earlier or later, that no step of an engine falls there.
    """
    # A detector may answer with numpy's booleans, and ``None`` is no answer.
    answers = {name: bool(stage_passed) for name, stage_passed in vars(stages).items() if stage_passed is not None}

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
    for cause in timing_causes:
        if cause is not None:
            return cause
    if not tests_inside:
        return Cause.CONTAINMENT
    if failed("spheres_meet") or failed("boxes_meet"):
        return Cause.SPHERE_STAGE
    if failed("sample_meets"):
        return Cause.SAMPLING
    if answers.get("found_with_more"):
        return Cause.BUDGET
    no_hit = answers.get("sample_meets") or verdict == Verdict.NOT_FOUND
    return Cause.SEARCH if no_hit else Cause.UNEXPLAINED


def causes_of_miss(miss: Fault, frames: Iterable[int], audited: Audited, exact_answer: ExactAnswer) -> list[Cause]:
    """Return the cause of a miss at each of these frames.

    ``exact_answer`` holds them, and those before them of intervals.
    """
    covers_instants = audited.oracle.covers == "instants"
    containment_refused = bool(audited.subject.containment) and audited.subject.containment[miss.pair].startswith(
        REFUSED
    )
    delay, of_engine = audited.delay(miss.pair), audited.engine_timing(miss.first, miss.last, miss.kind)
    causes = []
    for frame in frames:
        candidates = (frame,) if covers_instants else (frame, max(frame - 1, 0))
        contact_frames = [
            candidate_frame for candidate_frame in candidates if exact_answer.is_contact(candidate_frame, miss.pair)
        ]
        # An interval whose contact shows where it begins is explained there: at its end there is none to miss.
        examined_frame = contact_frames[0] if contact_frames else frame
        is_reported_shifted = delay != 0 and at_frame(audited.frames_reported(miss.pair), examined_frame + delay)
        cause = first_failed(
            audited.stages(examined_frame, miss.pair, exact_answer.faces(examined_frame, miss.pair)),
            int(audited.subject.verdict[examined_frame, miss.pair]),
            at_instant=bool(contact_frames) or covers_instants,
            tests_inside=not containment_refused
            or exact_answer.verdict(examined_frame, miss.pair) != Verdict.CONTAINED,
            timing_causes=(delay_cause(delay) if is_reported_shifted else None, *of_engine),
        )
        causes.append(cause)
    return causes


def count_causes(
    misses: Sequence[Fault], causes_of_misses: Iterable[Sequence[Cause]], comparison: Comparison, oracle: Detection
) -> Causes:
    """Return the counts of one detector; ``causes_of_misses`` holds the causes at the examined frames of each miss."""
    frames_of_cause = Counter(cause for causes in causes_of_misses for cause in causes)
    frame_count = frames_of_cause.total()
    for outcome, verdict in zip(comparison.outcome.T, oracle.verdict.T, strict=True):
        frames_of_cause[Cause.TOLERANCE] += int(counts_as_contact(verdict[outcome == Outcome.WITHIN_TOLERANCE]).sum())
    return Causes(
        misses=dict(Counter(miss.cause for miss in misses)),
        pair_frames=dict(frames_of_cause),
        examined_misses=frame_count,
        missed_contacts=comparison.pair_frames_of(Outcome.MISSED),
    )


def delay_cause(delay: int) -> Cause:
    """The word for a constant number of frames, not 0."""
    return Cause.LATE if delay > 0 else Cause.EARLY
