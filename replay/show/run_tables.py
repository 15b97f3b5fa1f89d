"""The tables of a run, each built once; a renderer takes the columns for which it has room."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Final

from msgspec.structs import asdict

from cdcore.protocol import DECIDED, REFUSED
from replay import words
from replay.auditing.fault import Cause, worst_first
from replay.auditing.sampling_offsets import PHASES
from replay.auditing.wilson import OVER_CONTACTS, Proportion
from replay.document.audit import ContactPairFrames, DetectorAudit
from replay.document.cost import BUDGET_MS, busy_text
from replay.document.detector import LongestStage
from replay.document.gates import percent
from replay.document.ranking import Range, all_unconfirmed, with_fixes
from replay.document.run_document import ContactLengths
from replay.document.run_result import Summarised
from replay.document.session import EffectRecord
from replay.document.tables import IN_RED, IN_YELLOW, PARTLY, Cell, Column, Marked, Table, columns_of, table
from replay.effects.effects_runner import CURVES
from replay.show.words import (
    PAIR_FRAME_ROWS,
    WITHIN,
    tallied,
)
from replay.words import plural
from sessions import Finding
from sessions.mcap.metadata import NOT_STATED

LATE_OR_SHORT = "late or cut short"
FALSE_CONTACT = "false contact"
REFERENCE = "reference"
NOT_APPLICABLE = "-"

UNCONFIRMED = "unconfirmed frames"
"""Stands for *false frames* of a detector that only calls them candidates."""

CUT = "cut by lost poses"
"""Column of contacts, there only where lost poses cut one."""

CERTAIN_SECONDS = 1e-6
"""Uncertainty of a first touch up to which none is stated."""

MOST_REASONS = 4
"""Reasons listed why containment was refused; each open body makes one of its own."""


def _count(counts: Range | None, mark: str, otherwise: str) -> Cell:
    return otherwise if counts is None else Marked(words.count_range(counts), mark if counts[1] else "")


def _false_cell(of: tuple[Proportion | None, bool], *, intervals: bool = False) -> Cell:
    false, unconfirmed = of
    if false is None:
        return NOT_APPLICABLE
    if false.value is None:
        return "0 %"
    word = " unconfirmed" if unconfirmed else ""
    text = percent(false, word.strip()) if intervals else f"{words.as_percentage(false.value)}{word}"
    return Marked(text, IN_YELLOW if false.count else "")


def _mean_count(proportion: Proportion | None, contacts: int) -> float | None:
    """Contacts with a fault, the mean over the sampling offsets; ``None`` of the reference."""
    return None if proportion is None else (proportion.value or 0.0) * contacts


def _ms(seconds: float | None) -> str:
    return NOT_APPLICABLE if seconds is None else words.milliseconds(seconds)


def _moment(begin_within: tuple[float, float]) -> Cell:
    """When a miss begins; a first touch between frames says how far it is uncertain, if by more than a microsecond."""
    begin, uncertainty = begin_within
    text = words.timestamp(begin)
    return text if uncertainty <= CERTAIN_SECONDS else Marked(text, "", f"within {words.duration(uncertainty)}")


def _quick_ms(seconds: float | None) -> str:
    return "" if seconds is None else words.milliseconds(seconds)


def _stage(longest: LongestStage | None) -> str:
    return f"{longest.stage} {words.fixed(100 * longest.fraction, 0)} %" if longest else ""


COLUMNS = columns_of(
    "show/run_tables.toml",
    {
        "count_in_red": lambda counts: _count(counts, IN_RED, REFERENCE),
        "count_in_part": lambda counts: _count(counts, PARTLY, NOT_APPLICABLE),
        "mean_missed": lambda rank: _mean_count(rank.missed, rank.contacts),
        "mean_late": lambda rank: _mean_count(rank.late_or_cut_short, rank.contacts),
        "false_fraction": lambda rank: None if rank.false is None else rank.false.value,
        "undecided_of": lambda rank: None if rank.missed_counts is None else rank.undecided,
        "or_dash": lambda count: NOT_APPLICABLE if count is None else count,
        "false_of": lambda rank: (rank.false, rank.unconfirmed),
        "false_share": _false_cell,
        "ms": _ms,
        "loss": words.loss_number,
        "quick_ms": _quick_ms,
        "percent_or_dash": lambda fraction: NOT_APPLICABLE if fraction is None else words.as_percentage(fraction),
        "percent": lambda fraction: "" if fraction is None else words.as_percentage(fraction),
        "stage": _stage,
        "cut_of": lambda row: row["lengths"] and row["lengths"].cut,
        "pair": " - ".join,
        "moment": _moment,
        "timestamp": words.timestamp,
        "millimetres": lambda metres: None if metres is None else words.number(1e3 * metres),
        "reasons_of": lambda row: "; ".join(row["effect"].because),
        "reported_of": lambda row: _reported(row["effect"]),
        "trigger_of": lambda row: row["effect"].trigger or "always",
        "work_of": lambda row: ", ".join(f"{name} {count:,}" for name, count in row["effect"].counters.items()),
        "skipped_of": lambda row: 1.0 - row["effect"].frames_run / max(1, row["effect"].frames),
        "percent_number": lambda fraction: None if fraction is None else words.percentage(100.0 * fraction),
    },
)


def ranking_table(result: Summarised) -> Table:
    """Every detector of a run, the one with the largest fault first, the measured Fix below it; the reference last.

    Counts are smallest to largest over the sampling offsets.
    """
    ranks = with_fixes(result.ranking, result.document)
    contacts = ranks[-1].contacts if ranks else 0
    made_of = f"made of {'it' if contacts == 1 else 'them'}" if contacts else "reported"
    title = f"{happened(contacts) if ranks else ''} What each detector {made_of}:"
    made = Table.of(COLUMNS["ranking"], ranks, title, timing_notes(result))
    some = any(rank.undecided for rank in ranks)
    return made.only(*(name for name in made.head if some or name != "undecided"))


def short_labels(ranking: Table, result: Summarised) -> Table:
    """A ranking whose rows of a Fix are called ``+fix``, below the detector that each mends: for narrow screens."""
    at = ranking.head.index("detector")
    rows = (
        row if row[at] in result.document.detectors else (*row[:at], "+fix", *row[at + 1 :]) for row in ranking.rows
    )
    return replace(ranking, rows=tuple(rows))


def with_intervals(ranking: Table) -> Table:
    """A ranking with the interval of each fraction beside it."""
    cell = partial(_false_cell, intervals=True)
    columns = (replace(column, show=cell) if column.name == FALSE_CONTACT else column for column in ranking.columns)
    return replace(ranking, columns=tuple(columns), notes=(OVER_CONTACTS, *ranking.notes))


def stored_tables(result: Summarised) -> dict[str, Table]:
    """Tables of the screens as Parquet has them, by name; those without a row are left out.

    Numbers of contacts in the ranking are means over the sampling offsets.
    """
    rows: dict[str, Sequence[Any]] = {
        "ranking": result.ranking,
        "times": _time_rows(result),
        "effects": _effect_rows(result),
        "session": _session_rows(result),
    }
    return {
        name: Table.of((column.stored for column in COLUMNS[name]), of_table)
        for name, of_table in rows.items()
        if of_table
    }


def timing_notes(result: Summarised) -> list[str]:
    """Lines on times that cannot be compared: of detectors not timed frame by frame, of a few very long samples."""
    live = {rank.label: result.document.detectors[rank.label].live for rank in result.ranking if rank.mean}
    at_once = [label for label, frame_by_frame in live.items() if not frame_by_frame]
    notes = []
    if len(at_once) not in (0, len(live)):
        verb = "was" if len(at_once) == 1 else "were"
        notes.append(
            f"{', '.join(at_once)} {verb} run on all frames at once: compare no time with those of other rows."
        )
    uneven = [rank.label for rank in result.ranking if rank.mean and rank.p99 is not None and rank.mean > rank.p99]
    if uneven:
        notes.append(f"The mean of {', '.join(uneven)} is above p99: at most 1 in 100 samples took very long.")
    return notes


def happened(contacts: int) -> str:
    """How many contacts the reference found, as a sentence."""
    return f"{plural(contacts, 'contact')} happened." if contacts else "No contact happened."


def sampling_notes(result: Summarised) -> list[str]:
    """Over what the counts of detectors of a fixed rate range, and at which offset their moments are."""
    labels = [rank.label for rank in result.ranking if rank.phases > 1]
    if not labels:
        return []
    who = ", ".join(labels)
    moments = "moments are those of the start time whose counts are nearest the mean"
    return [f"Counts of {who}: best to worst of {PHASES} start times of the sampling; {moments}."]


def pair_frame_table(title: str, audit: Mapping[str, DetectorAudit]) -> Table:
    """Pair-frames of every audited detector, a column each."""
    audits = list(audit.values())
    rows: list[tuple[Cell, ...]] = [
        (name, *(getattr(each.pair_frames, field) for each in audits)) for field, name in PAIR_FRAME_ROWS.items()
    ]
    rows.append(("missed, of those in contact", *(percent(each.time_missed) for each in audits)))
    rows.append(("between frames", *(each.between_frames for each in audits)))
    return table(title, ("", *audit), rows, notes=(OVER_CONTACTS,))


NO_CONTACTS: Final = ContactLengths(count=0, seconds=0.0, longest=0.0, cut=0)


def pair_table(result: Summarised, label: str) -> Table:
    """Pairs that touched, or were said to, by what a detector made of them; the most missed first, as in the lanes.

    Pairs of a hand and what it holds come last. Only where anything is within tolerance there is a column for it.
    """
    rows, grasped_rows = list[dict[str, Any]](), list[dict[str, Any]]()
    for pair in result.document.pairs:
        audit = pair.audit.get(label)
        if audit is None or pair.group:
            continue
        frames = audit.pair_frames
        lengths = pair.contacts.get(result.oracle, NO_CONTACTS)
        if lengths.count or frames.false_contact or frames.within_tolerance:
            rows.append(
                {
                    "pair": pair.name,
                    "lengths": lengths,
                    "audit": audit,
                    "frames": frames,
                    "within_tolerance": frames.within_tolerance,
                }
            )
        if grasped := audit.while_grasped:
            lengths = pair.grasped_contacts.get(result.oracle, NO_CONTACTS)
            grasped_rows.append(
                {
                    "pair": f"{pair.name} (held)",
                    "lengths": lengths,
                    "audit": grasped,
                    "frames": grasped,
                    "within_tolerance": 0,
                }
            )
    rows.sort(key=lambda row: (-row["frames"].missed, -row["frames"].false_contact))
    rows = [line for row in rows for line in (row, *_member_rows(result, row["pair"], label))]
    title = f"Contacts ({result.oracle}), and how {label} reported them"
    made = Table.of(COLUMNS["pairs"], rows + grasped_rows, title, containment_notes(result, result.oracle))
    absent = {name for name in (WITHIN, CUT) if not any(made.column(name))}
    absent.add("false frames" if all_unconfirmed(result.document.audit[label]) else UNCONFIRMED)
    return made.only(*(name for name in made.head if name not in absent))


def _member_rows(result: Summarised, group: str, label: str) -> Iterator[dict[str, Any]]:
    """Rows of the members of a group that touched, or were said to: its contacts are counted in its own row."""
    for pair in result.document.pairs:
        audit = pair.audit.get(label)
        if pair.group == group and audit is not None and _touched(audit.pair_frames):
            yield {
                "pair": f"  {pair.name}",
                "lengths": None,
                "audit": None,
                "frames": audit.pair_frames,
                "within_tolerance": audit.pair_frames.within_tolerance,
            }


def _touched(frames: ContactPairFrames) -> bool:
    return bool(frames.both or frames.missed or frames.false_contact or frames.within_tolerance)


def contact_table(result: Summarised, label: str) -> Table:
    """Contacts that a detector found, a row per pair."""
    rows = [
        {"pair": f"{pair.name} (held)" if pair.grasp or grasped else pair.name, "lengths": contacts[label]}
        for pair in result.document.pairs
        for grasped, contacts in ((False, pair.contacts), (True, pair.grasped_contacts))
        if label in contacts
    ]
    made = Table.of(
        COLUMNS["lengths"] + COLUMNS["cut"], rows, f"Contacts found by {label}", containment_notes(result, label)
    )
    return made if any(made.column(CUT)) else made.only(*(column.name for column in COLUMNS["lengths"]))


def containment_notes(result: Summarised, label: str) -> list[str]:
    """A line where this detector never decides of some pairs if one body is inside the other.

    Pairs that it decides in some frames are no matter of this line: their undecided frames are counted.
    """
    of_groups = {pair.group for pair in result.document.pairs}
    pairs = [pair for pair in result.document.pairs if pair.name not in of_groups]
    stated = [pair.containment.get(label, DECIDED) for pair in pairs]
    refused = [word for word in stated if word.startswith(REFUSED)]
    why = [word.removeprefix(REFUSED) for word in dict.fromkeys(refused)]
    more = f"; {len(why) - MOST_REASONS} more in summary.json" if len(why) > MOST_REASONS else ""
    of = f"{len(refused)} of {plural(len(stated), 'pair')}"
    return [f"{label}: containment refused for {of}: {'; '.join(why[:MOST_REASONS])}{more}"] if refused else []


def miss_table(result: Summarised, label: str) -> Table:
    """The misses of a detector, the deepest first."""
    misses = worst_first(fault for fault in result.faults[label] if fault.kind.is_miss)
    made = Table.of(COLUMNS["misses"], misses, f"missed by {label}, deepest first")
    noisy = any(made.column("in noise"))
    if any(miss.depth_at_least for miss in misses):
        made = replace(made, notes=(*made.notes, "At least so deep: not every frame of a miss was searched."))
    return made.only(*(name for name in made.head if noisy or name != "in noise"))


def false_table(result: Summarised, label: str) -> Table:
    """The false contacts of a detector, the one with the widest gap first."""
    false = worst_first(fault for fault in result.faults[label] if not fault.kind.is_miss)
    made = Table.of(COLUMNS["false"], false)
    unconfirmed = all(cause is Cause.BOUNDING_VOLUMES for cause in made.column("why"))
    thing = "unconfirmed contact" if unconfirmed else "false contact"
    return replace(made, title=f"{thing}s of {label}, widest gap first")


LATE = f"over {words.fixed(BUDGET_MS, 1)} ms"
"""Column of the frames that took longer than one at 90 Hz."""


def cost_table(result: Summarised) -> Table:
    """The times of each detector; the mean is over all frames, quantiles and the share over budget over the samples."""
    audited = {label: result.document.detectors[label] for label in result.document.audit}
    notes = [f"{label} cannot run frame by frame" for label, detector in audited.items() if not detector.online]
    if busy := busy_text(result.document):
        notes.append(busy)
    return Table.of(COLUMNS["times"], _time_rows(result), "Time of each detector", notes)


def _time_rows(result: Summarised) -> list[dict[str, Any]]:
    rows = []
    for label, detector in result.document.detectors.items():
        how = REFERENCE if label == result.oracle else "live" if detector.live else "offline"
        rows.append({"detector": label, "how": how, "seconds": detector.seconds})
    return rows


def _reported(effect: EffectRecord) -> str:
    """Events of an effect, or its curves."""
    curves = int(effect.counters.get(CURVES, 0))
    return tallied(effect.events) or (plural(curves, "curve") if curves else "nothing")


def effect_table(result: Summarised) -> Table:
    """Effects of the plan: what each found, why it ran, what it cost, how much of the session its trigger skipped."""
    return Table.of(COLUMNS["effects"], _effect_rows(result), "Effects")


def _effect_rows(result: Summarised) -> list[dict[str, Any]]:
    return [{"kind": kind, "effect": effect} for kind, effect in result.document.effects.items()]


def session_table(result: Summarised) -> Table:
    """Facts about the recording, and frames and bodies left out."""
    return Table.of(COLUMNS["session"], _session_rows(result), "Facts of the session")


def _session_rows(result: Summarised) -> list[tuple[str, object]]:
    session = result.document.session
    dropped = [f"{count} {why}" for why, count in asdict(session.dropped_frames).items() if count]
    proxies = [name for name, body in session.bodies.items() if body.proxy]
    rows: list[tuple[str, object]] = [
        ("session", session.id),
        ("frames", f"{session.frames:,} in {words.duration(session.duration)}"),
        ("bodies", ", ".join(f"{name} ({body.faces:,} faces)" for name, body in session.bodies.items())),
    ]
    if proxies:
        rows.append(("proxy meshes", f"stand in for the real ones of {', '.join(proxies)}"))
    if session.left_out:
        rows.append(("not tested", f"no mesh: {', '.join(session.left_out)}"))
    if dropped:
        rows.append(("frames left out", ", ".join(dropped)))
    rows += [("note", note) for note in session.notes]
    rows += [(row.subject, row.sentence) for row in session.assumptions]
    rows += [(key.replace("_", " "), value) for key, value in session.facts.items() if value != NOT_STATED]
    if withheld := session.facts_withheld:
        rows.append(("withheld", f"{plural(withheld, 'fact')} withheld; the session file holds all"))
    return rows


def finding_table(
    findings: Sequence[Finding], title: str = "Findings", *, marks: Sequence[str] = ("", "", "")
) -> Table:
    """The findings about a recording, in the order given; ``marks`` of a severity: note, warning, error.

    What a code means and what to do stands below its first row only: with nine losses of tracking it would be most of
    the table.
    """
    first = {finding.code: finding for finding in reversed(findings)}

    def message(finding: Finding) -> Cell:
        below = f"{finding.meaning}; {finding.fix}" if finding is first[finding.code] else ""
        return Marked(finding.message, "", below)

    columns = (
        Column("severity", of="severity", show=lambda level: Marked(level.name.lower(), marks[level]), whole=True),
        Column("code", whole=True),
        Column("body", whole=True),
        Column("what", of=message),
        Column("seconds", of=lambda finding: words.time_span(finding.start, finding.end), whole=True),
        Column("count", int),
    )
    return Table.of(columns, findings, title)
