"""The tables of a run, each built once; a renderer takes the columns for which it has room."""

from collections.abc import Mapping, Sequence
from typing import Any

from cdcore.protocol import DECIDED
from replay.base.constants import BUDGET_MS, HEADSET_HZ
from replay.base.wilson import OVER_CONTACTS
from replay.comparison.contact_counts import cut_contacts
from replay.comparison.false_contacts import VOLUMES
from replay.comparison.look_phases import PHASES
from replay.comparison.misses import NEVER_FOUND
from replay.effects.recorded import CURVES
from replay.outputs.columns import RawTable
from replay.outputs.tables import FAINT, FOUND, IN_RED, INVENTED, PARTLY, Cell, Marked, Table, table
from replay.outputs.words import (
    FRAME_ROWS,
    OUTCOME_WORDS,
    WITHIN,
    counted,
    span_words,
    tallied,
)  # fmt: skip
from replay.pipeline.answer import busy_words, milliseconds
from replay.pipeline.gates import figure, percent
from replay.pipeline.ranking import Range, Rank, all_unconfirmed, range_words
from replay.pipeline.run_result import RunResult, Summarised
from sessions import Finding

OF_FRAME = f"of a {HEADSET_HZ:g} Hz frame"
LATE_OR_SHORT = "late or cut short"
FALSE_CONTACT = "false contact"
RANK_HEAD = (
    "detector", "what", "missed", LATE_OR_SHORT, "undecided", FALSE_CONTACT, "mean ms", "p99 ms", OF_FRAME, "settings",
)  # fmt: skip
REFERENCE = "reference"
NOT_APPLICABLE = "-"

UNCONFIRMED = "unconfirmed frames"
"""Stands for *false frames* of a detector that only calls them candidates."""

AUDIT_MARKS = {
    "missed": IN_RED, LATE_OR_SHORT: PARTLY, "frames found": FOUND, "frames missed": PARTLY, "false frames": INVENTED,
    UNCONFIRMED: INVENTED,
    WITHIN: FAINT,
}  # fmt: skip

CUT = "cut by lost poses"
"""Column of contacts, there only where lost poses cut one."""

MOST_REASONS = 4
"""Reasons listed why containment was refused; each open body makes one of its own."""


def ranking_table(result: Summarised, *, intervals: bool = False) -> Table:
    """Every detector of a run, the one with the largest fault first, and the reference last.

    Counts are smallest to largest over the sampling offsets; ``intervals``: beside each share its own.
    """
    ranks = result.ranking
    rows = [
        (
            rank.label,
            rank.what,
            REFERENCE if rank.missed_counts is None else _count(rank.missed_counts, IN_RED),
            NOT_APPLICABLE if rank.late_counts is None else _count(rank.late_counts, PARTLY),
            NOT_APPLICABLE if rank.missed_counts is None else rank.undecided,
            _false_share(rank, intervals),
            NOT_APPLICABLE if rank.mean is None else milliseconds(rank.mean),
            NOT_APPLICABLE if rank.p99 is None else milliseconds(rank.p99),
            NOT_APPLICABLE if rank.of_frame is None else f"{figure(100 * rank.of_frame)} %",
            rank.setting,
        )
        for rank in ranks
    ]
    contacts = ranks[-1].contacts if ranks else 0
    title = f"{happened(contacts) if ranks else ''} What each detector made of {'it' if contacts == 1 else 'them'}:"
    busy = busy_words(result.summary)
    notes = [OVER_CONTACTS] if intervals else []
    made = table(
        title, RANK_HEAD, rows, words=("detector", "what", "settings"), whole=("detector", "what"),
        notes=[*notes, busy] if busy else notes,
    )  # fmt: skip
    some = any(rank.undecided for rank in ranks)
    return made.only(*(name for name in RANK_HEAD if some or name != "undecided"))


def happened(contacts: int) -> str:
    """How many contacts the reference found, as a sentence."""
    return f"{counted(contacts, 'contact')} happened." if contacts else "No contact happened."


def sampling_notes(result: Summarised) -> list[str]:
    """Over what the counts of detectors of a fixed rate range, and at which offset their moments are."""
    labels = [rank.label for rank in result.ranking if rank.phases > 1]
    if not labels:
        return []
    who = ", ".join(labels)
    return [f"Counts of {who}: over {PHASES} sampling offsets; moments are those of the offset of this run."]


def _count(counts: Range, mark: str) -> Cell:
    return Marked(range_words(counts), mark if counts[1] else "")


def _false_share(rank: Rank, intervals: bool) -> Cell:
    if rank.false is None:
        return NOT_APPLICABLE
    if rank.false["share"] is None:
        return "0 %"
    word = " unconfirmed" if rank.unconfirmed else ""
    plain = f"{figure(100 * rank.false['share'])} %{word}"
    words = percent(rank.false, word.strip()) if intervals else plain
    return Marked(words, INVENTED if rank.false["count"] else "")


def pair_frame_table(title: str, audit: Mapping[str, Any]) -> Table:
    """Pair-frames of every audited detector, a column each, from the figures of ``summary.json``."""
    figures = list(audit.values())
    rows: list[tuple[Cell, ...]] = [
        (OUTCOME_WORDS[one].lower(), *(each["pair_frames"][one.name] for each in figures)) for one in FRAME_ROWS
    ]
    rows.append(("missed, of those in contact", *(percent(each["missed"]) for each in figures)))
    rows.append(("between frames", *(each["between_frames"] for each in figures)))
    return table(title, ("", *audit), rows, notes=(OVER_CONTACTS,))


def pair_table(result: Summarised, label: str) -> Table:
    """What an audited detector made of every pair that touched or was said to; the most missed first, as in the lanes.

    Pairs of a hand and what it holds come last. Only where anything is within tolerance there is a column for it.
    """
    rows, apart = list[tuple[Any, ...]](), list[tuple[Any, ...]]()
    for one in result.summary["pairs"]:
        own = one.get("audit", {}).get(label)
        if own is None:
            continue
        frames = [own["pair_frames"][word] for word in ("BOTH", "MISSED", "INVENTED", "WITHIN_TOLERANCE")]
        lengths, cut = _lengths(one, "contacts", result.oracle), _cut(one, "contacts", result.oracle)
        if lengths[0] or any(frames[2:]):
            rows.append((one["name"], *lengths, own["contacts_missed"], own["contacts_in_part"], *frames, cut))
        if held := own.get("held"):
            counts = (held[word] for word in ("contacts_missed", "contacts_in_part", "both", "missed", "invented"))
            cut = _cut(one, "held_contacts", result.oracle)
            apart.append((f"{one['name']} (held)", *_lengths(one, "held_contacts", result.oracle), *counts, 0, cut))
    rows.sort(key=lambda row: (-row[-4], -row[-3]))
    other = "false frames" if all_unconfirmed(result.summary["audit"][label]) else UNCONFIRMED
    head = ("pair", "contacts", "seconds", "longest s", *(name for name in AUDIT_MARKS if name != other), CUT)
    title, notes = f"Contacts ({result.oracle}) and what {label} made of them", containment_notes(result, result.oracle)
    made = table(title, head, rows + apart, marks=AUDIT_MARKS, notes=notes)
    empty = {name for k, name in enumerate(head) if name in (WITHIN, CUT) and not any(row[k] for row in rows + apart)}
    return made.only(*(name for name in head if name not in empty))


def _lengths(pair: Mapping[str, Any], kind: str, label: str) -> tuple[int, str, str]:
    own = pair.get(kind, {}).get(label, {"count": 0, "seconds": 0.0, "longest": 0.0})
    return own["count"], f"{own['seconds']:.3f}", f"{own['longest']:.3f}"


def _cut(pair: Mapping[str, Any], kind: str, label: str) -> int:
    return int(pair.get(kind, {}).get(label, {}).get("cut", 0))


def contact_table(result: RunResult, label: str) -> Table:
    """Contacts that a detector found, a row per pair."""
    rows, found = [], result.episodes[label]
    for pair in sorted({one.pair for one in found}):
        own = [one for one in found if one.pair == pair]
        lengths = [one.end - one.start for one in own]
        name = result.assembly.pair_name(pair) + " (held)" * bool(result.assembly.held[pair])
        rows.append((name, len(own), f"{sum(lengths):.3f}", f"{max(lengths):.3f}", cut_contacts(own)))
    head, notes = ("pair", "contacts", "seconds", "longest s", CUT), containment_notes(result, label)
    made = table(f"Contacts found by {label}", head, rows, notes=notes)
    return made if cut_contacts(found) else made.only(*head[:-1])


def containment_notes(result: Summarised, label: str) -> list[str]:
    """A line where this detector did not decide of every pair if one body is inside the other."""
    words = [pair.get("containment", {}).get(label, DECIDED) for pair in result.summary["pairs"]]
    refused = [word for word in words if word != DECIDED]
    why = [word.removeprefix("refused: ") for word in dict.fromkeys(refused)]
    more = f"; {len(why) - MOST_REASONS} more in summary.json" * (len(why) > MOST_REASONS)
    of = f"{len(refused)} of {counted(len(words), 'pair')}"
    return [f"{label}: containment refused for {of}: {'; '.join(why[:MOST_REASONS])}{more}"] if refused else []


def miss_table(misses: RawTable, label: str) -> Table:
    """The misses of a detector, those that were never found first."""
    own = misses.where(detector=label).by(lambda row: row["kind"] != NEVER_FOUND)
    rows = own.plain()
    words: dict[str, list[Cell]] = {"at s": [_moment(row) for row in rows], "pair": [_pair(row) for row in rows]}
    noise = ("noise",) if any(row["noise"] for row in rows) else ()
    heads = ("number", "at s", "pair", "frames", "kind", "cause", *noise)
    return own.shown(f"missed by {label}", *heads, words=words).headed({"number": "miss"})


def false_table(false: RawTable, label: str) -> Table:
    """The false contacts of a detector, the longest first."""
    own = false.where(detector=label).by(lambda row: -row["frames"])
    rows = own.plain()
    thing = "unconfirmed contact" if all(row["cause"] == VOLUMES for row in rows) else "false contact"
    words: dict[str, list[Cell]] = {"pair": [_pair(row) for row in rows]}
    heads = ("number", "start", "pair", "frames", "gap", "cause")
    return own.shown(f"{thing}s of {label}", *heads, words=words).headed({"number": "false"})


def _pair(row: Mapping[str, Any]) -> str:
    return f"{row['body_a']} - {row['body_b']}"


def _moment(row: Mapping[str, Any]) -> Cell:
    """When a miss begins; a first touch between frames says how far it is uncertain, if by more than a microsecond."""
    moment = row["start"] if row["touch"] is None else row["touch"]
    unsure = 0.0 if row["touch"] is None else row["touch"] - row["touch_free"]
    below = f"within {1e6 * unsure:.2g} microseconds" if unsure > 1e-6 else ""
    return Marked(f"{moment:.3f}", "", below) if below else f"{moment:.3f}"


def cost_table(result: Summarised) -> Table:
    """What each detector took; mean, quantiles and the share over budget are over all frames."""
    rows, notes = [], list[str]()
    for label, figures in result.summary["detectors"].items():
        seconds = figures["seconds"]
        frame, longest = seconds.get("per_frame"), seconds["longest_stage"]
        role = "reference" if label == result.oracle else "live" if figures["live"] else "offline"
        if label in result.summary["audit"] and not figures["online"]:
            notes.append(f"{label} cannot be asked live")
        share = f"{longest['stage']} {100 * longest['share']:.0f} %" if longest else ""
        each = [_ms(frame[key]) if frame else "" for key in QUANTILES]
        late = f"{figure(100 * frame['over_budget'])} %" if frame else ""
        rows.append((label, role, f"{seconds['detect']:.3f}", _ms(seconds["per_frame_mean"]), *each, late, share))
    head = ("detector", "how", "whole s", "mean ms", *QUANTILES.values(), LATE, "longest stage")
    if busy := busy_words(result.summary):
        notes.append(busy)
    words = ("detector", "how", "longest stage")
    return table("Time of each detector", head, rows, words=words, whole=words, notes=notes)


QUANTILES = {"median": "median ms", "p95": "95 % ms", "p99": "99 % ms", "max": "worst ms"}
LATE = f"over {BUDGET_MS:.1f} ms"
"""Column of the frames that took longer than one at 90 Hz."""


def _ms(seconds: float) -> str:
    """Milliseconds with three digits at least: the quickest detectors take less than a microsecond a frame."""
    return f"{1e3 * seconds:.3f}" if seconds >= 1e-3 else f"{1e3 * seconds:.3g}"


def effect_table(result: Summarised) -> Table:
    """What each effect of the plan found, why it ran, what it cost, and how much of the session its trigger skipped."""
    rows = []
    for kind, figures in result.summary["effects"].items():
        curves = figures["counters"].get(CURVES, 0)
        found = tallied(figures["events"]) or (counted(curves, "curve") if curves else "nothing")
        work = ", ".join(f"{name} {count:,}" for name, count in figures["counters"].items())
        skipped = 1.0 - figures["frames_run"] / max(1, figures["frames"])
        shares = (f"{1e3 * figures['seconds']:.1f}", f"{100 * figures['share']:.1f}", f"{100 * skipped:.1f}")
        rows.append((kind, "; ".join(figures["because"]), found, figures["trigger"] or "always", work, *shares))
    head = ("effect", "because", "found", "runs only in", "work", "ms", "% of the run", "% skipped")
    return table("Effects", head, rows, words=5)


def finding_table(findings: Sequence[Finding], title: str = "Findings", *, marks: Sequence[str] = ()) -> Table:
    """What is wrong with a recording, in the order given; ``marks`` of a severity: note, warning, error.

    What a code means and what to do stands below its first row only: with nine losses of tracking it would be most of
    the table.
    """
    rows, said = [], set[str]()
    for one in findings:
        below = "" if one.code in said else f"{one.meaning}; {one.fix}"
        said.add(one.code)
        severity = Marked(one.severity.name.lower(), marks[one.severity] if marks else "")
        when = span_words(one.start, one.end)
        rows.append((severity, one.code, one.body, Marked(one.message, "", below), when, one.count))
    head = ("severity", "code", "body", "what", "seconds", "count")
    return table(title, head, rows, words=4, whole=("severity", "code", "body", "seconds"))
