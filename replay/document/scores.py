"""The audit of a detector as records: every proportion with its count, its whole and its interval; and the faults.

Of misses and false contacts there are as many as the report has cards for; the tables of the run hold them all.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from math import isnan
from typing import Any, Final, Literal

import msgspec
import numpy as np

from cdcore import Detection, Verdict
from cdcore.protocol import INSIDE_UNDECIDED, is_undecided
from cdcore.protocol.detection import NO_REASON
from replay.auditing.contact_counts import ContactCounts, count_reports, grasped_counts
from replay.auditing.fault import MISS_KINDS
from replay.auditing.matching import EpisodeMatches
from replay.auditing.noisy_contacts import HOLDS
from replay.auditing.outcome import Comparison, Outcome, counts_by_pair
from replay.auditing.sampling_offsets import OffsetCounts, count_spread
from replay.auditing.wilson import Proportion, pooled_proportion, proportion, proportion_of_clusters
from replay.document.audit import (
    NOT_EXAMINED,
    CauseCounts,
    ContactMatching,
    ContactPairFrames,
    CountRange,
    DetectorAudit,
    GraspedCounts,
    MissedDepth,
    NoiseProofAudit,
    OffsetProportions,
    OffsetRanges,
    PairAudit,
    PairFrames,
    TimeErrors,
)
from replay.document.run_document import ContactLengths, PairRecord
from replay.document.run_result import RunResult


def audit_of_detector(result: RunResult, label: str) -> DetectorAudit:
    """Return everything counted about one audited detector."""
    comparison, misses_of_label, contacts = result.comparisons[label], result.misses[label], result.counts[label]
    reference = result.detections[result.oracle]
    reference_verdicts = counts_by_pair(reference.verdict, len(Verdict)).sum(axis=0)
    false = result.false.get(label, ())
    offsets = result.phases.get(label)
    return DetectorAudit(
        pair_frames=_pair_frames(comparison),
        time_missed=contacts.proportion(Outcome.MISSED),
        false_contact=count_reports(comparison).proportion(Outcome.FALSE_CONTACT),
        undecided=undecided_proportion(result, label),
        undecided_reasons=reasons_of(result.detections[label]),
        undecided_alone=undecided_alone(result, label),
        reference_undecided=int(reference_verdicts[[Verdict.UNRESOLVED, Verdict.INVALID]].sum()),
        reference_undecided_reasons=reasons_of(reference),
        reference_inside_undecided=inside_undecided(reference),
        between_frames=_between_frames(result, label),
        unconfirmed=_count_unconfirmed(result, label),
        contacts=contacts.contacts,
        contacts_cut=sum(contact.cuts > 0 for contact in result.not_grasped),
        contacts_missed=contacts.missed,
        late_or_cut_short=contacts.late_or_cut_short,
        contacts_undecided=contacts.undecided,
        contact_frames_undecided=contacts.frames_undecided,
        while_grasped=_while_grasped(result, label, sorted({contact.pair for contact in result.holdings})),
        misses=len(misses_of_label),
        misses_by_kind={kind: sum(miss.kind == kind for miss in misses_of_label) for kind in MISS_KINDS},
        false_contacts=len(false),
        false_causes=dict(Counter(contact.cause for contact in false)),
        counts_over_offsets=_counts_over_offsets(contacts, offsets),
        means_over_offsets=_means_over_offsets(offsets),
        noise_proof=_noise_proof(result, contacts, offsets),
        causes=msgspec.convert(result.causes[label].table(), CauseCounts),
        matching=contact_matching(result, label),
        missed_depth=MissedDepth(
            deepest=max((miss.depth for miss in misses_of_label if not isnan(miss.depth)), default=None),
            unknown=dict(Counter(miss.not_measured for miss in misses_of_label if miss.not_measured)),
            at_least=sum(miss.depth_at_least for miss in misses_of_label),
        ),
    )


def _pair_frames(comparison: Comparison) -> PairFrames:
    """Return pair-frames by outcome."""
    return PairFrames(
        neither=comparison.pair_frames_of(Outcome.NEITHER),
        both=comparison.pair_frames_of(Outcome.BOTH),
        missed=comparison.pair_frames_of(Outcome.MISSED),
        false_contact=comparison.pair_frames_of(Outcome.FALSE_CONTACT),
        within_tolerance=comparison.pair_frames_of(Outcome.WITHIN_TOLERANCE),
        between_frames=comparison.pair_frames_of(Outcome.BETWEEN_FRAMES),
        left_out=comparison.pair_frames_of(Outcome.LEFT_OUT),
        grasped=comparison.pair_frames_of(Outcome.GRASPED),
    )


def _count_unconfirmed(result: RunResult, label: str) -> int:
    """Count false pair-frames that are candidates."""
    # Column by column, here and below: a table of flags for hours of frames is as large as the verdicts.
    columns = zip(result.detections[label].verdict.T, result.comparisons[label].outcome.T, strict=True)
    return sum(
        int(((verdict == Verdict.CANDIDATE) & (outcome == Outcome.FALSE_CONTACT)).sum()) for verdict, outcome in columns
    )


def _noise_proof(result: RunResult, contacts: ContactCounts, offsets: OffsetCounts | None) -> NoiseProofAudit | None:
    """Count those contacts alone that hold in spite of tracker noise; ``None``: noise was not asked for."""
    if result.noise is None:
        return None
    noise_labels = result.noise.labels
    holds_in_noise = np.array([noise_labels[number - 1] == HOLDS for number in contacts.numbers.tolist()], np.bool_)
    firm_counts = contacts.selected(holds_in_noise)
    firm_offsets = None if offsets is None else offsets.selected(holds_in_noise)
    return NoiseProofAudit(
        contacts=firm_counts.contacts,
        contacts_missed=firm_counts.missed,
        time_missed=firm_counts.proportion(Outcome.MISSED),
        counts_over_offsets=_counts_over_offsets(firm_counts, firm_offsets),
        means_over_offsets=_means_over_offsets(firm_offsets),
    )


def _counts_over_offsets(contacts: ContactCounts, offsets: OffsetCounts | None) -> OffsetRanges:
    """Return smallest, largest and mean counts over the sampling offsets; of a detector of no rate all are the same."""
    if offsets is None:
        ranges = {
            "contacts_missed": count_spread([contacts.missed]),
            "contacts_in_part": count_spread([contacts.late_or_cut_short]),
        }
    else:
        ranges = offsets.spreads()
    return OffsetRanges(
        contacts_missed=msgspec.convert(ranges["contacts_missed"], CountRange),
        late_or_cut_short=msgspec.convert(ranges["contacts_in_part"], CountRange),
    )


def _means_over_offsets(offsets: OffsetCounts | None) -> OffsetProportions | None:
    """Return the proportions over all sampling offsets; ``None``: no other offset was tried."""
    if offsets is None:
        return None
    proportions = offsets.proportions()
    return OffsetProportions(
        contacts_missed=proportions["contacts_missed"],
        late_or_cut_short=proportions["contacts_in_part"],
        time_missed=proportions["missed"],
        false_contact=proportions["false_contact"],
    )


def contact_matching(result: RunResult, label: str) -> ContactMatching:
    """Return how the contacts of a detector match those of the reference, without those of a hand and what it holds."""
    matches = result.matches[label]
    reference_contacts = len(result.episodes[result.oracle]) - len(matches.grasped_truth)
    reported_contacts = len(result.episodes[label]) - len(matches.grasped_reports)
    return matching_of(matches, reference_contacts, reported_contacts)


def matching_of(matches: EpisodeMatches, reference_contacts: int, reported_contacts: int) -> ContactMatching:
    """Return matched and unmatched contacts, and the errors of the matched ones."""
    to_match = reference_contacts - len(matches.excused_truth)
    return ContactMatching(
        reference_contacts=reference_contacts,
        reported_contacts=reported_contacts,
        matched=len(matches.matched),
        missed=len(matches.missed),
        absorbed=len(matches.absorbed),
        reference_excused=len(matches.excused_truth),
        false_contacts=len(matches.false_contacts),
        pieces=len(matches.pieces),
        reported_excused=len(matches.excused_reports),
        split=len(matches.split),
        merged=len(matches.merged),
        missed_proportion=proportion(len(matches.missed), to_match),
        false_proportion=proportion(len(matches.false_contacts), reported_contacts - len(matches.excused_reports)),
        onset_error=_time_errors([match.onset_error for match in matches.matched]),
        duration_error=_time_errors([match.duration_error for match in matches.matched]),
        end_error=_time_errors([match.onset_error + match.duration_error for match in matches.matched]),
    )


Lengths = dict[int, dict[str, ContactLengths]]
"""Column of a pair -> label -> its contacts."""

NO_LENGTHS: Final[Lengths] = {}


def pair_records(result: RunResult) -> tuple[PairRecord, ...]:
    """Return of every pair its contacts by detector, and what audited detectors made of it.

    Pairs of members of a group stand where their columns are, and their group's contacts in records behind all columns.
    """
    assembly, lengths = result.assembly, _contact_lengths(result)
    records, of_groups = list[PairRecord](), list[PairRecord]()
    for pair in range(len(assembly.pairs)):
        columns = assembly.columns_of_contact(pair)
        if assembly.things_of(pair) == assembly.bodies_of(pair):
            records.append(_pair_record(result, [pair], assembly.pair_name(pair), lengths))
            continue
        if pair == columns[0]:
            of_groups.append(_pair_record(result, columns, assembly.pair_name(pair), lengths))
        pair_text, group_name = "-".join(assembly.bodies_of(pair)), assembly.pair_name(pair)
        records.append(_pair_record(result, [pair], pair_text, (NO_LENGTHS, NO_LENGTHS), group_name))
    return (*records, *of_groups)


def _pair_record(
    result: RunResult, columns: Sequence[int], pair_name: str, lengths: tuple[Lengths, Lengths], group_name: str = ""
) -> PairRecord:
    """Return the record of a pair, or of the pairs of a group's members, whose contacts the first column counts."""
    contacts, grasped_contacts = (by_pair.get(columns[0], {}) for by_pair in lengths)
    return PairRecord(
        name=pair_name,
        grasp=bool(result.assembly.grasped[list(columns)].any()),
        containment={
            label: detection.containment[columns[0]]
            for label, detection in result.detections.items()
            if detection.containment
        },
        contacts=contacts,
        grasped_contacts=grasped_contacts,
        audit=_pair_audits(result, columns, {*contacts, *grasped_contacts}),
        group=group_name,
    )


def _contact_lengths(result: RunResult) -> tuple[Lengths, Lengths]:
    """Contacts of every pair by detector, and apart those of a hand with what it holds."""
    lengths: tuple[Lengths, Lengths] = ({}, {})
    grasped_episodes = set(result.holdings)
    for label, contacts in result.episodes.items():
        for contact in contacts:
            of_pair = lengths[label == result.oracle and contact in grasped_episodes].setdefault(contact.pair, {})
            lengths_before = of_pair.get(label, NO_CONTACTS)
            seconds = contact.end - contact.start
            of_pair[label] = ContactLengths(
                count=lengths_before.count + 1,
                seconds=lengths_before.seconds + seconds,
                longest=max(lengths_before.longest, seconds),
                cut=lengths_before.cut + (contact.cuts > 0),
            )
    return lengths


NO_CONTACTS: Final = ContactLengths(count=0, seconds=0.0, longest=0.0, cut=0)


def _pair_audits(result: RunResult, columns: Sequence[int], touching: set[str]) -> dict[str, PairAudit]:
    """Label -> what an audited detector made of a pair, or of those of a group; nothing where nobody reports contact.

    ``touching`` are the detectors that report a contact of the pair, which the first of the columns counts.
    """
    audit_of_label, pair = {}, columns[0]
    for label, comparison in result.comparisons.items():
        outcome_counts = comparison.by_pair[list(columns)].sum(axis=0)
        pair_frames = ContactPairFrames(
            both=int(outcome_counts[Outcome.BOTH]),
            missed=int(outcome_counts[Outcome.MISSED]),
            false_contact=int(outcome_counts[Outcome.FALSE_CONTACT]),
            within_tolerance=int(outcome_counts[Outcome.WITHIN_TOLERANCE]),
            grasped=int(outcome_counts[Outcome.GRASPED]),
        )
        if result.oracle in touching or any(msgspec.structs.astuple(pair_frames)):
            pair_counts = result.counts[label].of_pair(pair)
            audit_of_label[label] = PairAudit(
                contacts_missed=pair_counts.missed,
                late_or_cut_short=pair_counts.late_or_cut_short,
                pair_frames=pair_frames,
                while_grasped=_while_grasped(result, label, list(columns)) if pair_frames.grasped else None,
            )
    return audit_of_label


def _while_grasped(result: RunResult, label: str, pairs: Sequence[int]) -> GraspedCounts:
    """Count what a detector says of some pairs while a hand holds the body."""
    verdicts = result.detections[result.oracle].verdict, result.detections[label].verdict
    grasped_episodes = tuple(set(result.episodes[result.oracle]) - set(result.not_grasped))
    counts = grasped_counts(result.comparisons[label], verdicts, grasped_episodes, pairs)
    return GraspedCounts(
        contacts=counts["contacts"],
        contacts_missed=counts["contacts_missed"],
        late_or_cut_short=counts["contacts_in_part"],
        both=counts["both"],
        missed=counts["missed"],
        false_contact=counts["invented"],
    )


def _between_frames(result: RunResult, label: str) -> int | Literal["not examined"]:
    """Pair-frames of contact that only the motion between frames shows, if a detector decides there."""
    if "intervals" not in (result.detections[label].covers, result.detections[result.oracle].covers):
        return NOT_EXAMINED
    return result.comparisons[label].pair_frames_of(Outcome.BETWEEN_FRAMES)


MOST_REASONS: Final = 3
"""Reasons why a detector did not decide that a summary lists, the most frequent first."""


def reasons_of(detection: Detection) -> dict[str, int]:
    """Why pair-frames are undecided, where the detector says so -> how many, the most frequent first."""
    return dict(_all_reasons(detection).most_common(MOST_REASONS))


def inside_undecided(detection: Detection) -> int:
    """Pair-frames that are undecided because nobody knows what is inside a mesh."""
    return sum(count for reason, count in _all_reasons(detection).items() if reason.startswith(INSIDE_UNDECIDED))


def _all_reasons(detection: Detection) -> Counter[str]:
    return Counter(reason for reason in detection.reasons.values() if reason != NO_REASON)


def undecided_proportion(result: RunResult, label: str) -> Proportion:
    """Pair-frames with a pose in which one of the two did not decide: left out, though there was something to see.

    The interval is over pairs.
    """
    undecided_counts, posed_counts = [], []
    for verdict, outcome in zip(
        result.detections[result.oracle].verdict.T, result.comparisons[label].outcome.T, strict=True
    ):
        has_pose = verdict != Verdict.NO_POSE
        undecided_counts.append(int((has_pose & (outcome == Outcome.LEFT_OUT)).sum()))
        posed_counts.append(int(has_pose.sum()))
    return proportion_of_clusters(undecided_counts, posed_counts)


def undecided_alone(result: RunResult, label: str) -> int:
    """Pair-frames left out because this detector did not decide, where the reference did."""
    columns = zip(result.detections[result.oracle].verdict.T, result.comparisons[label].outcome.T, strict=True)
    return sum(int((~is_undecided(verdict) & (outcome == Outcome.LEFT_OUT)).sum()) for verdict, outcome in columns)


def _time_errors(errors: list[float]) -> TimeErrors | None:
    """Seconds: mean and median error, and the absolute error of the 95th percentile and of the worst."""
    if not errors:
        return None
    absolute_errors = np.abs(errors)
    return TimeErrors(
        mean=float(np.mean(errors)),
        median=float(np.median(errors)),
        p95_absolute=float(np.quantile(absolute_errors, 0.95)),
        largest_absolute=float(absolute_errors.max()),
    )


def pooled_audits(audits: Iterable[Mapping[str, DetectorAudit]]) -> dict[str, DetectorAudit]:
    """Label -> audit, from those of several sessions; detectors in the order first met."""
    sessions = list(audits)
    labels = dict.fromkeys(label for session in sessions for label in session)
    return {label: _pooled_audit([session[label] for session in sessions if label in session]) for label in labels}


def _pooled_audit(audits: Sequence[DetectorAudit]) -> DetectorAudit:
    """Return the audit of one detector over its sessions."""
    if len(audits) == 1:
        return audits[0]
    if all(audit.means_over_offsets is not None for audit in audits):
        return _summed(audits)
    # A session of hours is sampled at its own offset alone: then there is no mean over all of them.
    return _summed([msgspec.structs.replace(audit, means_over_offsets=None) for audit in audits])


def _summed(values: Sequence[Any]) -> Any:
    """Return one value for several: records and tables key by key, counts added, texts joined.

    Errors of matched contacts do not add up from their middles; each session keeps its own.
    """
    values = [value for value in values if value is not None and not isinstance(value, TimeErrors)]
    if not values:
        return None
    first_value = values[0]
    if isinstance(first_value, MissedDepth):
        return _pooled_depth(values)
    if isinstance(first_value, Proportion):
        return pooled_proportion(values)
    if isinstance(first_value, msgspec.Struct):
        field_names = first_value.__struct_fields__
        return type(first_value)(
            **{field_name: _summed([getattr(value, field_name) for value in values]) for field_name in field_names}
        )
    if isinstance(first_value, Mapping):
        keys = dict.fromkeys(key for value in values for key in value)
        return {key: _summed([value.get(key) for value in values]) for key in keys}
    if isinstance(first_value, str):
        return first_value if len(set(values)) == 1 else "; ".join(dict.fromkeys(values))
    return sum(values)


MOST_LISTED_MOMENTS: Final = 200
"""Moments of one detector of each kind at most in the picture: the longest cuts, the longest false contacts."""


def _pooled_depth(depths: Sequence[MissedDepth]) -> MissedDepth:
    """Return the deepest of several sessions, and all that is unknown."""
    deepest = max((depth.deepest for depth in depths if depth.deepest is not None), default=None)
    return MissedDepth(deepest=deepest, unknown=dict(sum((Counter(depth.unknown) for depth in depths), Counter())))
