"""Result of a run: detections, the audit between them, effects, a document, and what other settings cost."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Final, Protocol, cast

from cdcore import Detection, Detector
from replay.auditing.causes import Causes
from replay.auditing.contact_counts import ContactCounts
from replay.auditing.contact_depth import ContactDepth, DepthsByPairAndFrame
from replay.auditing.fault import Fault
from replay.auditing.flicker import Flicker
from replay.auditing.matching import EpisodeMatches
from replay.auditing.noisy_contacts import NoiseResult
from replay.auditing.outcome import Comparison, Episode
from replay.auditing.sampling_offsets import OffsetCounts
from replay.auditing.tolerance import Reference
from replay.document.answer import Answer
from replay.document.contact import ContactRecord, EventRecord, contacts_by_detector, events_of
from replay.document.ranking import Rank
from replay.document.run_document import TRADEOFF_SCHEMA, RunDocument, TradeoffRecord
from replay.document.tables import Table
from replay.effects.effects_runner import EffectRun
from replay.prepare.assembly import Assembly
from replay.prepare.flags import Flags
from replay.prepare.repair import Repair
from sessions import Session


@dataclass(frozen=True, eq=False)
class Tradeoff:
    """Faults and times of every setting that was tried.

    Parameters
    ----------
    rows : one per setting that was tried, by loss and then by mean time: plain data, the columns of
        ``tradeoff.parquet``.
    front : labels, quickest first: each has a smaller loss than all before it.
    advice : sentences: what being right costs and what less costs, or why there is no advice.
    cut : labels that the time limit left out.
    about : session, oracle, machine, versions, seed, ``clock`` (its self-check) and ``processor_share``: of the seconds
        on the clock those in which this process was at work; far below 1, others were, and times are upper bounds.
    """

    rows: tuple[dict[str, Any], ...]
    front: tuple[str, ...]
    advice: tuple[str, ...]
    cut: tuple[str, ...] = ()
    about: dict[str, Any] = field(default_factory=dict)

    @property
    def answer(self) -> str:
        """The first sentence of the advice, without its full stop."""
        return self.advice[0].removesuffix(".")

    @property
    def record(self) -> TradeoffRecord:
        """All of it, as the document of a run has it."""
        return TradeoffRecord(
            answer=self.answer, advice=self.advice, front=self.front, cut=self.cut, rows=self.rows, about=self.about
        )

    def as_json(self) -> dict[str, Any]:
        """Everything as plain data."""
        lists = {name: list(getattr(self, name)) for name in ("advice", "front", "cut", "rows")}
        return {"schema": TRADEOFF_SCHEMA, **self.about, "answer": self.answer, **lists}


class Summarised(Protocol):
    """A run as far as its document tells of it: in memory, or read again from its folder."""

    @property
    def document(self) -> RunDocument:
        """Everything that ``summary.json`` holds."""

    @property
    def oracle(self) -> str:
        """Label of the detection the others are compared with, or ``""``."""

    @property
    def ranking(self) -> tuple[Rank, ...]:
        """The audited detectors, the worst first, and the oracle last."""

    @property
    def answers(self) -> tuple[Answer, ...]:
        """First sentences about each audited detector, in the order of the ranking."""

    @property
    def contacts(self) -> Mapping[str, Sequence[ContactRecord]]:
        """Contacts of every detector, in order of time."""

    @property
    def faults(self) -> Mapping[str, Sequence[Fault]]:
        """Faults of every audited detector, false contacts first."""

    @property
    def events(self) -> Sequence[EventRecord]:
        """Events of the recording and of the effects, in order of time."""


NO_DOCUMENT: Final = cast("RunDocument", None)
"""Stands in a result until everything else in it is computed."""


@dataclass(frozen=True, eq=False)
class RunResult:
    """The outcome of ``replay.run``: all that it computed, each fact once, and where it was written.

    Mappings are by the label of a detector. ``document`` holds settings, seeds, counts, digests and machine;
    ``tradeoff`` is what other settings would have missed and taken, where that was measured; ``out`` is the run folder,
    or ``None`` when nothing was written.
    """

    session: Session  # what was replayed
    assembly: Assembly  # bodies, motion and pairs that the detectors saw
    detections: Mapping[str, Detection]  # in the order asked for; all on the frames of ``assembly``
    repaired: Repair  # the findings of the doctor, and what the policy did about them
    flags: Flags  # which verdicts rest on a pose in doubt
    oracle: str  # label of the detection the others are compared with, or ``""``
    episodes: Mapping[str, tuple[Episode, ...]]  # contacts of every detection
    detectors: Mapping[str, Detector] = field(default_factory=dict)  # ready to be asked again
    comparisons: Mapping[str, Comparison] = field(default_factory=dict)  # with the oracle
    misses: Mapping[str, tuple[Fault, ...]] = field(default_factory=dict)  # numbered, in order of time
    false: Mapping[str, tuple[Fault, ...]] = field(default_factory=dict)  # numbered, in order of time
    matches: Mapping[str, EpisodeMatches] = field(default_factory=dict)  # episodes matched one to one with the oracle's
    causes: Mapping[str, Causes] = field(default_factory=dict)  # why each miss was missed
    phases: Mapping[str, OffsetCounts] = field(default_factory=dict)  # of a fixed rate: faults at each sampling offset
    reference: Reference | None = None  # the oracle's contacts, and what is within tolerance of them
    counts: Mapping[str, ContactCounts] = field(default_factory=dict)  # what became of the oracle's contacts
    holdings: tuple[Episode, ...] = ()  # when a pair is a hand and what it holds; contacts there are counted apart
    not_grasped: tuple[Episode, ...] = ()  # the oracle's contacts but those of a hand with what it holds
    effects: Mapping[str, EffectRun] = field(default_factory=dict)  # by kind, in running order
    depths: tuple[ContactDepth, ...] = ()  # of each contact of the oracle; none without an audit
    depth_series: DepthsByPairAndFrame = field(
        default_factory=dict
    )  # of the oracle's contacts and the misses, over time
    flicker: Mapping[str, Flicker] = field(default_factory=dict)  # of the detectors whose contacts are interrupted
    noise: NoiseResult | None = None  # what holds in spite of tracker noise, where that was asked for
    tables: Mapping[str, Table] = field(default_factory=dict)  # by name: ``episodes misses false events``
    document: RunDocument = NO_DOCUMENT  # made of all the others
    ranking: tuple[Rank, ...] = ()  # the worst audited detector first, the oracle last; none without an audit
    answers: tuple[Answer, ...] = ()  # of each audited detector, in the order of the ranking
    tradeoff: Tradeoff | None = None
    out: Path | None = None

    @cached_property
    def contacts(self) -> Mapping[str, Sequence[ContactRecord]]:
        """Contacts of every detector, in order of time."""
        return contacts_by_detector(self.tables["episodes"].plain(), self.detections)

    @cached_property
    def faults(self) -> Mapping[str, Sequence[Fault]]:
        """Faults of every audited detector, false contacts first."""
        return {label: (*self.false[label], *self.misses[label]) for label in self.comparisons}

    @cached_property
    def events(self) -> Sequence[EventRecord]:
        """Events of the recording and of the effects, in order of time."""
        return events_of(self.tables["events"].plain())
