"""Why and when a detector was wrong about a contact: each sentence is chosen by what holds, and can be checked.

A sentence names its moment, and says no more than what was measured there.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy import isnan

from cdcore.protocol import counts_as_contact
from replay import words
from replay.auditing.causes import Audited
from replay.auditing.delay import frames_wrong
from replay.auditing.fault import Cause, Fault, FaultKind
from replay.auditing.holding import are_grasped
from replay.auditing.outcome import Episode
from replay.auditing.tolerance import Reference
from replay.detection.recorded import RecordedDetector
from replay.document.depth import tracker_noise_could_make
from replay.document.detector_labels import SHAPE_LABELS
from replay.document.ranking import Rank
from replay.document.run_document import RunDocument
from replay.document.run_result import RunResult
from replay.document.tables import package_toml
from replay.prepare.assembly import Assembly
from replay.words import duration, length, plural

CAUSE_REASONS: Final = package_toml("document/reasons.toml")
"""Of ``misses`` and of ``false`` contacts: cause -> why, as the end of a sentence."""

UNEXPLAINED_CLAUSE: Final = "nothing known about it explains this"


def explained_faults(
    assembly: Assembly, reference: Reference, subject: Audited, faults: Sequence[Fault]
) -> tuple[Fault, ...]:
    """Faults of a detector, each with the sentence about its cause and whether a hand holds a body of the pair."""
    segments = [(fault.pair, fault.first, fault.last) for fault in faults]
    with_reasons = []
    for fault, grasped in zip(faults, are_grasped(assembly, reference.holdings, segments), strict=True):
        if fault.kind.is_miss:
            why = why_missed(fault, fault.detector, subject, reference.episodes[fault.contact - 1])
            why += noise_remark(fault.depth, at_least=fault.depth_at_least)
        else:
            why = why_false(fault, fault.detector, subject)
        with_reasons.append(replace(fault, grasped=grasped, why=why))
    return tuple(with_reasons)


def noise_remark(depth: float, *, at_least: bool) -> str:
    """Return a sentence where the noise of a tracker could have made a missed contact; ``""``: it could not.

    ``depth`` in metres; ``at_least``: the contact may be deeper.
    """
    if at_least or not tracker_noise_could_make(depth):
        return ""
    return f" It is {length(depth)} deep: the noise of a tracker could have made it."


def why_missed(miss: Fault, label: str, audited: Audited, contact: Episode) -> str:
    """Why a contact was missed, late or cut short, in a sentence; ``contact`` is the oracle's that it belongs to."""
    outcome_clause = _outcome_clause(miss, label, audited, contact)
    if miss.cause == Cause.BETWEEN_SAMPLES and audited.sampled_frames is not None and audited.rate_hz:
        return _between_samples(miss, label, audited, contact)
    if miss.cause == Cause.BETWEEN_SAMPLES:
        return f"{outcome_clause}: by its own account it took no sample {_examined_extent(miss)}."
    if miss.cause in (Cause.LATE, Cause.EARLY):
        return f"{outcome_clause}: {_late_miss(miss, audited)}."
    if miss.cause == Cause.CLOCK and isinstance(audited.detector, RecordedDetector):
        return f"{outcome_clause}: {_clock(audited.detector)}."
    reason = CAUSE_REASONS["misses"].get(miss.cause, "")
    if not reason:
        return f"{outcome_clause}; {UNEXPLAINED_CLAUSE}."
    examined_frames, of = miss.agreeing
    return (
        f"{outcome_clause}: {reason}."
        if examined_frames == of
        else f"{outcome_clause}: in {examined_frames} of {of} examined frames {reason}."
    )


def _outcome_clause(miss: Fault, label: str, audited: Audited, contact: Episode) -> str:
    """Return how a detector reported a contact: never, late, cut short, or with an interruption."""
    pair_text, (begin, _) = " and ".join(miss.labels), miss.begin_within
    moment_text = f"at {words.moment(begin)}"
    long = duration_text(miss.frames, miss.end - miss.start)
    if miss.kind == FaultKind.NEVER_REPORTED:
        return f"{label} never reported the contact of {pair_text} {moment_text}"
    if (
        miss.kind == FaultKind.REPORTED_LATE
        and miss.first == contact.first
        and _reports_contact(audited, miss.pair, miss.last + 1)
    ):
        return f"{label} reported the contact of {pair_text} {moment_text} {long} late"
    if (
        miss.kind == FaultKind.LOST_EARLY
        and miss.last == contact.last
        and _reports_contact(audited, miss.pair, miss.first - 1)
    ):
        return f"{label} stopped reporting the contact of {pair_text} {moment_text} {long} too early"
    return f"{label} reported no contact of {pair_text} for {long} {moment_text}"


def _between_samples(miss: Fault, label: str, audited: Audited, contact: Episode) -> str:
    """A miss in frames of which most were not sampled."""
    assert audited.sampled_frames is not None and audited.rate_hz
    outcome_clause = _outcome_clause(miss, label, audited, contact)
    is_sampled = audited.sampled_frames & audited.has_pose(miss.pair)
    samples_inside = int(is_sampled[miss.first : miss.last + 1].sum())
    if samples_inside:
        return f"{outcome_clause}: it took no sample in {miss.frames - samples_inside} of these frames."
    sample_period, times = 1.0 / audited.rate_hz, audited.motion.times
    before, after = np.flatnonzero(is_sampled[: miss.first]), np.flatnonzero(is_sampled[miss.last + 1 :])
    if not len(before) or not len(after):
        side = "first" if not len(before) else "last"
        moment = words.moment(times[miss.last + 1 + after[0]]) if not len(before) and len(after) else ""
        moment = words.moment(times[before[-1]]) if len(before) else moment
        return (
            f"{outcome_clause}: it took its {side} sample at {moment}."
            if moment
            else f"{outcome_clause}: it took no sample."
        )
    gap = float(times[miss.last + 1 + after[0]] - times[before[-1]])
    period_clause = f"{label} samples every {_milliseconds(sample_period)}"
    contact_seconds = contact.end - contact.start
    is_whole_contact = (miss.first, miss.last) == (contact.first, contact.last)
    pair_text, (begin, _) = " and ".join(miss.labels), miss.begin_within
    moment_text = f"at {words.moment(begin)}"
    if miss.kind == FaultKind.NEVER_REPORTED and is_whole_contact:
        between_clause = (
            "between two samples"
            if contact_seconds < sample_period
            else f"between two samples {_milliseconds(gap)} apart"
        )
        return (
            f"{period_clause}; the contact of {pair_text} {moment_text} lasted {_milliseconds(contact_seconds)}, "
            f"{between_clause}."
        )
    if outcome_clause.endswith(" late") and miss.end - miss.start <= sample_period:
        return f"{period_clause}: it {outcome_clause.removeprefix(label).strip()}."
    return f"{outcome_clause}: two of its samples are {_milliseconds(gap)} apart there."


def _late_miss(miss: Fault, audited: Audited) -> str:
    """Why a contact is reported late or early: all of the pair is, by a number of frames, or this report alone."""
    delay = audited.delay(miss.pair)
    if delay and (delay > 0) == (miss.cause == Cause.LATE):
        return _delay_sentence(audited, miss.pair, delay)
    if miss.kind == FaultKind.REPORTED_LATE:
        return "its report of this contact begins late"
    return "its report of this contact ends early"


def _delay_sentence(audited: Audited, pair: int, delay: int) -> str:
    frames_wrong_now, frames_wrong_moved = frames_wrong(audited.subject, audited.oracle, pair, delay)
    direction = "earlier" if delay > 0 else "later"
    return (
        f"moved {plural(abs(delay), 'frame')} {direction}, what it reports of this pair is wrong in "
        f"{frames_wrong_moved:,} frames instead of {frames_wrong_now:,}"
    )


def why_false(false_contact: Fault, label: str, audited: Audited) -> str:
    """Why a false contact was reported, in a sentence about the moment at which its gap was measured."""
    pair_text, moment_text = (
        " and ".join(false_contact.labels),
        f"at {words.moment(float(audited.motion.times[false_contact.frame]))}",
    )
    gap = (
        "the surfaces do not meet"
        if isnan(false_contact.metres)
        else f"the surfaces are {length(false_contact.metres)} apart"
    )
    shape = SHAPE_LABELS.get(str(getattr(getattr(audited.detector, "settings", None), "shape", "")), "colliders")
    if false_contact.cause == Cause.HULL_FILLS_HOLLOW:
        other_body = next(body for body in false_contact.labels if body != false_contact.evidence.hollow)
        hollow_body = false_contact.evidence.hollow
        gap_clause = "" if isnan(false_contact.metres) else f", still {length(false_contact.metres)} from the mesh,"
        return (
            f"The convex hull of {hollow_body} fills its hollow: {other_body} is inside the hull{gap_clause} "
            f"{moment_text}."
        )
    if false_contact.cause == Cause.CONTACT_OFFSET:
        return _within_offset(false_contact, label, audited, f"the {shape} of {pair_text}", gap)
    if false_contact.cause == Cause.COLLIDERS_MEET:
        return f"The {shape} of {pair_text} meet {moment_text}; {gap}."
    if false_contact.cause == Cause.BOUNDING_VOLUMES:
        return f"Only the bounding volumes of {pair_text} overlap {moment_text}; {gap}, and {label} tests no triangle."
    long = duration_text(false_contact.frames, false_contact.end - false_contact.start)
    if false_contact.cause == Cause.LAST_ANSWER:
        return _last_answer(false_contact, label, audited, gap)
    report_clause = f"{label} reported contact of {pair_text} {moment_text} for {long}; {gap}"
    if false_contact.cause in (Cause.LATE, Cause.EARLY):
        return f"{report_clause}: {_late_report(false_contact, audited)}."
    if false_contact.cause == Cause.CLOCK and isinstance(audited.detector, RecordedDetector):
        return f"{report_clause}: {_clock(audited.detector)}."
    reason = CAUSE_REASONS["false"].get(false_contact.cause, "")
    return f"{report_clause}: {reason}." if reason else f"{report_clause}; {UNEXPLAINED_CLAUSE}."


def _within_offset(false_contact: Fault, label: str, audited: Audited, shapes: str, gap: str) -> str:
    moment_text, contact_offset = (
        f"at {words.moment(float(audited.motion.times[false_contact.frame]))}",
        audited.contact_reach(false_contact.pair),
    )
    offset = f"{label} reports contact from {length(contact_offset)} on: its contact offset"
    if false_contact.metres <= contact_offset:
        return f"{' and '.join(false_contact.labels)} are {length(false_contact.metres)} apart {moment_text}; {offset}."
    return f"{shapes[:1].upper()}{shapes[1:]} do not meet {moment_text}, and {gap}; {offset}."


def _last_answer(false_contact: Fault, label: str, audited: Audited, gap: str) -> str:
    """A false contact in frames between samples."""
    moment = float(audited.motion.times[false_contact.frame])
    long = duration_text(false_contact.frames, false_contact.end - false_contact.start)
    pair_text, moment_text = " and ".join(false_contact.labels), f"at {words.moment(moment)}"
    if audited.sampled_frames is None:
        return (
            f"{label} reported contact of {pair_text} for {long} {moment_text}; {gap}: by its own account it took "
            f"no sample there."
        )
    is_sampled = audited.sampled_frames & audited.has_pose(false_contact.pair)
    if not is_sampled[false_contact.first : false_contact.last + 1].any():
        report_clause = f"it reported contact of {pair_text} for {long} {moment_text}, too long"
        return f"{label} keeps its answer until its next sample: {report_clause}."
    earlier_samples = np.flatnonzero(is_sampled[: false_contact.frame + 1])
    sample = f" at {words.moment(float(audited.motion.times[earlier_samples[-1]]))}" if len(earlier_samples) else ""
    return f"At {words.moment(moment)} {label} kept the answer of its last sample{sample} about {pair_text}; {gap}."


def _late_report(false_contact: Fault, audited: Audited) -> str:
    """Why contact is reported before or after a true one: all of the pair is moved, or this report alone."""
    delay = audited.delay(false_contact.pair)
    if delay and (delay > 0) == (false_contact.cause == Cause.LATE):
        return _delay_sentence(audited, false_contact.pair, delay)
    if false_contact.kind == FaultKind.ENDS_LATE:
        return "its report of this contact ends late"
    if false_contact.kind == FaultKind.STARTS_EARLY:
        return "its report of this contact starts early"
    return UNEXPLAINED_CLAUSE


def _clock(detector: RecordedDetector) -> str:
    return (
        f"its clock is known to {_milliseconds(detector.clock_uncertainty)} only, and a report begins or ends that near"
    )


def _examined_extent(miss: Fault) -> str:
    examined, of = miss.agreeing
    return "there" if examined == of else f"in {examined} of {of} examined frames"


def _reports_contact(audited: Audited, pair: int, frame: int) -> bool:
    """Whether a detector reports contact of a pair in a frame of the recording."""
    verdict = audited.subject.verdict
    return 0 <= frame < len(verdict) and bool(counts_as_contact(verdict[frame : frame + 1, pair])[0])


def duration_text(frames: int, seconds: float) -> str:
    """``1 recorded frame (11 ms)``."""
    return f"{plural(frames, 'recorded frame')} ({_milliseconds(seconds)})"


def _milliseconds(seconds: float) -> str:
    """Three digits: ``11.1 ms``, ``12 ms``."""
    return duration(seconds)


LONG_SESSION_S: Final = 10.0
"""Seconds; moments of a shorter session need milliseconds."""


def what_text(fault: Fault) -> str:
    """Return what a detector did wrong at a fault: a contact that it misses, or reports of bodies that are apart."""
    pair = " and ".join(fault.bodies)
    if not fault.kind.is_miss:
        gap = "do not meet" if isnan(fault.metres) else f"are {length(fault.metres)} apart"
        contact = fault.name if fault.cause is Cause.BOUNDING_VOLUMES else "contact"
        return f"{fault.detector} reports {contact} of {pair}, which {gap}."
    lasted = _milliseconds(fault.end - fault.start)
    if fault.kind is FaultKind.NEVER_REPORTED:
        return f"{fault.detector} reports no contact of {pair}, which meet for {lasted}."
    return f"{fault.detector} misses {lasted} of a contact of {pair}."


def when_texts(result: RunResult, document: RunDocument, rank: Rank, fault: Fault, seconds: float) -> tuple[str, str]:
    """Return the moment at which to look at a fault, its bodies and which of how many it is; then other times.

    The second sentence says when the other faults of its pair happened; ``""``: there are none.
    """
    misses, false_contacts = result.misses.get(rank.label, ()), result.false.get(rank.label, ())
    faults_of_category = misses if fault.kind.is_miss else false_contacts
    if len(faults_of_category) == 1:
        ordinal = f"the only {fault.name}"
    elif fault.kind.is_miss:
        ordinal = f"{fault.name}, {fault.number} of {len(faults_of_category)} missed, late or cut short"
    else:
        ordinal = f"number {fault.number} of {plural(len(faults_of_category), fault.name)}"
    moment_sentence = f"At {words.moment(seconds)}: {' and '.join(fault.bodies)}, {ordinal}."
    faults_of_pair = [other for other in faults_of_category if other.bodies == fault.bodies]
    start, end = min(other.start for other in faults_of_pair), max(other.end for other in faults_of_pair)
    digits = 1 if document.session.duration >= LONG_SESSION_S else 3
    start_text, end_text = (words.decimal(second, digits) for second in (start, end))
    times_clause = f"at {start_text} s" if start_text == end_text else f"from {start_text} to {end_text} s"
    if len(faults_of_pair) == 1:
        return moment_sentence, ""
    return moment_sentence, f"This pair has {len(faults_of_pair)} of them, {times_clause}."
