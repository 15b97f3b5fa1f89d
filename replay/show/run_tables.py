"""The tables of a run, each built once; a renderer takes the columns for which it has room."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Final

from msgspec.structs import asdict

from cdcore.protocol import DECIDED, REFUSED
from replay import words
from replay.auditing.fault import Cause, worst_first
from replay.auditing.sampling_offsets import OFFSET_COUNT
from replay.auditing.wilson import INTERVALS_CAPTION
from replay.document.audit import ContactPairFrames, DetectorAudit
from replay.document.columns import REFERENCE, false_cell, file_columns, screen_columns
from replay.document.cost import BUDGET_MS, busy_text
from replay.document.gates import percent
from replay.document.ranking import all_unconfirmed, ranks_with_fixes
from replay.document.run_document import ContactLengths
from replay.document.run_result import Summarised
from replay.document.tables import Cell, Column, Marked, Table, table
from replay.show.words import PAIR_FRAME_ROWS, WITHIN_TOLERANCE_LABEL
from replay.words import plural
from sessions import Finding
from sessions.mcap.metadata import NOT_STATED

LATE_OR_SHORT = "late or cut short"
FALSE_CONTACT = "false contact"

UNCONFIRMED_COLUMN = "unconfirmed frames"
"""Stands for *false frames* of a detector that only calls them candidates."""

CUT_COLUMN = "cut by lost poses"
"""Column of contacts, there only where lost poses cut one."""

MOST_REASONS = 4
"""Reasons listed why containment was refused; each open body makes one of its own."""


def ranking_table(result: Summarised) -> Table:
    """Every detector of a run, the one with the largest fault first, the measured Fix below it; the reference last.

    Counts are smallest to largest over the sampling offsets.
    """
    ranks = ranks_with_fixes(result.ranking, result.document)
    contacts = ranks[-1].contacts if ranks else 0
    title_ending = f"made of {'it' if contacts == 1 else 'them'}" if contacts else "reported"
    title = f"{contacts_sentence(contacts) if ranks else ''} What each detector {title_ending}:"
    built_table = Table.of(screen_columns("ranking"), ranks, title, timing_notes(result))
    has_undecided = any(rank.undecided for rank in ranks)
    return built_table.only(
        *(column_name for column_name in built_table.head if has_undecided or column_name != "undecided")
    )


def with_intervals(ranking: Table) -> Table:
    """A ranking with the interval of each fraction beside it."""
    cell = partial(false_cell, intervals=True)
    columns = (replace(column, show=cell) if column.name == FALSE_CONTACT else column for column in ranking.columns)
    return replace(ranking, columns=tuple(columns), notes=(INTERVALS_CAPTION, *ranking.notes))


def stored_tables(result: Summarised) -> dict[str, Table]:
    """Tables of the screens as files have them, by name; those without a row are left out.

    Numbers of contacts in the ranking are means over the sampling offsets; the measured Fix has a row of its own.
    """
    rows_of_table: dict[str, Sequence[Any]] = {
        "ranking": ranks_with_fixes(result.ranking, result.document),
        "times": _time_rows(result),
        "effects": _effect_rows(result),
        "session": _session_rows(result),
    }
    return {name: Table.of(file_columns(name), of_table) for name, of_table in rows_of_table.items() if of_table}


def timing_notes(result: Summarised) -> list[str]:
    """Lines on times that cannot be compared: of detectors not timed frame by frame, of a few very long samples."""
    live_by_label = {rank.label: result.document.detectors[rank.label].live for rank in result.ranking if rank.mean}
    batch_labels = [label for label, frame_by_frame in live_by_label.items() if not frame_by_frame]
    notes = []
    if len(batch_labels) not in (0, len(live_by_label)):
        verb = "was" if len(batch_labels) == 1 else "were"
        notes.append(
            f"{', '.join(batch_labels)} {verb} run on all frames at once: compare no time with those of other rows."
        )
    uneven_labels = [
        rank.label for rank in result.ranking if rank.mean and rank.p99 is not None and rank.mean > rank.p99
    ]
    if uneven_labels:
        notes.append(f"The mean of {', '.join(uneven_labels)} is above p99: at most 1 in 100 samples took very long.")
    return notes


def contacts_sentence(contacts: int) -> str:
    """How many contacts the reference found, as a sentence."""
    return f"{plural(contacts, 'contact')} happened." if contacts else "No contact was found."


def range_notes(result: Summarised) -> list[str]:
    """A line on what varies where a count of the ranking is a range; none where every count is one number."""
    ranks = ranks_with_fixes(result.ranking, result.document)
    ranges = [counts for rank in ranks for counts in (rank.missed_counts, rank.late_counts) if counts is not None]
    varying = [counts for counts in ranges if counts[0] != counts[1]]
    if not varying:
        return []
    least, most = varying[0]
    how = "or" if most == least + 1 else "to"
    meaning = f"{least:,} {how} {most:,} contacts, by when sampling starts"
    return [f"{words.count_range(varying[0])}: {meaning} ({OFFSET_COUNT} start times were tried)."]


def sampling_notes(result: Summarised) -> list[str]:
    """Over what the counts of detectors of a fixed rate range, and at which offset their moments are."""
    labels = [rank.label for rank in result.ranking if rank.phases > 1]
    if not labels:
        return []
    labels_text = ", ".join(labels)
    moments = "moments are those of the start time whose counts are nearest the mean"
    return [f"Counts of {labels_text}: best to worst of {OFFSET_COUNT} start times of the sampling; {moments}."]


def pair_frame_table(title: str, audit: Mapping[str, DetectorAudit]) -> Table:
    """Pair-frames of every audited detector, a column each."""
    detector_audits = list(audit.values())
    rows: list[tuple[Cell, ...]] = [
        (name, *(getattr(detector_audit.pair_frames, field) for detector_audit in detector_audits))
        for field, name in PAIR_FRAME_ROWS.items()
    ]
    rows.append(
        ("missed, of those in contact", *(percent(detector_audit.time_missed) for detector_audit in detector_audits))
    )
    rows.append(("between frames", *(detector_audit.between_frames for detector_audit in detector_audits)))
    return table(title, ("", *audit), rows, notes=(INTERVALS_CAPTION,))


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
        pair_frames = audit.pair_frames
        lengths = pair.contacts.get(result.oracle, NO_CONTACTS)
        if lengths.count or pair_frames.false_contact or pair_frames.within_tolerance:
            rows.append(
                {
                    "pair": pair.name,
                    "lengths": lengths,
                    "audit": audit,
                    "frames": pair_frames,
                    "within_tolerance": pair_frames.within_tolerance,
                }
            )
        if grasped_counts := audit.while_grasped:
            lengths = pair.grasped_contacts.get(result.oracle, NO_CONTACTS)
            grasped_rows.append(
                {
                    "pair": f"{pair.name} (held)",
                    "lengths": lengths,
                    "audit": grasped_counts,
                    "frames": grasped_counts,
                    "within_tolerance": 0,
                }
            )
    rows.sort(key=lambda row: (-row["frames"].missed, -row["frames"].false_contact))
    rows = [line for row in rows for line in (row, *_member_rows(result, row["pair"], label))]
    title = f"Contacts ({result.oracle}), and how {label} reported them"
    built_table = Table.of(
        screen_columns("pairs"), rows + grasped_rows, title, containment_notes(result, result.oracle)
    )
    absent_columns = {name for name in (WITHIN_TOLERANCE_LABEL, CUT_COLUMN) if not any(built_table.column(name))}
    absent_columns.add("false frames" if all_unconfirmed(result.document.audit[label]) else UNCONFIRMED_COLUMN)
    return built_table.only(*(name for name in built_table.head if name not in absent_columns))


def _member_rows(result: Summarised, group: str, label: str) -> Iterator[dict[str, Any]]:
    """Rows of the members of a group that touched, or were said to: its contacts are counted in its own row."""
    for pair in result.document.pairs:
        audit = pair.audit.get(label)
        if pair.group == group and audit is not None and _has_touched(audit.pair_frames):
            yield {
                "pair": f"  {pair.name}",
                "lengths": None,
                "audit": None,
                "frames": audit.pair_frames,
                "within_tolerance": audit.pair_frames.within_tolerance,
            }


def _has_touched(frames: ContactPairFrames) -> bool:
    return bool(frames.both or frames.missed or frames.false_contact or frames.within_tolerance)


def contact_table(result: Summarised, label: str) -> Table:
    """Contacts that a detector found, a row per pair."""
    rows = [
        {"pair": f"{pair.name} (held)" if pair.grasp or grasped else pair.name, "lengths": contacts[label]}
        for pair in result.document.pairs
        for grasped, contacts in ((False, pair.contacts), (True, pair.grasped_contacts))
        if label in contacts
    ]
    lengths, title = screen_columns("lengths"), f"Contacts found by {label}"
    built_table = Table.of((*lengths, *screen_columns("cut")), rows, title, containment_notes(result, label))
    return (
        built_table if any(built_table.column(CUT_COLUMN)) else built_table.only(*(column.name for column in lengths))
    )


def containment_notes(result: Summarised, label: str) -> list[str]:
    """A line where this detector never decides of some pairs if one body is inside the other.

    Pairs that it decides in some frames are no matter of this line: their undecided frames are counted.
    """
    of_groups = {pair.group for pair in result.document.pairs}
    pairs = [pair for pair in result.document.pairs if pair.name not in of_groups]
    containments = [pair.containment.get(label, DECIDED) for pair in pairs]
    refusals = [word for word in containments if word.startswith(REFUSED)]
    reasons = [word.removeprefix(REFUSED) for word in dict.fromkeys(refusals)]
    more_text = f"; {len(reasons) - MOST_REASONS} more in summary.json" if len(reasons) > MOST_REASONS else ""
    refused_text = f"{len(refusals)} of {plural(len(containments), 'pair')}"
    return (
        [f"{label}: containment refused for {refused_text}: {'; '.join(reasons[:MOST_REASONS])}{more_text}"]
        if refusals
        else []
    )


def miss_table(result: Summarised, label: str) -> Table:
    """The misses of a detector, the deepest first."""
    misses = worst_first(fault for fault in result.faults[label] if fault.kind.is_miss)
    built_table = Table.of(screen_columns("misses"), misses, f"missed by {label}, deepest first")
    has_noise = any(built_table.column("in noise"))
    if any(miss.depth_at_least for miss in misses):
        built_table = replace(
            built_table, notes=(*built_table.notes, "At least so deep: not every frame of a miss was searched.")
        )
    return built_table.only(*(name for name in built_table.head if has_noise or name != "in noise"))


def false_table(result: Summarised, label: str) -> Table:
    """The false contacts of a detector, the one with the widest gap first."""
    false = worst_first(fault for fault in result.faults[label] if not fault.kind.is_miss)
    built_table = Table.of(screen_columns("false"), false)
    is_unconfirmed = all(cause is Cause.BOUNDING_VOLUMES for cause in built_table.column("why"))
    contact_word = "unconfirmed contact" if is_unconfirmed else "false contact"
    return replace(built_table, title=f"{contact_word}s of {label}, widest gap first")


LATE_COLUMN = f"over {words.decimal(BUDGET_MS, 1)} ms"
"""Column of the frames that took longer than one at 90 Hz."""


def cost_table(result: Summarised) -> Table:
    """The times of each detector; the mean is over all frames, quantiles and the share over budget over the samples."""
    audited_detectors = {label: result.document.detectors[label] for label in result.document.audit}
    notes = [
        f"{label} cannot run frame by frame" for label, detector in audited_detectors.items() if not detector.online
    ]
    if busy_note := busy_text(result.document):
        notes.append(busy_note)
    return Table.of(screen_columns("times"), _time_rows(result), "Time of each detector", notes)


def _time_rows(result: Summarised) -> list[dict[str, Any]]:
    rows = []
    for label, detector in result.document.detectors.items():
        time_word = REFERENCE if label == result.oracle else "live" if detector.live else "offline"
        rows.append({"detector": label, "how": time_word, "seconds": detector.seconds})
    return rows


def effect_table(result: Summarised) -> Table:
    """Effects of the plan: what each found, why it ran, what it cost, how much of the session its trigger skipped."""
    return Table.of(screen_columns("effects"), _effect_rows(result), "Effects")


def _effect_rows(result: Summarised) -> list[dict[str, Any]]:
    return [{"kind": kind, "effect": effect} for kind, effect in result.document.effects.items()]


def session_table(result: Summarised) -> Table:
    """Facts about the recording, and frames and bodies left out."""
    return Table.of(screen_columns("session"), _session_rows(result), "Facts of the session")


def _session_rows(result: Summarised) -> list[tuple[str, object]]:
    session = result.document.session
    dropped_texts = [f"{count} {why}" for why, count in asdict(session.dropped_frames).items() if count]
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
    if dropped_texts:
        rows.append(("frames left out", ", ".join(dropped_texts)))
    rows += [("note", note) for note in session.notes]
    rows += [(row.subject, row.sentence) for row in session.assumptions]
    rows += [(key.replace("_", " "), value) for key, value in session.facts.items() if value != NOT_STATED]
    if withheld_facts := session.facts_withheld:
        rows.append(("withheld", f"{plural(withheld_facts, 'fact')} withheld; the session file holds all"))
    return rows


def finding_table(
    findings: Sequence[Finding], title: str = "Findings", *, marks: Sequence[str] = ("", "", "")
) -> Table:
    """The findings about a recording, in the order given; ``marks`` of a severity: note, warning, error.

    What a code means and what to do stands below its first row only: with nine losses of tracking it would be most of
    the table.
    """
    first_of_code = {finding.code: finding for finding in reversed(findings)}

    def message(finding: Finding) -> Cell:
        meaning_text = f"{finding.meaning}; {finding.fix}" if finding is first_of_code[finding.code] else ""
        return Marked(finding.message, "", meaning_text)

    columns = (
        Column("severity", of="severity", show=lambda level: Marked(level.name.lower(), marks[level]), whole=True),
        Column("code", whole=True),
        Column("body", whole=True),
        Column("what", of=message),
        Column("seconds", of=lambda finding: words.time_span(finding.start, finding.end), whole=True),
        Column("count", int),
    )
    return Table.of(columns, findings, title)
