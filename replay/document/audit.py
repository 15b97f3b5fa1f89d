"""The audit of one detector: everything counted about its answers beside those of the reference."""

from typing import Literal

from replay.document.proportion import Proportion
from replay.document.record import Count, Counts, Record

NOT_EXAMINED = "not examined"
"""Stands for a count of contacts between frames where both detectors decide at instants only."""


class PairFrames(
    Record,
    frozen=True,
    rename={
        "neither": "NEITHER",
        "both": "BOTH",
        "missed": "MISSED",
        "false_contact": "INVENTED",
        "within_tolerance": "WITHIN_TOLERANCE",
        "between_frames": "BETWEEN_FRAMES",
        "left_out": "LEFT_OUT",
        "grasped": "HELD",
    },
):
    """Pair-frames by ``Outcome``: every pair in every frame is one of them."""

    neither: Count
    both: Count
    missed: Count
    false_contact: Count
    within_tolerance: Count
    between_frames: Count
    left_out: Count
    grasped: Count


class ContactPairFrames(
    Record,
    frozen=True,
    rename={
        "both": "BOTH",
        "missed": "MISSED",
        "false_contact": "INVENTED",
        "within_tolerance": "WITHIN_TOLERANCE",
        "grasped": "HELD",
    },
):
    """Frames of one pair by those outcomes that speak of contact."""

    both: Count
    missed: Count
    false_contact: Count
    within_tolerance: Count
    grasped: Count


class GraspedCounts(Record, frozen=True, rename={"late_or_cut_short": "contacts_in_part", "false_contact": "invented"}):
    """Counts while a hand holds the body, which stand in no other: contacts, then pair-frames."""

    contacts: Count
    contacts_missed: Count
    late_or_cut_short: Count
    both: Count
    missed: Count
    false_contact: Count


class CountRange(Record, frozen=True):
    """A number of contacts over the sampling offsets."""

    smallest: Count
    largest: Count
    mean: float


class OffsetRanges(Record, frozen=True, rename={"late_or_cut_short": "contacts_in_part"}):
    """Contacts with a fault over the sampling offsets; of a detector of no rate all are the same."""

    contacts_missed: CountRange
    late_or_cut_short: CountRange


class OffsetProportions(
    Record,
    frozen=True,
    rename={"late_or_cut_short": "contacts_in_part", "time_missed": "missed", "false_contact": "invented"},
):
    """Means over the sampling offsets, with intervals over contacts."""

    contacts_missed: Proportion
    late_or_cut_short: Proportion
    time_missed: Proportion
    false_contact: Proportion


class CauseCounts(Record, frozen=True):
    """Causes of misses, each with its misses and pair-frames, zeros included."""

    misses: Counts
    pair_frames: Counts
    examined: Count
    missed: Count


class TimeErrors(Record, frozen=True, rename={"p95_absolute": "p95_off", "largest_absolute": "most_off"}):
    """Seconds by which matched contacts begin, end or last longer than the reference's."""

    mean: float
    median: float
    p95_absolute: float
    largest_absolute: float


class ContactMatching(
    Record,
    frozen=True,
    rename={
        "reference_contacts": "truth",
        "reported_contacts": "found",
        "reference_excused": "excused_truth",
        "false_contacts": "invented",
        "reported_excused": "excused_found",
        "missed_proportion": "missed_share",
        "false_proportion": "invented_share",
    },
):
    """Contacts of the reference and of a detector, matched one to one; errors are ``None`` where none is matched."""

    reference_contacts: Count
    reported_contacts: Count
    matched: Count
    missed: Count
    absorbed: Count
    reference_excused: Count
    false_contacts: Count
    pieces: Count
    reported_excused: Count
    split: Count
    merged: Count
    missed_proportion: Proportion
    false_proportion: Proportion
    onset_error: TimeErrors | None
    duration_error: TimeErrors | None
    end_error: TimeErrors | None


class NoiseProofAudit(
    Record,
    frozen=True,
    rename={"time_missed": "missed", "counts_over_offsets": "offsets", "means_over_offsets": "phases"},
):
    """Counts of those contacts alone that hold in spite of tracker noise."""

    contacts: Count
    contacts_missed: Count
    time_missed: Proportion
    counts_over_offsets: OffsetRanges
    means_over_offsets: OffsetProportions | None = None


class DetectorAudit(
    Record,
    frozen=True,
    kw_only=True,
    rename={
        "time_missed": "missed",
        "false_contact": "invented",
        "reference_undecided": "oracle_undecided",
        "reference_undecided_reasons": "oracle_undecided_reasons",
        "reference_inside_undecided": "oracle_inside_undecided",
        "late_or_cut_short": "contacts_in_part",
        "while_grasped": "held",
        "misses_by_kind": "by_kind",
        "counts_over_offsets": "offsets",
        "means_over_offsets": "phases",
        "noise_proof": "holds",
        "matching": "episodes",
    },
):
    """Everything counted about one audited detector.

    Parameters
    ----------
    pair_frames : every pair in every frame, by outcome.
    time_missed : of the pair-frames in contact, those not reported.
    false_contact : of the pair-frames reported as contact, those that are none.
    undecided : of the pair-frames with a pose, those in which one of the two did not decide.
    undecided_reasons : why the detector did not decide -> pair-frames, the most frequent first.
    undecided_alone : pair-frames that the detector did not decide and the reference did.
    reference_undecided : pair-frames that the reference did not decide, and why.
    reference_inside_undecided : those of them where nobody knows what is inside a mesh.
    between_frames : pair-frames of contact that only the motion between frames shows.
    unconfirmed : false pair-frames that are candidates: only bounding volumes overlap there.
    contacts : of the reference, without those of a hand and what it holds.
    contacts_cut : contacts that lost poses cut.
    contacts_missed, late_or_cut_short, contacts_undecided : what became of the contacts.
    contact_frames_undecided : pair-frames in contact that the detector did not decide.
    while_grasped : counted apart, while a hand holds the body.
    misses, misses_by_kind : stretches of contact not reported.
    false_contacts, false_causes : stretches reported where there is no contact, and causes of them.
    counts_over_offsets : smallest, largest and mean over the sampling offsets.
    means_over_offsets : ``None`` where no other sampling offset was tried.
    noise_proof : of contacts that hold in spite of tracker noise; ``None``: noise was not asked for.
    causes : why misses were missed.
    matching : contacts of both matched one to one.
    """

    pair_frames: PairFrames
    time_missed: Proportion
    false_contact: Proportion
    undecided: Proportion
    undecided_reasons: Counts
    undecided_alone: Count
    reference_undecided: Count
    reference_undecided_reasons: Counts
    reference_inside_undecided: Count
    between_frames: Count | Literal["not examined"]
    unconfirmed: Count
    contacts: Count
    contacts_cut: Count
    contacts_missed: Count
    late_or_cut_short: Count
    contacts_undecided: Count
    contact_frames_undecided: Count
    while_grasped: GraspedCounts
    misses: Count
    misses_by_kind: Counts
    false_contacts: Count
    false_causes: Counts
    counts_over_offsets: OffsetRanges
    means_over_offsets: OffsetProportions | None = None
    noise_proof: NoiseProofAudit | None = None
    causes: CauseCounts
    matching: ContactMatching


class PairAudit(Record, frozen=True, rename={"late_or_cut_short": "contacts_in_part", "while_grasped": "held"}):
    """One pair beside the reference; ``while_grasped``: ``None`` where no hand holds the body."""

    contacts_missed: Count
    late_or_cut_short: Count
    pair_frames: ContactPairFrames
    while_grasped: GraspedCounts | None = None
