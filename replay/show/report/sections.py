"""Sections below the first screen: faults as cards, events of effects, and folded details."""

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Final

from replay import words
from replay.auditing.loss import LOSS_MEANING
from replay.document.columns import screen_columns
from replay.document.headline import findings_of
from replay.document.run_document import RunDocument
from replay.document.tables import Table, table
from replay.effects.effect_summary import EVENT_ROWS
from replay.show import run_tables
from replay.show.plots import Plot
from replay.show.report.run_view import RunView
from replay.show.sections import SectionName, section_of
from replay.show.words import NOTHING_SUSPICIOUS
from replay.words import plural

Part = Table | Plot | str
Fold = tuple[str, Sequence[Part]]
"""Parts below a line that opens them."""

MOST_FINDINGS: Final = 200
"""Findings listed; ``summary.json`` holds them all."""

FRAME_WORDS: Final = (
    "A pair-frame is one pair of bodies in one frame. Missed: the reference says contact, the detector does not; "
    "false: the other way round. Within tolerance: they disagree about less than any tracker resolves. Left out: "
    "one of them could not decide, or a pose was lost. Between frames: only the way from frame to frame shows it."
)
GLOSSARY: Final = {
    **{column.name: column.meaning for column in screen_columns("ranking") if not (column.wide or column.names_row)},
    "loss": LOSS_MEANING,
    "reference": "the detector that the others are compared with",
    "0-2": "best to worst count over 16 start times of the sampling: where the first sample falls is chance",
}


def effect_parts(view: RunView, curves: Sequence[Plot]) -> Fold | None:
    """Section of events of effects and of effects not run; ``None`` if the run has no effects."""
    plan_record, effects, events = view.document.plan, view.document.effects, view.events
    if not effects:
        return None
    rows = [
        (event.effect, event.name, event.message, words.timestamp(event.time), _seconds(event.end_time))
        for event in events[:EVENT_ROWS]
    ]
    more_text = f", the first {EVENT_ROWS} of {len(events)}" if len(events) > EVENT_ROWS else ""
    event_table = table(
        f"Events of the effects{more_text}", ("effect", "event", "in words", "from s", "to s"), rows, words=3
    )
    contents: list[Part] = [*curves, *section_of(view, SectionName.EFFECTS).tables, event_table]
    if plan_record.not_run:
        contents.append(f"Not called for, so not imported and not run: {', '.join(plan_record.not_run)}.")
    if not plan_record.detection:
        contents.append("No collision query was made.")
    return f"{plural(len(effects), 'effect')}, {plural(len(events), 'event')}", contents


def _seconds(end: float | None) -> str:
    return "" if end is None else words.timestamp(end)


def folds(view: RunView) -> Iterator[Fold]:
    """Everything that few read, each below a line that says what it is."""
    document = view.document
    session = document.session
    rate = f", {words.rate(1.0 / session.median_step)}" if session.median_step else ""
    bodies = plural(len(session.bodies), "body", "bodies")
    frames_text = f"{session.frames:,} frames in {words.duration(session.duration)}{rate}"
    yield (f"Recording: {frames_text}, {bodies}", section_of(view, SectionName.SESSION).tables)
    yield (trust(document), finding_parts(document))
    audited_labels = [rank.label for rank in view.ranking[:-1]]
    if audited_labels:
        yield ("Contacts of each pair", [run_tables.pair_table(view, label) for label in audited_labels])
        pair_frame_counts = run_tables.pair_frame_table("Pair-frames", document.audit)
        yield ("Counts with intervals", [FRAME_WORDS, pair_frame_counts])
    if faults := section_of(view, SectionName.FAULTS).tables:
        yield ("Missed and false contacts, in tables", faults)
    if document.detectors:
        yield ("Time of each detector", section_of(view, SectionName.TIMES).tables)
    yield ("Settings, to get the same figures again", [_settings_table(document)])


def trust(document: RunDocument) -> str:
    """Sentence with the numbers of errors and warnings, and their meaning for verdicts."""
    count_of_severity = Counter(finding.severity for finding in document.findings)
    severity_counts = [
        plural(count_of_severity[severity], severity)
        for severity in ("error", "warning")
        if count_of_severity[severity]
    ]
    flag_clause = ": verdicts on these spans carry a flag" if document.detectors else ""
    return (
        f"{' and '.join(severity_counts)} about the recording{flag_clause}" if severity_counts else NOTHING_SUSPICIOUS
    )


def finding_parts(document: RunDocument) -> list[Part]:
    """Tables of findings, worst first, and of their repair by the policy."""
    contents: list[Part] = []
    if findings := findings_of(document):
        contents.append(run_tables.finding_table(findings[:MOST_FINDINGS]))
    counts_by_key: dict[tuple[str, str, str], Counter[str]] = {}
    for span in document.flagged:
        span_counts = counts_by_key.setdefault((span.kind, span.body or "all", span.action), Counter())
        span_counts.update({"spans": 1} | {name: getattr(span, name) for name in DONE})
    if counts_by_key:
        column_names = ("kind", "body", "policy", "spans", *DONE)
        rows = [(*key, *(count[name] for name in ("spans", *DONE))) for key, count in counts_by_key.items()]
        contents.append(table("Treatment of doubtful poses", column_names, rows, words=3))
    return contents


DONE: Final = ("samples", "dropped", "held", "interpolated")


def _settings_table(document: RunDocument) -> Table:
    """Settings, digests and machine: what it takes to get the same figures again."""
    rows: list[tuple[object, object]] = [("session", document.session.id), ("seed", document.seed)]
    for label, detector in document.detectors.items():
        settings = json.dumps(detector.settings, sort_keys=True)
        rows.append((label, f"{detector.name} {settings}, verdicts SHA-256 {detector.digest}"))
    rows += document.machine.items()
    rows.append(("versions", ", ".join(f"{name} {value}" for name, value in document.versions.items())))
    return table("Settings, digests and machine", ("what", "value"), rows, words=2)
