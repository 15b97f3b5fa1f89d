"""Data of the page of a run: its summary and the rows of its tables, whether in memory or from a run folder."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from itertools import islice
from typing import Final

from replay import words
from replay.auditing.fault import Fault
from replay.document.answer import Answer
from replay.document.contact import ContactRecord, EventRecord
from replay.document.placeholders import in_run_folder
from replay.document.ranking import Rank
from replay.document.run_document import RunDocument
from replay.document.run_result import Summarised
from replay.effects.effect_summary import RESULT_NAMES
from replay.show.palette import fault_key
from replay.show.report.charts import TimeSpan
from replay.show.sections import Section, SectionName, section_of
from replay.show.words import NOT_COMPUTED
from replay.words import date, plural, tally_text
from sessions.mcap.metadata import NOT_STATED

FIRST_DATE_NS: Final = 946_684_800 * 10**9
"""The year 2000; earlier stamps count from the start of a recording, not from 1970."""

MOST_FIRST_EVENTS: Final = 6
"""Events listed first of all, where no contact was looked for."""

Pair = tuple[str, str]

Still = Callable[[str, Fault, tuple[int, int]], tuple[str, str]]
"""Picture of a fault of a detector as HTML, at a size, and its colours in words."""


@dataclass(frozen=True)
class Hero:
    """The top of a page where there is no answer about a detector, or beside one."""

    sentence: str
    lines: Sequence[str] = ()


@dataclass(frozen=True, eq=False)
class RunView:
    """A run as far as its page tells of it, in memory or in a folder; mappings are by the label of a detector."""

    run: Summarised
    name: str  # what pages call the session
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

    @property
    def faults(self) -> Mapping[str, Sequence[Fault]]:
        """Faults of every audited detector."""
        return self.run.faults

    @cached_property
    def contacts(self) -> Mapping[str, Sequence[ContactRecord]]:
        """Contacts of every detector in order of time; of the reference without those of held bodies, not counted."""
        return {
            label: [contact for contact in contacts if not (contact.grasped and label == self.oracle)]
            for label, contacts in self.run.contacts.items()
        }

    @cached_property
    def events(self) -> Sequence[EventRecord]:
        """Events of effects, in order of time."""
        events = (event for event in self.run.events if event.effect)
        return sorted(events, key=lambda event: (event.time, event.source, event.name, event.message))

    @cached_property
    def hero(self) -> Hero | None:
        """Headline in place of an answer; ``None`` if there is an answer."""
        return self.asked or (None if self.answers else _hero_without_audit(self.document, self.events))

    @property
    def title(self) -> str:
        """Title of the page: its first sentence and the name of the session."""
        sentence = self.answer.sentences[0] if self.hero is None else self.hero.sentence
        return f"{sentence.rstrip('.')}. Replay of {self.name}"

    def filled(self, command: str) -> str:
        """A command with the names of this run."""
        return in_run_folder(command, self.folder)

    @property
    def doubts(self) -> Sequence[str]:
        """Doubts about the answer, which stand below it."""
        return section_of(self.run, SectionName.SESSION).sentences

    @cached_property
    def answer(self) -> Section:
        """Sentence about the worst detector, its reasons, and the time of the reference."""
        return section_of(self.run, SectionName.ANSWER)


def session_names(document: RunDocument) -> list[str]:
    """Names of a session for a page: scene or bodies, pseudonym, date; never its file, which may name a person."""
    session = document.session
    pseudonym = session.facts.get("pseudonym", NOT_STATED)
    names = [session.scene or _names_of_bodies(document), "" if pseudonym == NOT_STATED else pseudonym]
    if session.first_stamp_ns >= FIRST_DATE_NS:
        names.append(date(datetime.fromtimestamp(session.first_stamp_ns // 10**9, UTC)))
    return [name for name in names if name]


def _names_of_bodies(document: RunDocument) -> str:
    """Return the first two bodies, and the number of the others."""
    bodies = [*document.session.bodies]
    others_text = f" and {len(bodies) - 2} more" if len(bodies) > 2 else ""
    return f"{(', ' if others_text else ' and ').join(bodies[:2])}{others_text}"


def _hero_without_audit(document: RunDocument, events: Sequence[EventRecord]) -> Hero:
    """How many contacts were found, or what the effects say, the weightiest result first."""
    if document.detectors:
        count_texts = [
            f"{plural(detector.contacts, 'contact')} found by {label}" for label, detector in document.detectors.items()
        ]
        return Hero(", ".join(count_texts))
    lines = [f"{words.moment(event.time)}: {event.message}" for event in events[:MOST_FIRST_EVENTS]]
    if len(events) > MOST_FIRST_EVENTS:
        lines.append(f"and {len(events) - MOST_FIRST_EVENTS} more")
    if events:
        lines.append(f"{NOT_COMPUTED}.")
    result_events = [event for event in events if event.name in RESULT_NAMES]
    if result_events:
        message = min(result_events, key=lambda event: RESULT_NAMES.index(event.name)).message
        return Hero(f"{message[:1].upper()}{message[1:]}", lines)
    return Hero(tally_text(Counter(event.name for event in events)) or NOT_COMPUTED, lines)


def spans(view: RunView, label: str, pair: Pair | None = None) -> dict[str, list[TimeSpan]]:
    """Stretches of a detector's lane by kind, or of the reference's; of one pair or of all."""
    intervals = _intervals_by_pair(view, label, pair)
    if label == view.oracle or not view.oracle:
        return {"reference" if view.oracle else "contact": [span for spans in intervals.values() for span in spans]}
    reference = _intervals_by_pair(view, view.oracle, pair)
    spans_by_kind: dict[str, list[TimeSpan]] = {"right": [], "missed": [], "late": [], "false": []}
    for pair_of_both in reference.keys() & intervals.keys():
        spans_by_kind["right"] += _overlaps(reference[pair_of_both], intervals[pair_of_both])
    for fault in view.faults.get(label, ()):
        if pair in (None, fault.bodies):
            spans_by_kind[fault_key(fault.kind)].append((fault.start, fault.end))
    return spans_by_kind


def _intervals_by_pair(view: RunView, label: str, pair: Pair | None) -> dict[Pair, list[TimeSpan]]:
    """When a detector reports contact of each pair, or of one alone."""
    intervals: dict[Pair, list[TimeSpan]] = {}
    for contact in view.contacts.get(label, ()):
        if pair in (None, contact.bodies):
            intervals.setdefault(contact.bodies, []).append((contact.start, contact.end))
    return intervals


def _overlaps(reference: Sequence[TimeSpan], reported: Sequence[TimeSpan]) -> Iterator[TimeSpan]:
    """Yields the overlaps of intervals of two lists in order of time."""
    first_reported = 0
    for start, end in reference:
        while first_reported < len(reported) and reported[first_reported][1] <= start:
            first_reported += 1
        for begin, stop in islice(reported, first_reported, None):
            if begin >= end:
                break
            yield max(start, begin), min(end, stop)
