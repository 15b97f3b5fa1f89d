"""Sentences about what a detector missed and how long it took, the same in terminal, picture and report."""

from collections.abc import Mapping
from typing import Any

from replay.comparison.contact_counts import ContactCounts, contact_counts, held_counts
from replay.comparison.contact_duration import PHASES
from replay.comparison.outcome import Outcome
from replay.detection.recorded import RECORDED
from replay.pipeline.gates import figure
from replay.pipeline.ranking import fault_words, ranking
from replay.pipeline.run_result import RunResult
from replay.pipeline.scores import undecided_share
from sessions import Finding, Severity
from sessions.doctor.codes import CODES


def headlines(result: RunResult) -> list[str]:
    """What a title says of a run: of several detectors the worst one's faults, the larger first, else the contacts."""
    if len(result.comparisons) > 1:
        worst = ranking(result.summary)[0]
        return [f"{worst.label}: {fault_words(worst)}"]
    return [headline(result, label) for label in result.comparisons]


def headline(result: RunResult, label: str) -> str:
    """Contacts of the oracle that the subject did not decide, then those it missed; fit for a title."""
    counts = contact_counts(result, label)
    if counts.contacts:
        return contact_words(counts, f" by {label}")
    outcome = result.comparisons[label].outcome
    if (outcome == Outcome.LEFT_OUT).all():
        return f"Nothing compared: {result.oracle} and {label} both decided none of {outcome.size:,} pair-frames"
    return f"No contact found by {result.oracle}, so none for {label} to miss"


def doubts(result: RunResult) -> list[str]:
    """What a reader must know before the answer: each kind of error, and each finding of unit, axes or handedness.

    With positions in millimetres nothing meets, and "none missed" would be true and worth nothing.
    """
    grouped: dict[tuple[Severity, str], list[Finding]] = {}
    for one in () if result.treatment is None else result.treatment.findings:
        if one.severity == Severity.ERROR or CODES[one.code].group == "scale" or one.code == "mesh-units":
            grouped.setdefault((one.severity, one.code), []).append(one)
    lines = []
    for (severity, code), (one, *more) in grouped.items():
        where = f"{one.body}: {one.message}" if one.body else one.message
        rest = f"; {len(more)} more like it" if more else ""
        lines.append(f"{severity.name.capitalize()}, {code}: {one.meaning} ({where}{rest}). To do: {one.fix}.")
    return lines


def contact_words(counts: ContactCounts, by: str = "") -> str:
    """What became of the oracle's contacts, of which there is one at least; the undecided come first."""
    things = f"{counts.contacts} contact" + "s" * (counts.contacts != 1)
    undecided = _some(counts.undecided, counts.undecided_in_part, f"{things} undecided", by)
    missed = _some(counts.missed, counts.in_part, f"{things} missed", by)
    if not undecided:
        return missed or f"None of {things} missed{by}"
    if counts.undecided == counts.contacts:
        return undecided
    return f"{undecided}; {missed or 'none missed where it decided'}"


def _some(whole: int, part: int, what: str, by: str) -> str:
    """``2 of 5 contacts missed by slow, 1 more in part``; nothing where there are none."""
    if not whole:
        return f"{part} of {what} in part{by}" if part else ""
    return f"{whole} of {what}{by}" + (f", {part} more in part" if part else "")


def undecided(result: RunResult) -> list[str]:
    """A line per detector that was not compared in every pair-frame that has a pose."""
    lines = []
    for label in result.comparisons:
        part = undecided_share(result, label)
        if part["count"]:
            what = f"{part['count']:,} of {part['of']:,} pair-frames with a pose"
            lines.append(f"{what} are undecided by {result.oracle} or {label}: nothing is known of them.")
    return lines


def invented(result: RunResult) -> list[str]:
    """A line for a detector that reports contact where there is none: one that misses nothing may invent everything.

    Of several detectors the ranking says it.
    """
    lines: list[str] = []
    if len(result.comparisons) > 1:
        return lines
    for label, comparison in result.comparisons.items():
        wrong, right = comparison.count(Outcome.INVENTED), comparison.count(Outcome.BOTH)
        if wrong:
            share = figure(100 * wrong / (wrong + right))
            lines.append(f"{label} invents {share} % of the contact that it reports, counted in pair-frames.")
    return lines


def held(result: RunResult) -> list[str]:
    """A line per detector of what it says of a hand and what it holds: that is counted apart from all else."""
    lines = []
    for label in result.comparisons:
        apart = held_counts(result, label)
        missed = f"misses {apart['contacts_missed']} of {apart['contacts']} contacts" if apart["contacts"] else ""
        false = f"reports {apart['invented']:,} pair-frames of false contact" if apart["invented"] else ""
        if missed or false:
            words = " and ".join(one for one in (missed, false) if one)
            lines.append(f"Counted apart, of a hand with what it holds, {label} {words}.")
    return lines


def phases(result: RunResult) -> list[str]:
    """A line per audited detector of a fixed rate: where its looks fall is chance, and other phases miss others."""
    lines = []
    for label, shares in result.phases.items():
        rate, mean = result.summary["detectors"][label]["settings"]["rate_hz"], shares["contacts_missed"]
        counts = contact_counts(result, label)
        if counts.contacts:
            lines.append(
                f"{label} looks {rate:g} times a second. At this run's phase it misses {counts.missed} of "
                f"{counts.contacts} contacts, {mean['share'] * counts.contacts:.2f} in the mean over {PHASES} phases."
            )
    return lines


def beside(result: RunResult) -> list[str]:
    """What a reader must know beside the headlines: what was not decided, what is invented, what is chance."""
    return [*undecided(result), *invented(result), *held(result), *compounds(result), *phases(result)]


def compounds(result: RunResult) -> list[str]:
    """A line per detector that cut meshes into convex pieces: how many there may be, and how many there are."""
    lines = []
    for label, detector in result.detectors.items():
        if getattr(detector.settings, "shape", "") == "compound" and hasattr(detector, "parts"):
            counts = [len(solids) for solids in detector.parts.values()]
            each = "1 piece" if max(counts) == 1 else f"{min(counts)} to {max(counts)} pieces"
            asked = f"{label} was asked for at most {detector.settings.pieces} convex pieces of a mesh"
            lines.append(f"{asked}: it made {each} of each, {sum(counts)} in all.")
    return lines


def price(result: RunResult) -> list[str]:
    """A line with the time of the oracle and of each audited detector; no line where none is audited.

    A run takes one pass of each, and the oracle alone lists faces: the line says so, and who measures like with like.
    """
    if not result.comparisons:
        return []
    figures, trusted = result.summary["detectors"], result.oracle
    labels = [trusted, *(label for label in result.comparisons if figures[label]["name"] != RECORDED)]
    kinds = {label: _kind(figures[label]) for label in labels}
    took = {label: f"{1e3 * figures[label]['seconds']['per_frame_mean']:.3g} ms" for label in labels}
    did = "Every contact counted here was found by" if result.episodes[trusted] else "No contact was found by"
    parts = [f"{did} {trusted} in {took[trusted]} a frame ({kinds[trusted]})"]
    parts += [f"{label} took {took[label]} ({kinds[label]})" for label in labels[1:]]
    alike = "" if len(set(kinds.values())) == 1 else ", not alike"
    passes = f"One pass of each{alike}: replay tradeoff compares like with like" if len(labels) > 1 else "One pass"
    return [f"{'; '.join(parts)}. {passes}."]


def _kind(figures: Mapping[str, Any]) -> str:
    """What a time is of; only times of one kind can be compared."""
    way = "frame by frame" if figures["live"] else "whole recording at once"
    return f"{way}, {'with' if figures['faces_asked'] else 'without'} faces"
