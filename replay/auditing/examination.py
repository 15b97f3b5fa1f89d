"""Examine the misses of all detectors in one pass: the same exact answer about a frame gives evidence and cause."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cdcore import Detection, Motion
from cdcore.numerics import IntArray
from replay.auditing.causes import Audited, Causes, ExactAnswer, causes_of_miss, count_causes
from replay.auditing.evidence import EvidenceFinder
from replay.auditing.fault import Cause, Fault
from replay.auditing.misses import missed_faults
from replay.auditing.outcome import Comparison, Episode
from replay.auditing.sample_budget import SampleBudget, grouped_by_size, spread_frames
from replay.detection.run_detector import Run, holds_answers
from replay.prepare.assembly import Assembly

EVIDENCE_BUDGET: Final = SampleBudget(per_miss=128, total=20_000)
"""Frames whose curves are compared: at 90 Hz all frames of 1.4 s, and some seconds of work."""

CAUSE_BUDGET: Final = SampleBudget(per_miss=16, total=4000)
"""Frames that each detector decides again, some seconds of work; misses beyond one frame each are *not examined*."""

FRAMES_AT_ONCE: Final = 1024
"""Pair-frames whose faces are in memory together: 25 MB where each has a thousand face pairs in every pair."""

Source = Detection | Callable[[Motion], Detection]
"""An exact answer, with faces, about every frame, or a detector that is asked for some of them."""

Segment = tuple[int, int, int]
"""Column of a pair, first and last frame."""


def examine(
    comparisons: Mapping[str, Comparison],
    contacts: Sequence[Episode],
    subjects: Mapping[str, Audited],
    reference_run: Run,
    assembly: Assembly,
    faces_of: Callable[[Motion], Detection],
) -> tuple[dict[str, tuple[Fault, ...]], dict[str, Causes]]:
    """Return the misses with evidence and cause, in order of time, and the counts of causes, per label.

    Parameters
    ----------
    comparisons : label -> comparison, all with one oracle.
    contacts : the oracle's episodes.
    subjects : the detectors of these comparisons.
    reference_run : the oracle.
    faces_of : the most trusted answer, with faces, for some frames.
    """
    pair_names = [assembly.things_of(pair) for pair in range(len(assembly.pairs))]
    numbered_misses = {
        label: [
            replace(miss, labels=assembly.fault_names(miss.pair))
            for miss in missed_faults(comparison, contacts, pair_names, assembly.motion.times)
        ]
        for label, comparison in comparisons.items()
    }
    trusted_detection = reference_run.detection
    has_faces = (
        trusted_detection.face_sets is not None
        and trusted_detection.covers == "instants"
        and not holds_answers(reference_run.settings)
    )
    causes: dict[str, list[list[Cause]]] = {label: [[] for _ in misses] for label, misses in numbered_misses.items()}
    for label, index, miss, causes_at_frames in examined_misses(
        assembly,
        trusted_detection if has_faces else faces_of,
        numbered_misses,
        subjects,
        reference_is_of_intervals=trusted_detection.covers == "intervals",
    ):
        numbered_misses[label][index], causes[label][index] = miss, causes_at_frames
    misses = {label: tuple(of_detector) for label, of_detector in numbered_misses.items()}
    return misses, {
        label: count_causes(misses[label], causes[label], comparisons[label], subjects[label].oracle)
        for label in misses
    }


def examined_misses(
    assembly: Assembly,
    source: Source,
    misses: Mapping[str, Sequence[Fault]],
    subjects: Mapping[str, Audited],
    *,
    reference_is_of_intervals: bool = False,
) -> Iterator[tuple[str, int, Fault, list[Cause]]]:
    """Yield each miss with evidence and cause: label, index, miss, and the causes at its examined frames.

    The same frames of a pair are measured once for all detectors, and queried once for evidence and cause.

    Parameters
    ----------
    assembly : bodies, motion, pairs.
    source : exact answer.
    misses : label -> numbered misses, not measured.
    subjects : the detectors that missed them.
    reference_is_of_intervals : whether row t of the oracle covers the path from t-1 to t.
    """
    plan = _frames_to_decide(misses)
    miss_count = sum(map(len, misses.values()))
    frames_per_miss = EVIDENCE_BUDGET.frames_per_miss(miss_count)
    curve_frames = {segment: spread_frames(segment[1], segment[2], frames_per_miss) for segment in plan}
    finder = EvidenceFinder(assembly, reference_is_of_intervals=reference_is_of_intervals)
    for segment_group in grouped_by_size(plan, lambda segment: len(curve_frames[segment]), FRAMES_AT_ONCE):
        frames_to_decide = [frames for segment in segment_group for _, _, frames in plan[segment]]
        if reference_is_of_intervals:
            # An interval is also decided at the frame where it begins.
            frames_to_decide += [np.maximum(frames - 1, 0) for frames in frames_to_decide]
        exact_answer = _exact_answer(
            source, assembly.motion, [*(curve_frames[segment] for segment in segment_group), *frames_to_decide]
        )
        for segment in segment_group:
            pair, first, _ = segment
            frame, point, metres, evidence = finder.measure(pair, first, curve_frames[segment].tolist(), exact_answer)
            for label, index, frames in plan[segment]:
                miss = misses[label][index]
                causes = causes_of_miss(miss, frames.tolist(), subjects[label], exact_answer)
                measured_miss = replace(miss, frame=frame, point=point, metres=metres, evidence=evidence)
                if causes:
                    cause, agreeing_count = Counter(causes).most_common(1)[0]
                    measured_miss = replace(measured_miss, cause=cause, agreeing=(agreeing_count, len(causes)))
                yield label, index, measured_miss, causes


def _frames_to_decide(misses: Mapping[str, Sequence[Fault]]) -> dict[Segment, list[tuple[str, int, IntArray]]]:
    """Return for each segment its misses, label and index, with the frames that their detector decides again."""
    plan = defaultdict[Segment, list[tuple[str, int, IntArray]]](list)
    for label, of_detector in misses.items():
        frames_per_miss = CAUSE_BUDGET.frames_per_miss(len(of_detector))
        stride = max(1, -(-len(of_detector) // CAUSE_BUDGET.total))
        for index, miss in enumerate(of_detector):
            frames = (
                spread_frames(miss.first, miss.last, frames_per_miss) if index % stride == 0 else np.zeros(0, np.int64)
            )
            plan[miss.pair, miss.first, miss.last].append((label, index, frames))
    return dict(plan)


def _exact_answer(source: Source, motion: Motion, frames: Sequence[IntArray]) -> ExactAnswer:
    if isinstance(source, Detection):
        return ExactAnswer(source)
    queried_frames = np.unique(np.concatenate(frames))
    return ExactAnswer(source(motion.take(queried_frames)), queried_frames)
