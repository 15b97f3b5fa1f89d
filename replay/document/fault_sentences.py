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
from replay.document.detector_labels import SHAPES
from replay.document.ranking import Rank
from replay.document.run_document import RunDocument
from replay.document.run_result import RunResult
from replay.document.tables import package_toml
from replay.prepare.assembly import Assembly
from replay.words import duration, length, plural

REASONS: Final = package_toml("document/reasons.toml")
"""Of ``misses`` and of ``false`` contacts: cause -> why, as the end of a sentence."""

UNEXPLAINED: Final = "nothing known about it explains this"


def explained(assembly: Assembly, reference: Reference, subject: Audited, faults: Sequence[Fault]) -> tuple[Fault, ...]:
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


def why_missed(miss: Fault, label: str, by: Audited, contact: Episode) -> str:
    """Why a contact was missed, late or cut short, in a sentence; ``contact`` is the oracle's that it belongs to."""
    clause = _outcome(miss, label, by, contact)
    if miss.cause == Cause.BETWEEN_SAMPLES and by.sampled_frames is not None and by.rate_hz:
        return _between_samples(miss, label, by, contact)
    if miss.cause == Cause.BETWEEN_SAMPLES:
        return f"{clause}: by its own account it took no sample {_extent(miss)}."
    if miss.cause in (Cause.LATE, Cause.EARLY):
        return f"{clause}: {_late_miss(miss, by)}."
    if miss.cause == Cause.CLOCK and isinstance(by.detector, RecordedDetector):
        return f"{clause}: {_clock(by.detector)}."
    reason = REASONS["misses"].get(miss.cause, "")
    if not reason:
        return f"{clause}; {UNEXPLAINED}."
    examined, of = miss.agreeing
    return f"{clause}: {reason}." if examined == of else f"{clause}: in {examined} of {of} examined frames {reason}."


def _outcome(miss: Fault, label: str, by: Audited, contact: Episode) -> str:
    """Return how a detector reported a contact: never, late, cut short, or with an interruption."""
    pair, (begin, _) = " and ".join(miss.labels), miss.begin_within
    when = f"at {words.moment(begin)}"
    long = duration_text(miss.frames, miss.end - miss.start)
    if miss.kind == FaultKind.NEVER_REPORTED:
        return f"{label} never reported the contact of {pair} {when}"
    if miss.kind == FaultKind.REPORTED_LATE and miss.first == contact.first and _reports(by, miss.pair, miss.last + 1):
        return f"{label} reported the contact of {pair} {when} {long} late"
    if miss.kind == FaultKind.LOST_EARLY and miss.last == contact.last and _reports(by, miss.pair, miss.first - 1):
        return f"{label} stopped reporting the contact of {pair} {when} {long} too early"
    return f"{label} reported no contact of {pair} for {long} {when}"


def _between_samples(miss: Fault, label: str, by: Audited, contact: Episode) -> str:
    """A miss in frames of which most were not sampled."""
    assert by.sampled_frames is not None and by.rate_hz
    clause = _outcome(miss, label, by, contact)
    sampled = by.sampled_frames & by.has_pose(miss.pair)
    inside = int(sampled[miss.first : miss.last + 1].sum())
    if inside:
        return f"{clause}: it took no sample in {miss.frames - inside} of these frames."
    step, times = 1.0 / by.rate_hz, by.motion.times
    before, after = np.flatnonzero(sampled[: miss.first]), np.flatnonzero(sampled[miss.last + 1 :])
    if not len(before) or not len(after):
        side = "first" if not len(before) else "last"
        moment = words.moment(times[miss.last + 1 + after[0]]) if not len(before) and len(after) else ""
        moment = words.moment(times[before[-1]]) if len(before) else moment
        return f"{clause}: it took its {side} sample at {moment}." if moment else f"{clause}: it took no sample."
    gap = float(times[miss.last + 1 + after[0]] - times[before[-1]])
    usual = f"{label} samples every {_milliseconds(step)}"
    lasted = contact.end - contact.start
    whole = (miss.first, miss.last) == (contact.first, contact.last)
    pair, (begin, _) = " and ".join(miss.labels), miss.begin_within
    when = f"at {words.moment(begin)}"
    if miss.kind == FaultKind.NEVER_REPORTED and whole:
        between = "between two samples" if lasted < step else f"between two samples {_milliseconds(gap)} apart"
        return f"{usual}; the contact of {pair} {when} lasted {_milliseconds(lasted)}, {between}."
    if clause.endswith(" late") and miss.end - miss.start <= step:
        return f"{usual}: it {clause.removeprefix(label).strip()}."
    return f"{clause}: two of its samples are {_milliseconds(gap)} apart there."


def _late_miss(miss: Fault, by: Audited) -> str:
    """Why a contact is reported late or early: all of the pair is, by a number of frames, or this report alone."""
    delay = by.delay(miss.pair)
    if delay and (delay > 0) == (miss.cause == Cause.LATE):
        return _delay_sentence(by, miss.pair, delay)
    if miss.kind == FaultKind.REPORTED_LATE:
        return "its report of this contact begins late"
    return "its report of this contact ends early"


def _delay_sentence(by: Audited, pair: int, delay: int) -> str:
    wrong, moved = frames_wrong(by.subject, by.oracle, pair, delay)
    direction = "earlier" if delay > 0 else "later"
    return (
        f"moved {plural(abs(delay), 'frame')} {direction}, what it reports of this pair is wrong in "
        f"{moved:,} frames instead of {wrong:,}"
    )


def why_false(false: Fault, label: str, by: Audited) -> str:
    """Why a false contact was reported, in a sentence about the moment at which its gap was measured."""
    pair, when = " and ".join(false.labels), f"at {words.moment(float(by.motion.times[false.frame]))}"
    gap = "the surfaces do not meet" if isnan(false.metres) else f"the surfaces are {length(false.metres)} apart"
    shape = SHAPES.get(str(getattr(getattr(by.detector, "settings", None), "shape", "")), "colliders")
    if false.cause == Cause.HULL_FILLS_HOLLOW:
        other = next(body for body in false.labels if body != false.evidence.hollow)
        hollow = false.evidence.hollow
        far = "" if isnan(false.metres) else f", still {length(false.metres)} from the mesh,"
        return f"The convex hull of {hollow} fills its hollow: {other} is inside the hull{far} {when}."
    if false.cause == Cause.CONTACT_OFFSET:
        return _within_offset(false, label, by, f"the {shape} of {pair}", gap)
    if false.cause == Cause.COLLIDERS_MEET:
        return f"The {shape} of {pair} meet {when}; {gap}."
    if false.cause == Cause.BOUNDING_VOLUMES:
        return f"Only the bounding volumes of {pair} overlap {when}; {gap}, and {label} tests no triangle."
    long = duration_text(false.frames, false.end - false.start)
    if false.cause == Cause.LAST_ANSWER:
        return _last_answer(false, label, by, gap)
    report = f"{label} reported contact of {pair} {when} for {long}; {gap}"
    if false.cause in (Cause.LATE, Cause.EARLY):
        return f"{report}: {_late_report(false, by)}."
    if false.cause == Cause.CLOCK and isinstance(by.detector, RecordedDetector):
        return f"{report}: {_clock(by.detector)}."
    reason = REASONS["false"].get(false.cause, "")
    return f"{report}: {reason}." if reason else f"{report}; {UNEXPLAINED}."


def _within_offset(false: Fault, label: str, by: Audited, shapes: str, gap: str) -> str:
    when, reach = f"at {words.moment(float(by.motion.times[false.frame]))}", by.contact_reach(false.pair)
    offset = f"{label} reports contact from {length(reach)} on: its contact offset"
    if false.metres <= reach:
        return f"{' and '.join(false.labels)} are {length(false.metres)} apart {when}; {offset}."
    return f"{shapes[:1].upper()}{shapes[1:]} do not meet {when}, and {gap}; {offset}."


def _last_answer(false: Fault, label: str, by: Audited, gap: str) -> str:
    """A false contact in frames between samples."""
    moment = float(by.motion.times[false.frame])
    long = duration_text(false.frames, false.end - false.start)
    pair, when = " and ".join(false.labels), f"at {words.moment(moment)}"
    if by.sampled_frames is None:
        return (
            f"{label} reported contact of {pair} for {long} {when}; {gap}: by its own account it took no sample there."
        )
    sampled = by.sampled_frames & by.has_pose(false.pair)
    if not sampled[false.first : false.last + 1].any():
        report = f"it reported contact of {pair} for {long} {when}, too long"
        return f"{label} keeps its answer until its next sample: {report}."
    earlier = np.flatnonzero(sampled[: false.frame + 1])
    sample = f" at {words.moment(float(by.motion.times[earlier[-1]]))}" if len(earlier) else ""
    return f"At {words.moment(moment)} {label} kept the answer of its last sample{sample} about {pair}; {gap}."


def _late_report(false: Fault, by: Audited) -> str:
    """Why contact is reported before or after a true one: all of the pair is moved, or this report alone."""
    delay = by.delay(false.pair)
    if delay and (delay > 0) == (false.cause == Cause.LATE):
        return _delay_sentence(by, false.pair, delay)
    if false.kind == FaultKind.ENDS_LATE:
        return "its report of this contact ends late"
    if false.kind == FaultKind.STARTS_EARLY:
        return "its report of this contact starts early"
    return UNEXPLAINED


def _clock(detector: RecordedDetector) -> str:
    return (
        f"its clock is known to {_milliseconds(detector.clock_uncertainty)} only, and a report begins or ends that near"
    )


def _extent(miss: Fault) -> str:
    examined, of = miss.agreeing
    return "there" if examined == of else f"in {examined} of {of} examined frames"


def _reports(by: Audited, pair: int, frame: int) -> bool:
    """Whether a detector reports contact of a pair in a frame of the recording."""
    verdict = by.subject.verdict
    return 0 <= frame < len(verdict) and bool(counts_as_contact(verdict[frame : frame + 1, pair])[0])


def duration_text(frames: int, seconds: float) -> str:
    """``1 recorded frame (11 ms)``."""
    return f"{plural(frames, 'recorded frame')} ({_milliseconds(seconds)})"


def _milliseconds(seconds: float) -> str:
    """Three digits: ``11.1 ms``, ``12 ms``."""
    return duration(seconds)


LONG: Final = 10.0
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


def when_text(result: RunResult, rank: Rank, fault: Fault, seconds: float) -> str:
    """Return the moment at which to look at a fault, its bodies, and which of how many faults it is."""
    misses, false = result.misses.get(rank.label, ()), result.false.get(rank.label, ())
    every = misses if fault.kind.is_miss else false
    if len(every) == 1:
        which = f"the only {fault.name}"
    elif fault.kind.is_miss:
        which = f"{fault.name}, {fault.number} of {len(every)} missed, late or cut short"
    else:
        which = f"number {fault.number} of {plural(len(every), fault.name)}"
    return f"At {words.moment(seconds)}: {' and '.join(fault.bodies)}, {which}."


def other_times(result: RunResult, document: RunDocument, rank: Rank, fault: Fault) -> str:
    """Return when the other faults of the pair of ``fault`` happened; ``""``: there are none."""
    every = (result.misses if fault.kind.is_miss else result.false).get(rank.label, ())
    alike = [other for other in every if other.bodies == fault.bodies]
    start, end = min(other.start for other in alike), max(other.end for other in alike)
    digits = 1 if document.session.duration >= LONG else 3
    first, last = (words.decimal(second, digits) for second in (start, end))
    span = f"at {first} s" if first == last else f"from {first} to {last} s"
    return f"This pair has {len(alike)} of them, {span}." if len(alike) > 1 else ""
