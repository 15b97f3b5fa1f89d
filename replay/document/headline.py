"""Sentences about what a detector missed and how long it took, the same in terminal, picture and report."""

from collections.abc import Iterable, Mapping
from typing import Final

from replay import words
from replay.auditing.flicker import FLICKER_SECONDS, Flicker
from replay.auditing.noisy_contacts import ABSENT, HOLDS, UNDECIDABLE
from replay.detection.recorded import CLOCK_FACT, OFFSET_FACT, RECORDED_DETECTOR, ReportClock
from replay.document.answer import Reason
from replay.document.certainty import certainty
from replay.document.cost import BATCH_TIMING_SENTENCE, FRAME_TEXT, NO_SLOWEST_SENTENCE, TIMES_SENTENCE, busy_text
from replay.document.decision import Decision, fix_figures, shipping_decision
from replay.document.ranking import all_unconfirmed, any_decided, lesser_faults
from replay.document.run_document import RunDocument
from replay.document.run_result import RunResult, Summarised
from replay.words import plural
from sessions import Finding, Severity
from sessions.doctor.finding import CODES

DOUBTFUL_GROUPS: Final = ("import", "scale")
"""Groups of findings that make an answer doubtful even where they are warnings."""
DOUBTFUL_CODES: Final = ("mesh-apart", "mesh-pivot", "mesh-units", "often-missing")
"""Codes of other groups that do."""
NOISE_LIMITS_SENTENCE: Final = (
    "Not in these copies: a constant offset of a tracker, a wrong mesh, noise that the recording already has."
)


def doubts(document: RunDocument) -> list[str]:
    """Return doubts about the answer, which stand below it: errors, losses of the import, units, axes, handedness.

    With positions in millimetres nothing meets, and "none missed" would be true and worth nothing.
    """
    return [*open_questions(document), *doubts_of(findings_of(document))]


def findings_of(document: RunDocument) -> list[Finding]:
    """Return the findings of the doctor, the worst first; codes of another version are left out."""
    return [
        Finding(
            code=finding_record.code,
            own_severity=Severity[finding_record.severity.upper()],
            message=finding_record.message,
            body=finding_record.body or "",
            start=finding_record.start,
            end=finding_record.end,
            count=finding_record.count,
        )
        for finding_record in document.findings
        if finding_record.code in CODES
    ]


def open_questions(document: RunDocument) -> list[str]:
    """Return a sentence for each guess of an import that changes contacts, and one for all others."""
    return [*document.open_questions, *document.guesses]


def doubts_of(findings: Iterable[Finding]) -> list[str]:
    """The same of findings."""
    findings_by_code: dict[tuple[Severity, str], list[Finding]] = {}
    for first_finding in findings:
        if (
            first_finding.severity == Severity.ERROR
            or CODES[first_finding.code].group in DOUBTFUL_GROUPS
            or (first_finding.code in DOUBTFUL_CODES and first_finding.severity == Severity.WARNING)
        ):
            findings_by_code.setdefault((first_finding.severity, first_finding.code), []).append(first_finding)
    lines = []
    for (severity, code), (first_finding, *more) in findings_by_code.items():
        located_message = (
            f"{first_finding.body}: {first_finding.message}" if first_finding.body else first_finding.message
        )
        more_text = f"; {len(more)} more like it" if more else ""
        lines.append(
            f"{severity.name.capitalize()}, {code}: {first_finding.meaning} ({located_message}{more_text}). To "
            f"do: {first_finding.fix}."
        )
    return lines


def undecided_lines(result: Summarised) -> list[str]:
    """A line of what the reference did not decide, and one for each detector that left out more than that."""
    audits = result.document.audit
    lines = []
    for audit in list(audits.values())[:1]:
        undecided_count = audit.reference_undecided
        if undecided_count:
            frames_text = plural(undecided_count, "frame" if len(result.document.pairs) == 1 else "pair-frame")
            reasons_clause = _reasons_clause(audit.reference_undecided_reasons)
            lines.append(f"Not counted: {frames_text}{reasons_clause or f', which {result.oracle} did not decide'}.")
    for label, audit in audits.items():
        if audit.undecided_alone:
            undecided_frames = f"{audit.undecided_alone:,} of {audit.undecided.of:,} pair-frames with a pose"
            lines.append(f"Not counted: {undecided_frames}, which {label} did not decide.")
            lines += [f"Of them {count:,}: {reason}." for reason, count in audit.undecided_reasons.items()]
    return lines


def _reasons_clause(reasons: Mapping[str, int]) -> str:
    """`` (inside undecided: block has holes)``: the reasons of pair-frames that are not counted, with their numbers."""
    if len(reasons) == 1:
        return f" ({next(iter(reasons))})"
    return f" ({'; '.join(f'{count:,}: {reason}' for reason, count in reasons.items())})" if reasons else ""


def flicker_notes(result: Summarised) -> list[str]:
    """A line for each detector of which contacts are interrupted, with the release distance that joins them."""
    return [
        f"Flicker: {_flicker_sentence(label, detector.flicker)} {_release_sentence(detector.flicker)}".rstrip()
        for label, detector in result.document.detectors.items()
        if detector.flicker is not None
    ]


def _flicker_sentence(label: str, flicker: Flicker) -> str:
    """``7 of 25 contacts of mesh50 are 1 contact, interrupted 6 times for at most 100 ms and 1.1 mm each.``"""
    contacts = f"{flicker.contacts:,} of {plural(flicker.reported, 'contact')} of {label}"
    is_single = flicker.interruptions == 1
    times_text, each_text = ("once", "") if is_single else (plural(flicker.interruptions, "time"), " each")
    longest = words.duration(FLICKER_SECONDS)
    gap = "" if flicker.widest is None else f" and {words.length(flicker.widest)}"
    return (
        f"{contacts} are {plural(flicker.joined, 'contact')}, interrupted {times_text} for at most "
        f"{longest}{gap}{each_text}."
    )


def _release_sentence(flicker: Flicker) -> str:
    """Sentence about the release distance; ``""``: none was measured."""
    release = flicker.release
    if release is None:
        return ""
    joined_interruptions = flicker.interruptions - release.interruptions
    cost_clause = ""
    if release.false_contact is not None and release.false_contact_without is not None:
        false_before, false_after = map(words.as_percentage, (release.false_contact_without, release.false_contact))
        cost_clause = f": {false_after} false contact instead of {false_before}"
    begin_distance, release_distance = words.length(release.begins), words.length(release.metres)
    interruptions_text = plural(flicker.interruptions, "interruption")
    return (
        f"Contact on at {begin_distance} and off at {release_distance} joins {joined_interruptions:,} of "
        f"{interruptions_text}{cost_clause} "
        f"(measured on this session as {release.setting})."
    )


def grasped_notes(result: Summarised) -> list[str]:
    """A line for each detector of what it gets wrong while a hand holds the body, which is not counted."""
    lines = []
    for label, audit in result.document.audit.items():
        grasped_counts = audit.while_grasped
        contacts, false_frames = grasped_counts.contacts, grasped_counts.false_contact
        clauses = []
        if contacts:
            clauses.append(f"misses {grasped_counts.contacts_missed} of {plural(contacts, 'contact')}")
        if false_frames:
            is_unconfirmed = all_unconfirmed(audit)
            clauses.append(f"reports {plural(false_frames, 'unconfirmed frame' if is_unconfirmed else 'false frame')}")
        if clauses:
            lines.append(f"While a hand holds it: not counted. There {label} {' and '.join(clauses)}.")
    return lines


def notes_of(result: RunResult) -> list[str]:
    """Return notes beside the headlines: what was not decided or not counted, and what is chance."""
    return [
        *undecided_lines(result),
        *flicker_notes(result),
        *engine_reports(result),
        *grasped_notes(result),
        *noise_lines(result),
        *compound_lines(result),
    ]


def engine_reports(result: Summarised) -> list[str]:
    """A line about the delay of an engine's reports, and about their clock, which may hold a part of that delay."""
    lines = []
    facts = result.document.session.facts
    for label, audit in result.document.audit.items():
        if result.document.detectors[label].name != RECORDED_DETECTOR:
            continue
        onset_errors, end_errors = audit.matching.onset_error, audit.matching.end_error
        stated_clock = facts.get(CLOCK_FACT, "")
        clock = REPORT_CLOCKS.get(stated_clock, REPORT_CLOCKS[ReportClock.OWN]).format(
            offset=facts.get(OFFSET_FACT, "0")
        )
        if onset_errors and end_errors:
            median = f"median of {plural(audit.matching.matched, 'contact')}"
            lateness = f"{_lateness_text('begins', onset_errors.median)}, {_lateness_text('ends', end_errors.median)}"
            lines.append(f"Reports of the engine ({label}): {lateness} ({median}), {clock}.")
        else:
            lines.append(f"Reports of the engine ({label}): none matches a contact, so no delay is known; {clock}.")
    return lines


REPORT_CLOCKS: Final[Mapping[str, str]] = {
    ReportClock.OWN: "on the recording's own clock",
    ReportClock.GIVEN: "with the clock offset that was given ({offset} s)",
    ReportClock.FITTED: "with a fitted clock offset ({offset} s), which holds what is constant of a delay",
}


def _lateness_text(event: str, seconds: float) -> str:
    """``begins 4.5 ms late``."""
    if round(1e4 * seconds) == 0:
        return f"{event} on time"
    return f"{event} {words.decimal(1e3 * abs(seconds), 1)} ms {'late' if seconds > 0 else 'early'}"


def noise_lines(result: RunResult) -> list[str]:
    """Return lines about the contacts that hold in spite of noise, where noise was requested."""
    noise = result.noise
    if noise is None:
        return []
    holding_count, contact_count = noise.count(HOLDS), len(noise.labels)
    labels_text = (
        f"{holding_count} of {contact_count} contacts hold, {noise.count(UNDECIDABLE)} undecidable, "
        f"{noise.count(ABSENT)} absent"
    )
    lines = [f"In {noise.copies} copies with tracker noise: {labels_text if contact_count else 'no contact to judge'}."]
    for label in result.comparisons if holding_count else ():
        noise_proof = result.document.audit[label].noise_proof
        if noise_proof is not None:
            lines.append(f"Contacts that hold and that {label} missed: {noise_proof.contacts_missed}.")
    if noise.near:
        near_passes_text = plural(len(noise.near), "near pass", "near passes")
        lines.append(f"A contact within the noise may be hidden in {near_passes_text}.")
    if noise.resting:
        pairs = plural(len({span.pair for span in noise.resting}), "pair")
        lines.append(f"Noise leaves open whether the bodies of {pairs} at rest touch.")
    return [*lines, NOISE_LIMITS_SENTENCE]


def compound_lines(result: RunResult) -> list[str]:
    """A line per detector that cut meshes into convex pieces: how many there may be, and how many there are."""
    lines = []
    for label, detector in result.detectors.items():
        if getattr(detector.settings, "shape", "") == "compound" and hasattr(detector, "parts"):
            counts = [len(solids) for solids in detector.parts.values()]
            pieces_text = "1 piece" if max(counts) == 1 else f"{min(counts)} to {max(counts)} pieces"
            requested_pieces_clause = f"{label} was limited to {detector.settings.pieces} convex pieces of a mesh"
            lines.append(f"{requested_pieces_clause}: it made {pieces_text} of each, {sum(counts)} in all.")
    return lines


def answer_reasons(result: Summarised) -> list[Reason]:
    """Return the headings below the first sentence of a run: its main fault, what to do, how sure; then all else.

    What, when and why are about the same fault; faults of the other category stand below, under *Also*.
    """
    first_answer, decision_to_ship = result.answers[0], shipping_decision(result.document, result.ranking)
    in_code = None if decision_to_ship is None else decision_to_ship.in_code
    what, when, why = (
        (first_answer.what, first_answer.when, first_answer.why) if first_answer.why else _nothing_wrong(result)
    )
    fixed = decision_to_ship.rank if decision_to_ship is not None and decision_to_ship.is_fix else None
    certainty_sentence, *certainty_details = [
        *_doubts_pointer(result.document),
        *certainty(result.document, result.ranking, fixed),
    ]
    reasons = [
        Reason("What", what),
        Reason("When", when, first_answer.other_times),
        Reason("Why", why),
        *([] if decision_to_ship is None else [_decision_reason("Do", decision_to_ship)]),
        price_reason(result, decision_to_ship),
        Reason("Sure", certainty_sentence, " ".join(certainty_details)),
        _other_faults(result),
        *_improvement_reasons(result, decision_to_ship),
        *([] if in_code is None else [_decision_reason("Or", in_code, is_folded=True)]),
    ]
    return [row for row in reasons if row.text]


def _decision_reason(heading: str, decision_to_ship: Decision, *, is_folded: bool = False) -> Reason:
    """A decision below its heading; ``is_folded``: all but its sentence is left to the details."""
    if not is_folded:
        return Reason(
            heading, decision_to_ship.text, decision_to_ship.figures, decision_to_ship.command, decision_to_ship.details
        )
    details = " ".join(filter(None, [decision_to_ship.details, decision_to_ship.figures, decision_to_ship.command]))
    return Reason(heading, decision_to_ship.text, details=details)


def _improvement_reasons(result: Summarised, decision_to_ship: Decision | None) -> list[Reason]:
    """The Fix of the worst detector, where another detector is the decision; else nothing."""
    worst_answer = result.answers[0]
    if worst_answer.fix is None or decision_to_ship is None or decision_to_ship.is_fix:
        return []
    # A Fix that is the reference is the decision already, or too slow.
    named_labels = [result.oracle, *([decision_to_ship.rank.label] if decision_to_ship.rank is not None else [])]
    if worst_answer.fix.detector in named_labels:
        return []
    fix = worst_answer.fix
    improvement_text = f"To improve {worst_answer.label} itself: {fix.text[:1].lower()}{fix.text[1:]}"
    return [Reason("Or", improvement_text, fix_figures(fix.change, fix.command), fix.command, fix.notes)]


def _doubts_pointer(document: RunDocument) -> list[str]:
    """Sentence that sends the reader to the doubts below the answer, where there are any."""
    count = len(doubts(document))
    if not count:
        return []
    return [
        f"Not before {plural(count, 'doubt')} about the recording {'is' if count == 1 else 'are'} settled: see below."
    ]


def _nothing_wrong(result: Summarised) -> tuple[str, str, str]:
    """Return what, when and why of a run in which every detector is right; empty where nothing was compared."""
    worst, session = result.ranking[0], result.document.session
    if worst.loss or not any_decided(result.document):
        return "", "", ""
    contacts = plural(worst.contacts, "contact")
    what = f"{worst.label} reports {contacts}, as {result.oracle} does, and no false one."
    if not worst.contacts:
        what = f"{worst.label} reports no contact, and {result.oracle} finds none."
    when = f"In the whole time that was replayed: {words.duration(session.duration)}, {session.frames:,} frames."
    why = f"Its answers differ from those of {result.oracle}, the reference, in no frame that counts."
    return what, when, why


def _other_faults(result: Summarised) -> Reason:
    """The faults of the worst detector that the first sentence leaves out, and why; without a text: there are none."""
    lesser = lesser_faults(result.ranking[0]) if len(result.ranking) > 2 else ""
    texts = [*filter(None, [lesser, result.answers[0].other_causes])]
    return Reason("Also", *texts) if texts else Reason("Also", "")


def price_reason(result: Summarised, decision_to_ship: Decision | None) -> Reason:
    """Return what the decision costs: time a frame beside that of the worst detector.

    Where nothing was decided it is the time of the reference; without a text where nothing was audited.
    """
    if not result.ranking:
        return Reason("Cost", "")
    document, worst = result.document, result.ranking[0]
    rank = result.ranking[-1] if decision_to_ship is None or decision_to_ship.rank is None else decision_to_ship.rank
    if rank.mean is None:
        return Reason("Cost", f"The time of {rank.label} was not measured.", busy_text(document))
    detectors = document.detectors
    live = rank.label not in detectors or detectors[rank.label].live
    comparison_clause = ""
    if worst.mean is not None and worst.label != rank.label and live == detectors[worst.label].live:
        comparison_clause = f"; {worst.label} {words.frame_time(worst.mean)}"
    busy = busy_text(document)
    # By the clock the slowest frames of a busy machine are those in which other programs ran.
    p99_clause = "" if busy or rank.p99 is None else f", 99 % within {words.frame_time(rank.p99)}"
    subject = f"The {rank.label}" if decision_to_ship is not None and decision_to_ship.is_fix else rank.label
    price_sentence = f"{subject} takes {words.frame_time(rank.mean)} a frame{p99_clause}{comparison_clause}."
    reason = BATCH_TIMING_SENTENCE if not live else NO_SLOWEST_SENTENCE if rank.p99 is None else ""
    budget = f"{subject} takes {words.as_percentage(rank.of_frame)} of {FRAME_TEXT} on average."
    return Reason("Cost", price_sentence, " ".join(filter(None, [budget, reason, TIMES_SENTENCE, busy])))
