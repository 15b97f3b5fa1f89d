"""``RunDocument``: a run as data, all that ``summary.json`` holds."""

from typing import Any, Final

from msgspec import field

from replay.auditing.record import Count, Counts, Digest, Record, Seconds
from replay.document.answer import Answer
from replay.document.audit import DetectorAudit, PairAudit
from replay.document.detector import DetectorRecord
from replay.document.session import (
    EffectRecord,
    FindingRecord,
    FlaggedPoses,
    NoiseRecord,
    PlanRecord,
    SessionRecord,
    SettingsRecord,
    Window,
)

SCHEMA: Final = "vrlab-replay/run/2"
TRADEOFF_SCHEMA: Final = "vrlab-replay/advice/3"


class ContactLengths(Record, frozen=True):
    """Contacts of a pair: how many, their seconds together, the longest, and how many lost poses cut."""

    count: Count
    seconds: Seconds
    longest: Seconds
    cut: Count


class PairRecord(Record, frozen=True):
    """A pair of bodies; mappings are by the label of a detector.

    Parameters
    ----------
    name : ``rod-beaker``, or ``hand-beaker`` of a group and a body.
    group : of a member's pair the pair of its group, which counts its contacts; else ``""``.
    grasp : whether it is a hand and what it holds, at any time.
    containment : whether a detector decides of the pair if one body is inside the other.
    contacts : without those of a hand and what it holds.
    grasped_contacts : these.
    audit : of the audited detectors.
    """

    name: str
    grasp: bool
    containment: dict[str, str]
    contacts: dict[str, ContactLengths] = field(default_factory=dict)
    grasped_contacts: dict[str, ContactLengths] = field(default_factory=dict)
    audit: dict[str, PairAudit] = field(default_factory=dict)
    group: str = ""


class TradeoffRecord(Record, frozen=True, tag_field="schema", tag=TRADEOFF_SCHEMA):
    """Every setting that was tried, with what it misses and takes, as ``replay.document.run_result.Tradeoff``."""

    answer: str
    advice: tuple[str, ...]
    front: tuple[str, ...]
    cut: tuple[str, ...]
    rows: tuple[dict[str, Any], ...]
    about: dict[str, Any]


class StoredTable(Record, frozen=True):
    """A table of the run folder that holds facts of the document: its Parquet file, and its number of rows."""

    file: str
    rows: Count


class RunDocument(Record, frozen=True, kw_only=True, tag_field="schema", tag=SCHEMA):
    """A run: settings, seeds, counts, times, digests and answers; mappings are by the label of a detector.

    Parameters
    ----------
    caveat, intervals : sentences for whoever reads the numbers.
    window, seed, tau : of the settings, those that decide answers.
    oracle : label of the reference, or ``""``.
    audit : of all detectors but the reference.
    noise : ``None``: no noisy copies were asked for.
    policy : kind of doubt about a pose -> what is done with it.
    findings, flagged : what is in doubt about the recording.
    flagged_verdicts : verdicts that rest on a pose in doubt.
    answers : of the audited detectors, the worst first, each with the moment that shows it.
    tables : contacts, missed contacts, false contacts and events, by name of the table; each row is a
        ``ContactRecord``, a ``Fault`` or an ``EventRecord``.
    request : by it a batch knows the run folders that it need not make again.
    open_questions : guesses of an import that change the contacts; ``guesses`` sums up the others.
    tradeoff : what other settings miss and take, where that was measured.
    picture_sha256 : of the recording for Rerun; ``None``: the run was written without one.
    files : all of the run folder.
    """

    caveat: str
    intervals: str
    session: SessionRecord
    settings: SettingsRecord
    window: Window
    seed: int
    tau: Seconds
    pairs: tuple[PairRecord, ...]
    oracle: str
    detectors: dict[str, DetectorRecord]
    audit: dict[str, DetectorAudit]
    noise: NoiseRecord | None
    policy: dict[str, str]
    findings: tuple[FindingRecord, ...]
    flagged: tuple[FlaggedPoses, ...]
    flagged_verdicts: dict[str, Counts]
    versions: dict[str, str]
    machine: dict[str, str | int]
    plan: PlanRecord
    effects: dict[str, EffectRecord]
    answers: tuple[Answer, ...]
    tables: dict[str, StoredTable] = field(default_factory=dict)
    open_questions: tuple[str, ...] = ()
    guesses: tuple[str, ...] = ()
    request: str = ""
    tradeoff: TradeoffRecord | None = None
    picture_sha256: Digest | None = None
    files: tuple[str, ...] = ()
