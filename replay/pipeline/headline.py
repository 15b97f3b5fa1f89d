"""Sentences about what a detector missed and how long it took, the same in terminal, picture and report."""

from collections.abc import Mapping
from typing import Any, Final

from replay.base.constants import BUDGET_MS, HEADSET_HZ
from replay.comparison.contact_counts import ContactCounts, contact_counts, held_counts
from replay.comparison.noisy_contacts import ABSENT, HOLDS, UNDECIDABLE
from replay.comparison.outcome import Outcome
from replay.detection.recorded import RECORDED
from replay.pipeline.gates import figure
from replay.pipeline.ranking import all_unconfirmed, false_words, fault_words, ranking
from replay.pipeline.run_result import RunResult, Summarised
from replay.pipeline.scores import undecided_share
from sessions import Finding, Severity
from sessions.doctor.finding import CODES

NOT_COVERED: Final = (
    "Not in these copies: a constant offset of a tracker, a wrong mesh, noise that the recording already has."
)


def headlines(result: RunResult) -> list[str]:
    """What a title says of a run: the worst detector's faults, the larger first; of a single one, all its contacts.

    Lost poses that hide every contact come first of all; how many contacts they cut comes last.
    """
    worst = next(iter(ranking(result.summary)), None)
    if worst is None:
        return []
    several = len(result.comparisons) > 1 or worst.leads_false
    words = f"{worst.label}: {fault_words(worst)}" if several else headline(result, worst.label)
    return [all_lost(result.summary) + words + cut_words(result.summary["audit"][worst.label])]


def all_lost(summary: Mapping[str, Any]) -> str:
    """Where the oracle finds no contact and poses are lost: in how many pair-frames nobody can tell."""
    verdicts = summary["detectors"][summary["oracle"]].get("verdicts", {})
    lost, every = verdicts.get("NO_POSE", 0), sum(verdicts.values())
    if not lost or any(one["contacts"] for one in summary["audit"].values()):
        return ""
    return f"Poses are lost in {lost:,} of {every:,} pair-frames, where a contact may be. "


def cut_words(audit: Mapping[str, Any]) -> str:
    """How many contacts of the oracle lost poses cut, as the end of a sentence."""
    cut, contacts = audit.get("contacts_cut", 0), audit["contacts"]
    return f"; lost poses cut {cut} of {contacts} contact{'' if contacts == 1 else 's'}" if cut else ""


def headline(result: RunResult, label: str) -> str:
    """Contacts of the oracle that the subject did not decide, then those it missed; fit for a title."""
    counts = contact_counts(result, label)
    if not counts.contacts:
        outcome = result.comparisons[label].outcome
        if (outcome == Outcome.LEFT_OUT).all():
            return f"Nothing compared: {result.oracle} and {label} both decided none of {outcome.size:,} pair-frames"
        return f"No contact found by {result.oracle}, so none for {label} to miss"
    if label not in result.phases:
        return contact_words(counts, label)
    rate = result.summary["detectors"][label]["settings"]["rate_hz"]
    mean = result.phases[label].spreads()["contacts_missed"]["mean"]
    words = contact_words(counts, f"Looking {rate:g} times a second", " here")
    return f"{words}; {mean:.1f} on average over look phases"


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


def contact_words(counts: ContactCounts, who: str = "", here: str = "") -> str:
    """What became of the oracle's contacts, of which there is one at least; the undecided come first."""
    things = f"{counts.contacts} contact" + "s" * (counts.contacts != 1)
    undecided = _some(counts.undecided, counts.undecided_in_part, things, " undecided")
    missed = _some(counts.missed, counts.in_part, things, here)
    if undecided:
        rest = "" if counts.undecided == counts.contacts else f"; missed {missed or 'none where it decided'}"
        return f"{who} left {undecided}{rest}".lstrip()
    if not missed and counts.contacts == 1:
        return f"{who} found the one contact" if who else "the one contact was found"
    return f"{who} missed {missed or f'none of {things}{here}'}".lstrip()


def _some(whole: int, part: int, things: str, more: str) -> str:
    """``2 of 5 contacts and part of 1 more``; nothing where there are none."""
    if not whole:
        return f"part of {part} of {things}{more}" if part else ""
    return f"{whole} of {things}{more}" + (f" and part of {part} more" if part else "")


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

    Where the headline says it, of several detectors or of the larger fault, there is none.
    """
    ranks = ranking(result.summary)
    if len(result.comparisons) != 1 or ranks[0].leads_false:
        return []
    audit = result.summary["audit"][ranks[0].label]
    words = false_words(audit["invented"], all_unconfirmed(audit))
    return [f"{words}."] if words else []


def held(result: RunResult) -> list[str]:
    """A line per detector of what it says of a hand and what it holds: that is counted apart from all else."""
    lines = []
    for label in result.comparisons:
        apart = held_counts(result, label)
        contacts, frames = apart["contacts"], apart["invented"]
        said = [f"misses {apart['contacts_missed']} of {contacts} contact" + "s" * (contacts != 1)] * bool(contacts)
        if frames:
            word = "unconfirmed" if all_unconfirmed(result.summary["audit"][label]) else "false"
            said.append(f"reports {frames:,} {word} frame{'' if frames == 1 else 's'}")
        if said:
            words = " and ".join(said)
            lines.append(f"Counted apart, of a hand with what it holds, {label} {words}.")
    return lines


def beside(result: RunResult) -> list[str]:
    """What a reader must know beside the headlines: what was not decided, what is invented, what is chance."""
    return [
        *undecided(result), *invented(result), *held(result), *in_noise(result), *compounds(result)
    ]  # fmt: skip


def in_noise(result: RunResult) -> list[str]:
    """What noise leaves of the contacts, where that was asked for."""
    noise = result.noise
    if noise is None:
        return []
    firm, total = noise.count(HOLDS), len(noise.words)
    words = f"{firm} of {total} contacts hold, {noise.count(UNDECIDABLE)} undecidable, {noise.count(ABSENT)} absent"
    lines = [f"In {noise.copies} copies with tracker noise: {words if total else 'no contact to ask about'}."]
    for label in result.comparisons if firm else ():
        holds = result.summary["audit"][label]["holds"]
        lines.append(f"Of those that hold, {label} missed {holds['contacts_missed']}.")
    if noise.near:
        passes = f"{len(noise.near)} near pass{'es' * (len(noise.near) > 1)}"
        lines.append(f"A contact within the noise may be hidden in {passes}.")
    if noise.resting:
        count = len({one.pair for one in noise.resting})
        lines.append(f"Of {count} pair{'s' * (count > 1)} at rest the noise leaves open whether they touch.")
    return [*lines, NOT_COVERED]


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


def price(result: Summarised) -> list[str]:
    """A line with what being right costs; no line where nothing is audited.

    Like with like where the run measured it: the worst detector's own algorithm at every frame, or an oracle that was
    asked live as it was. Else what each time is of is said, and who measures alike.
    """
    if not result.summary["audit"]:
        return []
    figures, trusted, ranks = result.summary["detectors"], result.oracle, ranking(result.summary)
    worst = ranks[0].label
    seconds = {label: figures[label]["seconds"] for label in (trusted, worst)}
    took = f"{1e3 * seconds[worst]['per_frame_mean']:.2g} ms"
    often = seconds[worst].get("at_every_frame")
    if often is not None and not ranks[0].leads_false:
        rarely = _how_often(figures[worst], result.summary["session"]["frames"])
        if often <= seconds[worst]["per_frame_mean"]:
            # Fewer samples cannot cost more: what differs is the machine from one run to the next.
            saved = f"what a sample {rarely} saves is {TOO_SMALL}"
            return [f"The same algorithm at every frame costs {_of_frame(often)}; {saved} (live)."]
        return [f"The same algorithm at every frame costs {_of_frame(often)}, {rarely} {took} (like with like, live)."]
    kinds = {label: _kind(figures[label]) for label in (trusted, worst)}
    right = f"Being right costs {_of_frame(seconds[trusted]['per_frame_mean'])} with {trusted}"
    if figures[worst]["name"] == RECORDED:
        return [f"{right} ({kinds[trusted]}); what {worst} took is not recorded."]
    if len(set(kinds.values())) == 1:
        return [f"{right}; {worst} takes {took} (like with like, {kinds[worst]})."]
    return [f"{right} ({kinds[trusted]}); {worst} took {took} ({kinds[worst]}). `replay tradeoff` compares alike."]


def _of_frame(seconds: float) -> str:
    """``0.08 ms (0.7 % of a 90 Hz frame)``."""
    return f"{1e3 * seconds:.2g} ms ({figure(1e5 * seconds / BUDGET_MS)} % of a {HEADSET_HZ:g} Hz frame)"


TOO_SMALL: Final = "too small to compare here"
"""Stands for a ratio of times that contradicts the number of samples."""

ORDINALS: Final = ("second", "third", "fourth", "fifth", "sixth", "seventh", "eighth")


def _how_often(figures: Mapping[str, Any], frames: int) -> str:
    """``every fourth frame``, or the rate where its looks do not fall so."""
    looks = figures["seconds"].get("per_frame", {}).get("looks", 0)
    every = frames / looks if looks else 0.0
    if 1.5 < every < len(ORDINALS) + 1.5 and abs(every - round(every)) < 0.05:
        return f"every {ORDINALS[round(every) - 2]} frame"
    return f"{figures['settings']['rate_hz']:g} times a second"


def _kind(figures: Mapping[str, Any]) -> str:
    """What a time is of; only times of one kind can be compared."""
    way = "live" if figures["live"] else "offline"
    return f"{way}{', with faces' if figures['faces_asked'] else ''}"
