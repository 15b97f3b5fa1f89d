"""What a detector of a fixed rate misses and invents over 16 sampling offsets: where its samples fall is chance."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np

from cdcore import Detection, Detector, Motion, Verdict, join
from cdcore.detectors import DETECTORS, OPTIONAL
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import HeldLooks, is_one_of, stream_live
from replay.base.constants import HELD_FRAMES
from replay.base.progress import Advance, ignored
from replay.base.wilson import share_of_clusters
from replay.comparison.contact_counts import REPORTED, count_contacts, count_reports, found_in_part, never_found
from replay.comparison.episodes import column_runs
from replay.comparison.outcome import Outcome
from replay.comparison.tolerance import Reference
from replay.detection.run_detector import Run, detect_all, make_detector
from replay.prepare.assembly import Assembly

PHASES: Final = 16
"""Offsets that a mean is over, evenly spread over the time from sample to sample."""

STRETCHES: Final = 16
STRETCH_FRAMES: Final = 128
"""Where a look at every frame is timed: all of a short recording, and so many stretches of a long one."""

STEPS: Final = 24
"""Steps of progress of one detector: its samples at every frame count for eight, each sampling offset for one."""


@dataclass(frozen=True)
class EveryFrame:
    """What the detector makes of the oracle's contacts when it samples at every frame: a run without its rate."""

    contacts_missed: int
    contacts_in_part: int
    invented: dict[str, Any]  # share of the pair-frames that it reports which are no contact
    seconds: float | None = None  # a frame in the mean; ``None`` where it was not asked live


Shares = Mapping[str, dict[str, Any]]
"""``contacts_missed``, ``contacts_in_part``, ``missed`` and ``invented``: counts over all offsets, and their shares."""


@dataclass(frozen=True, eq=False)
class OffsetCounts:
    """What a detector of a fixed rate makes of the oracle's contacts, by where its sampling starts.

    ``frames``: (offsets, C, outcomes) frames of each contact by ``Outcome``; ``invented``: share of the pair-frames
    that it reports which are no contact; ``false_contacts``: (offsets,) stretches of reported contact in which the
    oracle sees none; ``every_frame``: the same detector without its rate, of all contacts.
    """

    frames: IntArray
    invented: dict[str, Any]
    false_contacts: IntArray
    every_frame: EveryFrame | None = None

    def only(self, kept: BoolArray) -> "OffsetCounts":
        """Of the contacts for which ``kept`` (C,) is true; what is invented belongs to none and stays."""
        return replace(self, frames=self.frames[:, kept])

    @cached_property
    def faults(self) -> dict[str, BoolArray]:
        """Name -> (offsets, C) at which offsets which contacts have that fault."""
        return {"contacts_missed": never_found(self.frames), "contacts_in_part": found_in_part(self.frames)}

    def shares(self) -> Shares:
        """Counts over all offsets, and their shares: means over the offsets, with intervals over contacts."""
        offsets, contacts, _ = self.frames.shape
        whole = np.full(contacts, offsets)
        missed, found = self.frames.sum(axis=0)[:, [Outcome.MISSED, Outcome.BOTH]].T
        shares = {name: share_of_clusters(fault.sum(axis=0), whole) for name, fault in self.faults.items()}
        return {**shares, "missed": share_of_clusters(missed, missed + found), "invented": self.invented}

    def spreads(self) -> dict[str, dict[str, float]]:
        """Smallest, largest and mean number of contacts missed, and found in part, over the offsets."""
        return {name: spread(fault.sum(axis=1).tolist()) for name, fault in self.faults.items()}


def spread(counts: Sequence[int]) -> dict[str, float]:
    """``smallest``, ``largest`` and ``mean`` of the counts at each sampling offset, of which there is one at least."""
    return {"smallest": min(counts), "largest": max(counts), "mean": sum(counts) / len(counts)}


def over_phases(
    runs: Mapping[str, Run], assembly: Assembly, reference: Reference, seed: int, advance: Advance = ignored
) -> dict[str, OffsetCounts]:
    """The counts at all offsets of each run with a rate, and those of the same detector without one.

    Each is asked once more, about every frame; one that was asked live is timed live again, so that both times are
    alike. A detector that is none of our table, and a recording of more than an hour, keep the phase of the run.
    ``advance`` is called with ``STEPS`` in all for each of ``runs``.
    """
    counts = dict[str, OffsetCounts]()
    for label, run in runs.items():
        rate, ours = run.settings.get("rate_hz"), run.spec.name in (*DETECTORS, *OPTIONAL)
        if not (rate and ours and len(assembly.motion) <= HELD_FRAMES):
            advance(STEPS)
            continue
        detector = make_detector(replace(run.spec, settings={**run.spec.settings, "rate_hz": None}), assembly, seed)
        every = detect_all(detector, assembly)
        seconds = _look_seconds(detector, assembly.motion) if run.live else None
        advance(STEPS - PHASES)
        at_offsets = offset_counts(rate, every, reference, advance)
        comparison = reference.compare(every)
        always = count_contacts(comparison, reference.contacts)
        every_frame = EveryFrame(
            contacts_missed=always.missed,
            contacts_in_part=always.in_part,
            invented=count_reports(comparison).share(Outcome.INVENTED),
            seconds=seconds,
        )
        counts[label] = replace(at_offsets, every_frame=every_frame)
    return counts


def _look_seconds(detector: Detector, motion: Motion) -> float:
    """Seconds that a live look takes in the mean, over stretches that are spread evenly over a motion."""
    starts = np.arange(0, len(motion), max(STRETCH_FRAMES, -(-len(motion) // STRETCHES)))
    stretches = [motion.frames(start, min(start + STRETCH_FRAMES, len(motion))) for start in starts.tolist()]
    looks = join(stream_live(detector, stretches))
    return sum(float(np.sum(stage)) for stage in looks.seconds.values()) / len(looks.times)


def sampling_offsets(rate_hz: float) -> FloatArray:
    """Seconds by which sampling starts later, (``PHASES``,), evenly spread over the time from sample to sample."""
    return (np.arange(PHASES) + 0.5) / PHASES / rate_hz


def offset_counts(rate_hz: float, every: Detection, reference: Reference, advance: Advance = ignored) -> OffsetCounts:
    """What samples at a rate find at each offset; each sample holds what it sees of ``every`` frame."""
    frames = np.zeros((PHASES, len(reference.contacts), len(Outcome)), dtype=np.int64)
    reported, said, false = np.zeros((3, *every.verdict.shape), dtype=np.uint8)
    stretches = np.zeros(PHASES, dtype=np.int64)
    posed = every.verdict != Verdict.NO_POSE
    for number, later in enumerate(sampling_offsets(rate_hz)):
        samples = HeldLooks(len(every.pairs), rate_hz)
        looks = samples.looks(every.times - later)
        believed, _ = samples.hold(every.verdict[looks], posed[looks], looks, posed)
        comparison = reference.compare(replace(every, verdict=believed))
        frames[number] = count_contacts(comparison, reference.contacts).frames
        outcome = comparison.outcome
        invented = is_one_of(outcome, (Outcome.INVENTED,))
        true_or_false = is_one_of(outcome, (Outcome.BOTH, Outcome.INVENTED))
        reported |= is_one_of(outcome, REPORTED)
        # As of one run: what is within tolerance is neither true nor false.
        said += true_or_false
        false += invented
        stretches[number] = np.count_nonzero(invented[0]) + np.count_nonzero(invented[1:] & ~invented[:-1])
        advance(1)
    runs = column_runs((reported > 0).T).tolist()
    parts = [(slice(first, last + 1), pair) for pair, first, last in runs]
    false_sums, said_sums = ([int(table[part].sum(dtype=np.int64)) for part in parts] for table in (false, said))
    return OffsetCounts(frames, share_of_clusters(false_sums, said_sums), stretches)
