"""Missed and false contacts of a detector of a fixed rate over 16 sampling offsets: where samples fall is chance."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from cdcore import Detection, Detector, Motion, Verdict, join
from cdcore.detectors.detector_table import TABLE
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import ZeroOrderHold, detect_live, is_one_of, stream_live
from replay.auditing.contact_counts import REPORTED_OUTCOMES, count_contacts, count_reports, missed_partly, missed_whole
from replay.auditing.episodes import column_runs
from replay.auditing.outcome import Outcome
from replay.auditing.tolerance import Reference
from replay.auditing.wilson import Proportion, proportion_of_clusters
from replay.detection.detector_spec import DetectorSpec
from replay.detection.progress import Advance, ignore_progress
from replay.detection.release_band import ReleaseBand
from replay.detection.run_detector import MOST_FRAMES_IN_MEMORY, detect_all, make_detector, release_band, warm_frames
from replay.prepare.assembly import Assembly

OFFSET_COUNT: Final = 16
"""Offsets that a mean is over, evenly spread over the time from sample to sample."""

OFFSET_SETTING: Final = "sampling_offset_s"
"""Setting of every detector of a rate: where its sampling starts. A value that is asked for stays."""

TIMED_SEGMENTS: Final = 16
SEGMENT_FRAMES: Final = 128
"""Where a look at every frame is timed: all of a short recording, and so many stretches of a long one."""

PROGRESS_STEPS: Final = 24
"""Steps of progress of one detector: its samples at every frame count for eight, each sampling offset for one."""


@dataclass(frozen=True)
class EveryFrame:
    """Counts of the oracle's contacts when the detector samples at every frame: a run without its rate."""

    contacts_missed: int
    late_or_cut_short: int
    missed: Proportion  # share of the pair-frames in contact that it does not report
    false_contact: Proportion  # share of the pair-frames that it reports which are no contact
    seconds: float | None = None  # a frame in the mean; ``None`` where it was not asked live


Proportions = Mapping[str, Proportion]
"""Counts over all offsets: ``contacts_missed``, ``contacts_in_part``, ``missed`` and ``false_contact``."""


@dataclass(frozen=True, eq=False)
class OffsetCounts:
    """Counts of the oracle's contacts for a detector of a fixed rate, by where its sampling starts.

    Parameters
    ----------
    frames_by_outcome : (offsets, C, outcomes) frames of each contact by ``Outcome``.
    false_contact : proportion of the reported pair-frames that are no contact.
    false_contacts : (offsets,) segments of reported contact in which the oracle has none.
    false_fractions : (offsets,) ``false_contact`` at each offset alone.
    seconds : (offsets,) by which sampling starts later.
    every_frame : the same detector without its rate, of all contacts.
    """

    frames_by_outcome: IntArray
    false_contact: Proportion
    false_contacts: IntArray
    false_fractions: FloatArray
    seconds: FloatArray
    every_frame: EveryFrame | None = None

    def selected(self, is_kept: BoolArray) -> "OffsetCounts":
        """Return the counts of the contacts for which ``is_kept`` (C,) is true.

        False contacts belong to none and stay.
        """
        return replace(self, frames_by_outcome=self.frames_by_outcome[:, is_kept])

    @cached_property
    def faults(self) -> dict[str, BoolArray]:
        """Name -> (offsets, C) at which offsets which contacts have that fault."""
        return {
            "contacts_missed": missed_whole(self.frames_by_outcome),
            "contacts_in_part": missed_partly(self.frames_by_outcome),
        }

    def proportions(self) -> Proportions:
        """Counts over all offsets, and their shares: means over the offsets, with intervals over contacts."""
        offsets, contacts, _ = self.frames_by_outcome.shape
        samples_per_contact = np.full(contacts, offsets)
        missed_frames, both_frames = self.frames_by_outcome.sum(axis=0)[:, [Outcome.MISSED, Outcome.BOTH]].T
        proportions = {
            name: proportion_of_clusters(fault.sum(axis=0), samples_per_contact) for name, fault in self.faults.items()
        }
        return proportions | {
            "missed": proportion_of_clusters(missed_frames, missed_frames + both_frames),
            "false_contact": self.false_contact,
        }

    @cached_property
    def typical_offset(self) -> float:
        """Seconds of the offset whose moments are displayed: of those that show the larger fault, nearest the mean.

        Distances are in the terms of the loss: contacts missed, contact time missed, reported time false, as shares.
        """
        missed_frames, both_frames = self.frames_by_outcome.sum(axis=1)[:, [Outcome.MISSED, Outcome.BOTH]].T
        loss_terms = np.stack(
            [
                self.faults["contacts_missed"].sum(axis=1) / max(1, self.frames_by_outcome.shape[1]),
                missed_frames / np.maximum(1, missed_frames + both_frames),
                self.false_fractions,
            ],
            axis=1,
        )
        mean = loss_terms.mean(axis=0)
        leads_false = mean[2] > mean[0] + mean[1]
        has_fault = loss_terms[:, 2] > 0.0 if leads_false else loss_terms[:, :2].sum(axis=1) > 0.0
        distance = np.abs(loss_terms - mean).sum(axis=1)
        # Without any fault all offsets are alike.
        distance[~has_fault & has_fault.any()] = np.inf
        return float(self.seconds[distance.argmin()])

    def spreads(self) -> dict[str, dict[str, float]]:
        """Smallest, largest and mean number of contacts missed, and found in part, over the offsets."""
        return {name: count_spread(fault.sum(axis=1).tolist()) for name, fault in self.faults.items()}


def count_spread(counts: Sequence[int]) -> dict[str, float]:
    """``smallest``, ``largest`` and ``mean`` of the counts at each sampling offset, of which there is one at least."""
    return {"smallest": min(counts), "largest": max(counts), "mean": sum(counts) / len(counts)}


def has_offsets(spec: DetectorSpec, frame_count: int) -> bool:
    """Whether a detector of a recording of so many frames is counted at 16 sampling offsets.

    A detector that is none of our table, and any in a recording of more than an hour, keep the offset they have.
    """
    return bool(spec.settings.get("rate_hz")) and spec.name in TABLE and frame_count <= MOST_FRAMES_IN_MEMORY


def at_offset(spec: DetectorSpec, offsets: OffsetCounts) -> DetectorSpec:
    """Return the spec of a detector of a rate with its typical sampling offset; one that is asked for stays."""
    return replace(spec, settings={OFFSET_SETTING: offsets.typical_offset, **spec.settings})


def counts_over_offsets(
    spec: DetectorSpec,
    assembly: Assembly,
    reference: Reference,
    seed: int,
    *,
    is_live: bool,
    advance: Advance = ignore_progress,
) -> OffsetCounts:
    """The counts at all offsets of a detector with a rate, and those of the same detector without one.

    It is asked about every frame, and timed live if it is asked ``is_live`` in its run, so that both times are alike.
    ``advance`` is called with ``STEPS`` in all.
    """
    detector = make_detector(replace(spec, settings={**spec.settings, "rate_hz": None}), assembly, seed)
    full_detection, band = detect_all(detector, assembly), release_band(spec, detector, assembly, seed)
    seconds = _sample_seconds(detector, assembly.motion) if is_live else None
    advance(PROGRESS_STEPS - OFFSET_COUNT)
    at_offsets = offset_counts(spec.settings["rate_hz"], full_detection, reference, advance, band)
    if band is not None:
        full_detection = replace(
            full_detection,
            verdict=band.prolonged_verdicts(full_detection.verdict, np.ones(len(full_detection.times), dtype=np.bool_)),
        )
    comparison = reference.compare(full_detection)
    counts_without_rate = count_contacts(comparison, reference.contacts)
    every_frame = EveryFrame(
        contacts_missed=counts_without_rate.missed,
        late_or_cut_short=counts_without_rate.late_or_cut_short,
        missed=counts_without_rate.proportion(Outcome.MISSED),
        false_contact=count_reports(comparison).proportion(Outcome.FALSE_CONTACT),
        seconds=seconds,
    )
    return replace(at_offsets, every_frame=every_frame)


def _sample_seconds(detector: Detector, motion: Motion) -> float:
    """Seconds that a live look takes in the mean, over stretches that are spread evenly over a motion."""
    # What compiles on the first live look is no time of a look.
    detect_live(detector, motion.take(warm_frames(len(motion))))
    first_frames = np.arange(0, len(motion), max(SEGMENT_FRAMES, -(-len(motion) // TIMED_SEGMENTS)))
    segments = [motion.frames(start, min(start + SEGMENT_FRAMES, len(motion))) for start in first_frames.tolist()]
    detection = join(stream_live(detector, segments))
    return sum(float(np.sum(stage)) for stage in detection.seconds.values()) / len(detection.times)


def sampling_offsets(rate_hz: float) -> FloatArray:
    """Seconds by which sampling starts later, (``OFFSET_COUNT``,), evenly spread from sample to sample."""
    return (np.arange(OFFSET_COUNT) + 0.5) / OFFSET_COUNT / rate_hz


def offset_counts(
    rate_hz: float,
    full_detection: Detection,
    reference: Reference,
    advance: Advance = ignore_progress,
    band: ReleaseBand | None = None,
) -> OffsetCounts:
    """Count contacts at each offset of a rate; the answer of a sample, taken from ``full_detection``, lasts
    until the next.

    ``band``: prolongs the contacts of the samples.
    """
    frames_by_outcome = np.zeros((OFFSET_COUNT, len(reference.contacts), len(Outcome)), dtype=np.int64)
    reported_at_offsets, positives, false_at_offsets = np.zeros((3, *full_detection.verdict.shape), dtype=np.uint8)
    segments, fractions = np.zeros(OFFSET_COUNT, dtype=np.int64), np.zeros(OFFSET_COUNT)
    offsets = sampling_offsets(rate_hz)
    has_pose = full_detection.verdict != Verdict.NO_POSE
    for number, offset_seconds in enumerate(offsets.tolist()):
        samples = ZeroOrderHold(len(full_detection.pairs), rate_hz, offset_seconds)
        sampled_frames = samples.sampled(full_detection.times)
        sample_verdict = (
            full_detection.verdict[sampled_frames]
            if band is None
            else band.prolonged_verdicts(full_detection.verdict[sampled_frames], sampled_frames)
        )
        assumed_verdict, _ = samples.hold(sample_verdict, has_pose[sampled_frames], sampled_frames, has_pose)
        comparison = reference.compare(replace(full_detection, verdict=assumed_verdict))
        frames_by_outcome[number] = count_contacts(comparison, reference.contacts).frames_by_outcome
        outcome = comparison.outcome
        false_frames = is_one_of(outcome, (Outcome.FALSE_CONTACT,))
        true_or_false = is_one_of(outcome, (Outcome.BOTH, Outcome.FALSE_CONTACT))
        reported_at_offsets |= is_one_of(outcome, REPORTED_OUTCOMES)
        # As of one run: what is within tolerance is neither true nor false.
        positives += true_or_false
        false_at_offsets += false_frames
        begins_false = false_frames[1:] & ~false_frames[:-1]
        segments[number] = np.count_nonzero(false_frames[0]) + np.count_nonzero(begins_false)
        fractions[number] = int(np.count_nonzero(false_frames)) / max(1, int(np.count_nonzero(true_or_false)))
        advance(1)
    report_runs = column_runs((reported_at_offsets > 0).T).tolist()
    report_segments = [(slice(first, last + 1), pair) for pair, first, last in report_runs]
    false_sums = [int(false_at_offsets[report].sum(dtype=np.int64)) for report in report_segments]
    positive_sums = [int(positives[report].sum(dtype=np.int64)) for report in report_segments]
    return OffsetCounts(
        frames_by_outcome=frames_by_outcome,
        false_contact=proportion_of_clusters(false_sums, positive_sums),
        false_contacts=segments,
        false_fractions=fractions,
        seconds=offsets,
    )
