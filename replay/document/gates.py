"""Limits that a build server holds a detector to; a limit that was not measured counts as broken."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from sys import float_info
from typing import Final

from msgspec.structs import astuple

from replay import words
from replay.auditing.sampling_offsets import OFFSET_COUNT
from replay.auditing.wilson import Proportion, proportion
from replay.document.audit import CountRange, DetectorAudit, NoiseProofAudit
from replay.document.detector import DetectorTimes
from replay.document.run_document import RunDocument
from replay.errors import AuditError

TimesByDetector = Mapping[str, DetectorTimes]
"""Label -> what a detector took in one session."""


@dataclass(frozen=True)
class Gates:
    """Limits that are not to be exceeded; ``None``: not asked for.

    Parameters
    ----------
    max_missed : share of the oracle's contacts never found, and of its pair-frames in contact not reported; of a
        detector of a step rate in the mean over its sampling offsets.
    max_p99_ms : milliseconds within which 99 of 100 samples are decided, of detectors that decide frame by frame: a
        sample is a frame on which the detector runs.
    max_false : share of the pair-frames that a detector reports as contact which are none.
    max_missed_depth : metres by which the bodies of a miss are in each other, at the worst frame that was compared.

    Raises ``AuditError``: a share beyond 0 to 1, or a limit that is no number.
    """

    max_missed: float | None = None
    max_p99_ms: float | None = None
    max_false: float | None = None
    max_missed_depth: float | None = None

    def __post_init__(self) -> None:
        units = {"max_p99_ms": "milliseconds", "max_missed_depth": "metres"}
        for gate_name in ("max_missed", "max_p99_ms", "max_false", "max_missed_depth"):
            limit, upper_limit = getattr(self, gate_name), float_info.max if gate_name in units else 1.0
            if limit is not None and not (isinstance(limit, (int, float)) and 0.0 <= limit <= upper_limit):
                range_text = units.get(gate_name, "a share from 0 to 1")
                raise AuditError(f"{gate_name} is {limit}; give {range_text}")

    def broken_limits(
        self, audit: Mapping[str, DetectorAudit], session_times: Sequence[tuple[str, TimesByDetector]]
    ) -> list[str]:
        """A sentence for each limit that was exceeded or could not be checked.

        ``audit`` is over all sessions, by label; ``session_times`` are sessions with what each detector took.
        """
        gate_checks = (
            ("--max-missed", self.max_missed, _broken_miss_gates),
            ("--max-false", self.max_false, _broken_false_gates),
            ("--max-missed-depth", self.max_missed_depth, _too_deep),
        )
        sentences = []
        for option, limit, gate_check in gate_checks:
            if limit is not None:
                sentences += [] if audit else [f"{option} cannot be checked: nothing was audited"]
                sentences += [
                    sentence
                    for label, detector in audit.items()
                    for sentence in gate_check(option, label, detector, limit)
                ]
        return sentences + (
            [] if self.max_p99_ms is None else _broken_time_gates(audit, session_times, self.max_p99_ms)
        )


def _broken_miss_gates(option: str, label: str, audit: DetectorAudit, limit: float) -> Iterator[str]:
    counted_audit = audit.noise_proof or audit
    contacts, undecided = counted_audit.contacts, audit.contact_frames_undecided
    if undecided:
        in_whole = f"{audit.contacts_undecided} of {contacts} contacts whole"
        yield f"{option} cannot be checked: {label} left {undecided} pair-frames in contact undecided, {in_whole}"
    elif not contacts:
        contact_noun = "contact that holds in spite of the noise" if audit.noise_proof else "contact"
        yield f"{option} cannot be checked: there is no {contact_noun} for {label} to miss"
    yield from _undecided_reference(option, audit)
    for missed_text, proportion_missed in _missed_proportions(counted_audit):
        if exceeds(proportion_missed, limit):
            excess_clause = f"{percent(proportion_missed)}), more than {option} {limit:g}{_not_counted(audit)}"
            if audit.noise_proof:
                excess_clause += "; counted is what holds in spite of the noise"
            yield f"{label} missed {missed_text} ({excess_clause}"


def exceeds(proportion: Proportion, limit: float) -> bool:
    """Whether a proportion was measured and is more than a limit."""
    return proportion.value is not None and proportion.value > limit


def _missed_proportions(audit: DetectorAudit | NoiseProofAudit) -> Iterator[tuple[str, Proportion]]:
    """Contacts and pair-frames missed, in words and as a proportion: of a step rate the mean over its sampling offsets.

    Where sampling starts is chance; this run's offset alone would let a detector pass that fails at most others.
    """
    means, contacts = audit.means_over_offsets, audit.contacts
    if means is None:
        missed_frames = audit.time_missed
        yield f"{audit.contacts_missed} of {contacts} contacts", proportion(audit.contacts_missed, contacts)
        yield f"{missed_frames.count} of {missed_frames.of} pair-frames in contact", missed_frames
        return
    offsets_clause = f"over {OFFSET_COUNT} start times of sampling"
    contacts_text = over_offsets(audit.counts_over_offsets.contacts_missed, contacts)
    yield f"contacts: {contacts_text} {offsets_clause}", means.contacts_missed
    yield f"pair-frames in contact, mean {offsets_clause}", means.time_missed


def over_offsets(counts: CountRange, of: int) -> str:
    """``0.50 of 18, 0-1``: mean, and smallest to largest over the sampling offsets; one number where all are equal."""
    if counts.smallest == counts.largest:
        return f"{counts.smallest} of {of}"
    return f"{words.decimal(counts.mean, 2)} of {of}, {counts.smallest}-{counts.largest}"


def _broken_false_gates(option: str, label: str, audit: DetectorAudit, most: float) -> Iterator[str]:
    pair_frames = audit.pair_frames
    if sum(astuple(pair_frames)) == pair_frames.left_out:
        yield f"{option} cannot be checked: {label} was compared in no pair-frame"
    yield from _undecided_reference(option, audit)
    false_proportion = audit.false_contact_mean
    if exceeds(false_proportion, most):
        count_clause = f"{false_proportion.count} of the {false_proportion.of} pair-frames in contact that it reports"
        mean = f"pair-frames in contact, mean over {OFFSET_COUNT} start times of sampling"
        measured_count = count_clause if audit.means_over_offsets is None else mean
        limit_clause = f"more than {option} {most:g}{_not_counted(audit)}"
        yield f"{label} reports false contact: {measured_count} ({percent(false_proportion)}), {limit_clause}"


def _too_deep(option: str, label: str, audit: DetectorAudit, limit: float) -> Iterator[str]:
    """Yield what is broken of the depth of misses: a deeper one, or one whose depth nobody knows."""
    depth = audit.missed_depth
    if depth.deepest is not None and depth.deepest > limit:
        deepest = f"{words.number_above(1e3 * depth.deepest, 1e3 * limit)} mm"
        yield f"{label} missed contact that is {deepest} deep, more than {option} {words.length(limit)}"
    if depth.at_least and (depth.deepest is None or depth.deepest <= limit):
        misses = words.plural(depth.at_least, "miss", "misses")
        yield f"{option} cannot be checked: not every frame of {misses} of {label} was searched for the deepest one"
    if depth.unknown:
        reasons = "; ".join(
            f"{reason} ({words.plural(miss_count, 'miss', 'misses')})" for reason, miss_count in depth.unknown.items()
        )
        yield f"{option} cannot be checked: the depth of misses of {label} is unknown: {reasons}"


def _not_counted(audit: DetectorAudit) -> str:
    """That contacts of a hand and what it holds are in no gate, where there are any."""
    return "; what a hand holds is not counted" if any(astuple(audit.while_grasped)) else ""


def _undecided_reference(option: str, audit: DetectorAudit) -> Iterator[str]:
    # What nobody can decide, whether a body is inside a mesh with holes, is counted for no detector and against none.
    undecided_frames = audit.reference_undecided - audit.reference_inside_undecided
    if undecided_frames:
        yield f"{option} cannot be checked: the reference left {undecided_frames} pair-frames undecided"


def _broken_time_gates(
    audit: Mapping[str, DetectorAudit], session_times: Sequence[tuple[str, TimesByDetector]], limit: float
) -> list[str]:
    sentences = [] if audit else ["--max-p99-ms cannot be checked: nothing was audited"]
    for session, detectors in session_times:
        for label in audit:
            if label not in detectors:
                continue
            seconds = detectors[label]
            if seconds.p99 is None:
                sentences.append(f"--max-p99-ms cannot be checked: {label} was not timed frame by frame in {session}")
            elif seconds.p99 * 1e3 > limit:
                p99 = words.number_above(1e3 * seconds.p99, limit)
                mean = words.frame_time(seconds.per_frame_mean)
                sentences.append(
                    f"{label} takes {p99} ms at the 99th percentile of its samples in {session}, {mean} a frame in the "
                    f"mean, more than --max-p99-ms {limit:g}"
                )
    return sentences


def times_of(documents: Iterable[RunDocument]) -> list[tuple[str, TimesByDetector]]:
    """Sessions, each with what every detector took in it."""
    return [
        (
            f"session {document.session.id}",
            {label: detector.seconds for label, detector in document.detectors.items()},
        )
        for document in documents
    ]


def percent(proportion: Proportion, what_counted: str = "") -> str:
    """``0.3 % [0.1, 0.6]``: a proportion and its interval for people.

    ``what_counted``: of what, before the interval.
    """
    if proportion.value is None:
        return "none"
    value, lower, upper = (
        words.percentage(100 * bound) for bound in (proportion.value, proportion.lower, proportion.upper)
    )
    interval_text = (
        f"[{lower}, {upper}]" if proportion.upper - proportion.lower <= WIDEST_PRINTED_INTERVAL else TOO_FEW_CONTACTS
    )
    return f"{value} %{' ' if what_counted else ''}{what_counted} {interval_text}"


WIDEST_PRINTED_INTERVAL: Final = 0.6
"""An interval wider than this spans most of 0 to 100 %."""

TOO_FEW_CONTACTS: Final = "(too few contacts to say)"
