"""What the page of a run reads: its summary and the rows of its tables, whether in memory or from a run folder."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from replay.comparison.false_contacts import VOLUMES
from replay.comparison.misses import NEVER_FOUND
from replay.outputs.report.charts import Span
from replay.outputs.report.markup import Markup
from replay.outputs.words import address
from replay.pipeline.answer import Answer
from replay.pipeline.ranking import Rank
from sessions import Finding, Severity
from sessions.doctor.finding import CODES

MISS: Final = "miss"
FALSE: Final = "false"

Pair = tuple[str, str]
Rows = Iterable[Mapping[str, Any]]


@dataclass(frozen=True)
class Fault:
    """A miss or a false contact of a detector."""

    label: str
    kind: str  # ``MISS`` or ``FALSE``, as its option and its address are called
    number: int
    pair: Pair
    start: float
    end: float
    frames: int
    what: str  # ``never found``, ``starts early`` ...
    unconfirmed: bool  # whether the detector only calls it a candidate
    why: str  # the sentence about it

    @property
    def name(self) -> str:
        """``False contact``, ``Unconfirmed contact`` or ``Miss``."""
        if self.kind == MISS:
            return "Miss"
        return "Unconfirmed contact" if self.unconfirmed else "False contact"

    @property
    def stretch(self) -> str:
        """Its kind of stretch in a lane, which has a colour: ``missed``, ``late`` or ``false``."""
        if self.kind == FALSE:
            return "false"
        return "missed" if self.what == NEVER_FOUND else "late"

    @property
    def span(self) -> str:
        """``19.344 to 22.056 s``."""
        return f"{self.start:.3f} to {self.end:.3f} s"


Shown = tuple[Markup, str]
"""A picture, and what is seen on it."""

Still = Callable[[Fault, bool], Shown]
Look = Callable[[Fault], Markup]
"""Picture of a fault, larger where it is the first of a page; and how to see it in motion."""


@dataclass(frozen=True)
class Contact:
    """A contact that a detector reports."""

    pair: Pair
    start: float
    end: float


@dataclass(frozen=True)
class Hero:
    """The top of a page where there is no answer about a detector, or beside one."""

    sentence: str
    lines: Sequence[str] = ()


@dataclass(frozen=True, eq=False)
class RunView:
    """A run as far as its page tells of it; mappings are by the label of a detector."""

    summary: Mapping[str, Any]  # what ``summary.json`` holds
    oracle: str  # label of the reference, or ``""``
    ranking: tuple[Rank, ...]  # the audited detectors, the worst first, and the reference last
    answers: tuple[Answer, ...]  # what is said first of each audited detector, in the order of the ranking
    faults: Mapping[str, Sequence[Fault]]  # of every audited detector, false contacts first
    contacts: Mapping[str, Sequence[Contact]]  # of every detector, in order of time; of the reference those not held
    events: Sequence[Mapping[str, Any]]  # what effects found, rows of the table of events
    name: str  # what pages call the session
    hero: Hero | None  # what stands first in place of an answer
    doubts: Sequence[str]  # what a reader must know before the answer
    notes: Sequence[str]  # what was not counted, or is chance
    folder: str = "RUN"  # the run folder, as a command names it

    @property
    def title(self) -> str:
        """What the page says first, and whose session it is."""
        sentence = self.answers[0].sentence if self.hero is None else self.hero.sentence
        return f"{sentence.rstrip('.')}. Replay of {self.name}"


def faults_of(labels: Iterable[str], misses: Rows, false: Rows) -> dict[str, list[Fault]]:
    """Faults of detectors, from the rows of their tables."""
    found: dict[str, list[Fault]] = {label: [] for label in labels}
    for kind, rows in ((FALSE, false), (MISS, misses)):
        for row in rows:
            why = row.get("why") or row["cause"]
            noise = f" With tracker noise: {row['noise']}." if row.get("noise") else ""
            found.setdefault(row["detector"], []).append(
                Fault(
                    label=row["detector"], kind=kind, number=row["number"], pair=(row["body_a"], row["body_b"]),
                    start=row["start"], end=row["end"], frames=row["last"] - row["first"] + 1, what=row["kind"],
                    unconfirmed=row["cause"] == VOLUMES, why=f"{why}{noise}",
                )
            )  # fmt: skip
    return found


def contacts_of(labels: Iterable[str], episodes: Rows, oracle: str) -> dict[str, list[Contact]]:
    """Contacts of detectors, from the rows of their table; those of the reference without a hand and what it holds."""
    found: dict[str, list[Contact]] = {label: [] for label in labels}
    for row in episodes:
        if not (row["held"] and row["detector"] == oracle):
            contact = Contact((row["body_a"], row["body_b"]), row["start"], row["end"])
            found[row["detector"]].append(contact)
    return found


def findings_of(summary: Mapping[str, Any]) -> list[Finding]:
    """What the doctor said of the recording, the worst first; a code of another version is left out."""
    return [
        Finding(
            code=row["code"], own_severity=Severity[row["severity"].upper()], message=row["message"],
            body=row["body"] or "", start=row.get("start"), end=row.get("end"), count=row.get("count", 1),
        )
        for row in summary.get("findings", ())
        if row["code"] in CODES
    ]  # fmt: skip


def faults_by_pair(view: RunView, label: str) -> list[list[Fault]]:
    """Faults of each pair, the longest first; before all else the pair and the fault that the answer is about."""
    answer = next(answer for answer in view.answers if answer.label == label)
    first = None if answer.moment is None else (answer.moment.kind, answer.moment.number)

    def weight(fault: Fault) -> tuple[bool, bool, int, int]:
        same_kind = first is not None and fault.kind == first[0]
        return (fault.kind, fault.number) == first, same_kind, fault.frames, -fault.number

    groups: dict[Pair, list[Fault]] = {}
    for fault in sorted(view.faults[label], key=weight, reverse=True):
        groups.setdefault(fault.pair, []).append(fault)
    return [*groups.values()]


def key_fault(view: RunView, answer: Answer) -> Fault | None:
    """The fault that an answer is about."""
    if answer.moment is None:
        return None
    key = answer.moment.kind, answer.moment.number
    return next((fault for fault in view.faults[answer.label] if (fault.kind, fault.number) == key), None)


def fault_address(view: RunView, fault: Fault) -> str:
    """Where a page has a fault; the detector that was asked first needs no name."""
    first = next(iter(view.summary["audit"]))
    return address(fault.kind, fault.number, "" if fault.label == first else fault.label)


def spans(view: RunView, label: str, pair: Pair | None = None) -> dict[str, list[Span]]:
    """Stretches of a detector's lane by kind, or of the reference's; of one pair or of all."""
    own, reference = (
        [contact for contact in view.contacts.get(name, ()) if pair is None or contact.pair == pair]
        for name in (label, view.oracle)
    )
    if label == view.oracle or not view.oracle:
        return {"reference" if view.oracle else "contact": [(contact.start, contact.end) for contact in own]}
    found: dict[str, list[Span]] = {"right": [*_shared(reference, own)], "missed": [], "late": [], "false": []}
    for fault in view.faults[label]:
        if pair is None or fault.pair == pair:
            found[fault.stretch].append((fault.start, fault.end))
    return found


def _shared(reference: Sequence[Contact], found: Sequence[Contact]) -> Iterator[Span]:
    """When both report contact of a pair."""
    of_pair: dict[Pair, list[Contact]] = {}
    for contact in found:
        of_pair.setdefault(contact.pair, []).append(contact)
    for contact in reference:
        for other in of_pair.get(contact.pair, ()):
            if other.start >= contact.end:
                break
            if other.end > contact.start:
                yield max(contact.start, other.start), min(contact.end, other.end)
