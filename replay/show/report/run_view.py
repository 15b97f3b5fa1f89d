"""Data of the page of a run: its summary and the rows of its tables, whether in memory or from a run folder."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice
from typing import Any, Final

from replay.auditing.fault import Fault, FaultKind
from replay.document.answer import Answer
from replay.document.cost import RUN, SESSION
from replay.document.headline import doubts_of, open_questions
from replay.document.ranking import Rank
from replay.document.result_tables import EFFECT
from replay.document.run_document import RunDocument
from replay.document.run_result import Summarised
from replay.effects.effect_summary import RESULTS
from replay.show.report.charts import Span
from replay.show.words import NOT_LOOKED_FOR, tallied
from replay.words import plural
from sessions import Finding, Severity
from sessions.doctor.finding import CODES
from sessions.mcap.metadata import NOT_STATED

EVENTS_FIRST: Final = 6
"""Events listed first of all, where no contact was looked for."""

Pair = tuple[str, str]
Row = dict[str, Any]
Rows = Sequence[Row]


Still = Callable[[str, Fault, tuple[int, int]], tuple[str, str]]
"""Picture of a fault of a detector as HTML, at a size, and its colours in words."""


def lane_kind(kind: FaultKind) -> str:
    """Return the kind of a fault in a lane, which has a colour: ``missed``, ``late`` or ``false``."""
    if not kind.is_miss:
        return "false"
    return "missed" if kind is FaultKind.NEVER_REPORTED else "late"


@dataclass(frozen=True)
class Hero:
    """The top of a page where there is no answer about a detector, or beside one."""

    sentence: str
    lines: Sequence[str] = ()


@dataclass(frozen=True, eq=False)
class RunView:
    """A run as far as its page tells of it, in memory or in a folder; mappings are by the label of a detector."""

    run: Summarised
    rows: Callable[[str], Rows]  # of the tables ``episodes`` and ``events``
    name: str  # what pages call the session
    faults: Mapping[str, Sequence[Fault]] = field(default_factory=dict)  # of every audited detector
    asked: Hero | None = None  # what stands first where something else was asked than detectors
    folder: str = (
        "RUN"  # the run folder in a command: "." where the page lies in it, so that it names no path of a machine
    )
    still: Still | None = None
    pictured: bool = False  # whether the live picture stands beside the page, and each fault leads it there

    @property
    def document(self) -> RunDocument:
        """Everything that ``summary.json`` holds."""
        return self.run.document

    @property
    def oracle(self) -> str:
        """Label of the reference, or ``""``."""
        return self.run.oracle

    @property
    def ranking(self) -> tuple[Rank, ...]:
        """The audited detectors, the worst first, and the reference last."""
        return self.run.ranking

    @property
    def answers(self) -> tuple[Answer, ...]:
        """Answer about each audited detector, in the order of the ranking."""
        return self.run.answers

    @cached_property
    def contacts(self) -> Mapping[str, Rows]:
        """Contacts of every detector in order of time; of the reference without those of held bodies, not counted."""
        contacts: dict[str, list[Row]] = {label: [] for label in self.document.detectors}
        for row in self.rows("episodes"):
            if not (row["held"] and row["detector"] == self.oracle):
                contacts[row["detector"]].append(row)
        return contacts

    @cached_property
    def events(self) -> Rows:
        """Events of effects, in order of time; ``source`` is the kind of effect."""
        rows = (row for row in self.rows("events") if row["source"].startswith(EFFECT))
        events = [row | {"source": row["source"].removeprefix(EFFECT)} for row in rows]
        return sorted(events, key=lambda row: (row["time"], row["source"], row["name"], row["message"]))

    @cached_property
    def hero(self) -> Hero | None:
        """Headline in place of an answer; ``None`` if there is an answer."""
        return self.asked or (None if self.answers else _without_audit(self.document, self.events))

    @property
    def title(self) -> str:
        """Title of the page: its first sentence and the name of the session."""
        sentence = self.answers[0].sentence if self.hero is None else self.hero.sentence
        return f"{sentence.rstrip('.')}. Replay of {self.name}"

    def filled(self, command: str) -> str:
        """A command with the names of this run."""
        return command.replace(RUN, self.folder).replace(SESSION, "session.mcap")

    @property
    def doubts(self) -> list[str]:
        """Caveats that come before the answer."""
        return [*open_questions(self.document), *doubts_of(findings_of(self.document))]


def session_names(document: RunDocument) -> list[str]:
    """Names of a session for a page: scene, pseudonym, id; never its file, which may name a person."""
    session = document.session
    pseudonym = session.facts.get("pseudonym", NOT_STATED)
    names = [session.scene, "" if pseudonym == NOT_STATED else pseudonym, f"session {session.id}"]
    return [name for name in names if name]


def _without_audit(document: RunDocument, events: Rows) -> Hero:
    """How many contacts were found, or what the effects say, the weightiest result first."""
    if document.detectors:
        counts = [
            f"{plural(detector.contacts, 'contact')} found by {label}" for label, detector in document.detectors.items()
        ]
        return Hero(", ".join(counts))
    lines = [f"{row['time']:.1f} s: {row['message']}" for row in events[:EVENTS_FIRST]]
    if len(events) > EVENTS_FIRST:
        lines.append(f"and {len(events) - EVENTS_FIRST} more")
    if events:
        lines.append(f"{NOT_LOOKED_FOR}.")
    results = [row for row in events if row["name"] in RESULTS]
    if results:
        message = min(results, key=lambda row: RESULTS.index(row["name"]))["message"]
        return Hero(f"{message[:1].upper()}{message[1:]}", lines)
    return Hero(tallied(Counter(row["name"] for row in events)) or NOT_LOOKED_FOR, lines)


def findings_of(document: RunDocument) -> list[Finding]:
    """Findings of the doctor, the worst first; codes of another version are left out."""
    return [
        Finding(
            code=row.code, own_severity=Severity[row.severity.upper()], message=row.message,
            body=row.body or "", start=row.start, end=row.end, count=row.count,
        )
        for row in document.findings
        if row.code in CODES
    ]  # fmt: skip


def spans(view: RunView, label: str, pair: Pair | None = None) -> dict[str, list[Span]]:
    """Stretches of a detector's lane by kind, or of the reference's; of one pair or of all."""
    intervals = _stretches(view, label, pair)
    if label == view.oracle or not view.oracle:
        return {"reference" if view.oracle else "contact": [span for spans in intervals.values() for span in spans]}
    reference = _stretches(view, view.oracle, pair)
    kinds: dict[str, list[Span]] = {"right": [], "missed": [], "late": [], "false": []}
    for both in reference.keys() & intervals.keys():
        kinds["right"] += _shared(reference[both], intervals[both])
    for fault in view.faults.get(label, ()):
        if pair in (None, fault.bodies):
            kinds[lane_kind(fault.kind)].append((fault.start, fault.end))
    return kinds


def _stretches(view: RunView, label: str, pair: Pair | None) -> dict[Pair, list[Span]]:
    """When a detector reports contact of each pair, or of one alone."""
    intervals: dict[Pair, list[Span]] = {}
    for row in view.contacts.get(label, ()):
        both = row["body_a"], row["body_b"]
        if pair in (None, both):
            intervals.setdefault(both, []).append((row["start"], row["end"]))
    return intervals


def _shared(reference: Sequence[Span], reported: Sequence[Span]) -> Iterator[Span]:
    """Yields the overlaps of intervals of two lists in order of time."""
    first = 0
    for start, end in reference:
        while first < len(reported) and reported[first][1] <= start:
            first += 1
        for begin, stop in islice(reported, first, None):
            if begin >= end:
                break
            yield max(start, begin), min(end, stop)
