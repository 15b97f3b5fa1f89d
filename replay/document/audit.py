"""The audit of one detector: everything counted about its answers beside those of the reference."""

from typing import Final, Literal

from msgspec import field
from msgspec.structs import astuple

from replay.auditing.record import Count, Counts, Record
from replay.auditing.wilson import Proportion

NOT_EXAMINED: Final = "not examined"
"""Stands for a count of contacts between frames where both detectors decide at instants only."""


class PairFrames(
    Record,
    frozen=True,
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

    @property
    def compared(self) -> int:
        """Pair-frames that reference and detector both decided."""
        return sum(astuple(self)) - self.left_out


class ContactPairFrames(
    Record,
    frozen=True,
):
    """Frames of one pair by those outcomes that speak of contact."""

    both: Count
    missed: Count
    false_contact: Count
    within_tolerance: Count
    grasped: Count


class GraspedCounts(Record, frozen=True):
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


class OffsetRanges(Record, frozen=True):
    """Contacts with a fault over the sampling offsets; of a detector of no rate all are the same."""

    contacts_missed: CountRange
    late_or_cut_short: CountRange


class OffsetProportions(
    Record,
    frozen=True,
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


class TimeErrors(Record, frozen=True):
    """Seconds by which matched contacts begin, end or last longer than the reference's."""

    mean: float
    median: float
    p95_absolute: float
    largest_absolute: float


class ContactMatching(
    Record,
    frozen=True,
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
):
    """Counts of those contacts alone that hold in spite of tracker noise."""

    contacts: Count
    contacts_missed: Count
    time_missed: Proportion
    counts_over_offsets: OffsetRanges
    means_over_offsets: OffsetProportions | None = None


class MissedDepth(Record, frozen=True):
    """Depth of misses: at each the deepest point of one body in the other, at the worst frame that was compared.

    Parameters
    ----------
    deepest : metres, of the deepest miss; ``None``: none was measured.
    unknown : why depths are unknown -> misses.
    at_least : misses of which some frames were left out of the search for the deepest one.
    """

    deepest: float | None = None
    unknown: Counts = field(default_factory=dict)
    at_least: Count = 0


NO_DEPTH: Final = MissedDepth()


class DetectorAudit(
    Record,
    frozen=True,
    kw_only=True,
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
    missed_depth : how deep the bodies are in each other in its misses.
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
    missed_depth: MissedDepth = NO_DEPTH

    @property
    def false_contact_mean(self) -> Proportion:
        """The false part of the pair-frames reported as contact, over the sampling offsets if there are several."""
        return self.false_contact if self.means_over_offsets is None else self.means_over_offsets.false_contact


class PairAudit(Record, frozen=True):
    """One pair beside the reference; ``while_grasped``: ``None`` where no hand holds the body."""

    contacts_missed: Count
    late_or_cut_short: Count
    pair_frames: ContactPairFrames
    while_grasped: GraspedCounts | None = None
