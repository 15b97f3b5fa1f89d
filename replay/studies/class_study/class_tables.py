"""The tables of a class: which pairs are missed, how detectors differ, in what tasks, and why.

Every figure has a 95 % interval over students below it, and ``n``: the students whose rows it counts. Rows of fewer
than five students say so and nothing else.
"""

import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from urllib.parse import quote

import numpy as np

from replay.outputs.results.run_folder import REPORT
from replay.outputs.tables import Cell, Column, Marked, Table
from replay.outputs.words import address
from replay.pipeline.gates import figure
from replay.pipeline.sentences import plural
from replay.studies.class_study.class_runs import ClassRuns, Row, grouped, missed_by
from replay.studies.class_study.refusals import LEAST_IN_CELL, few
from replay.studies.class_study.resampling import Estimate, Resampling
from sessions.mcap_format.metadata import NOT_STATED

FIGURES: Final = "n: students whose rows are counted. Below a figure: 95 % intervals, students drawn anew."
FAULTS: Final = {"misses": "miss", "false_contacts": "false contact"}
NOT_SHOWN: Final = "not shown"
"""Stands for the students of a row that would tell, less from a total, what a row of few students may not."""

NONE: Final = "none"
"""Stands for a task or a stage where no span says one, and for a cause that is not known."""

ABOUT_RECORDINGS: Final = (
    "A row is a link to one recording, and no figure of it: what is counted of fewer than five students is not shown."
)

Place = tuple[str, str]
"""Name and address of a session's page."""


def percent(value: float) -> str:
    """A share in percent: ``2.6 %``."""
    return f"{figure(100.0 * value)} %"


def rate(value: float) -> str:
    """How many a session."""
    return f"{value:.2g} a session"


def cell(estimate: Estimate, write: Callable[[float], str], counts: str = "") -> Cell:
    """A figure with its interval below it; ``counts``, what it was made from, then stand in its place."""
    if not estimate.students:
        return NONE
    value, low, high = map(write, (estimate.value, estimate.low, estimate.high))
    return Marked(counts, below=f"{value} ({low} to {high})") if counts else Marked(value, below=f"{low} to {high}")


def class_counts(runs: ClassRuns) -> str:
    """Students, sessions and contacts, as the first words of page and terminal; contacts not of few students."""
    counts = f"{few(len(runs.students))} students, {plural(len(runs.metrics), 'session')}"
    contacts = sum(bool(row["student"]) for row in runs.tables["episodes"])
    return counts if len(runs.students) < LEAST_IN_CELL else f"{counts}, {plural(contacts, 'contact')}"


@dataclass(frozen=True)
class _Row:
    """A row: whose total it is a part of, its words, its students with their sessions, and its figures."""

    whole: str
    heads: tuple[str, ...]
    sessions: Mapping[str, int]
    cells: tuple[Cell, ...]


class ClassTables:
    """The tables of the sessions of a class; ``seed`` is that of the draws. Rows of nobody count in the list alone."""

    def __init__(self, runs: ClassRuns, seed: int = 0) -> None:
        self.runs = runs
        self._drawn = Resampling(runs.students, seed)
        owners = ((run, runs.of(run, "student")) for run in runs.metrics)
        self._owner = {run: student for run, student in owners if student}
        self._rows = {name: [row for row in rows if row["student"]] for name, rows in runs.tables.items()}

    def headlines(self) -> list[str]:
        """What each audited detector never finds."""
        lines = []
        for label in self.runs.audited:
            share = self._never(label, self._contacts(label))[1]
            if share.students >= LEAST_IN_CELL:
                between = f"{percent(share.low)} to {percent(share.high)}, n = {share.students}"
                lines.append(f"{label} misses {percent(share.value)} of the contacts ({between}).")
        return lines

    def sample(self) -> dict[str, str]:
        """What the sessions say of the sample, by the words of Table II."""

        def stated(name: str) -> str:
            return ", ".join(dict.fromkeys(self.runs.of(run, name) or NOT_STATED for run in self.runs.metrics))

        return {"content": stated("scene"), "device": f"VR type: {stated('vr_type')}"}

    def detectors(self) -> Table:
        """A row per detector, the trusted ones first."""
        trusted = dict.fromkeys(oracle for run in self.runs.metrics if (oracle := self.runs.of(run, "oracle")))
        rows = []
        for label in dict.fromkeys((*trusted, *self.runs.audited)):
            cells = [self._a_minute(label), "", "", ""]
            if label not in trusted:
                faults = ([row for row in self._rows[name] if row["detector"] == label] for name in FAULTS)
                cells[1:] = [self._never(label, self._contacts(label))[0], *(self._rate(own, label) for own in faults)]
            heads = (label, "trusted" if label in trusted else "audited")
            rows.append(_Row(label, heads, self._sessions(label), tuple(cells)))
        note = "Contacts a minute: the mean over students, each by the mean of their sessions."
        figures = ("contacts a minute", "contacts never found", "misses", "false contacts")
        return _table(("detector", "is"), figures, rows, (note, *self._left_out()))

    def pairs(self) -> Table:
        """A row per detector and pair that it missed, those missed most first."""
        touched, rows = grouped(self._rows["episodes"], "body_a", "body_b"), []
        for (label, a, b), misses in grouped(self._rows["misses"], "detector", "body_a", "body_b").items():
            contacts = [row for row in touched.get((a, b), ()) if label in self.runs.metrics[row["run"]]]
            every, hit = self._with([*contacts, *misses]), self._with(misses)
            where = cell(self._drawn.ratio(hit, every), percent, f"{hit.total()} of {every.total()}")
            cells = (self._rate(misses, label), where, self._never(label, contacts)[0])
            rows.append(_Row(label, (f"{a} - {b}", label), every, cells))
        figures = ("misses", "sessions with a miss", "contacts never found")
        return _table(("pair", "detector"), figures, rows)

    def doing(self) -> Table:
        """A row per task, stage and VR type: how many contacts, how many missed by any detector."""
        rows = []
        for kind in ("task", "stage", "vr_type"):
            for (value,), found in grouped(self._rows["episodes"], kind).items():
                heads = (kind.replace("vr_type", "VR type"), value or (NOT_STATED if kind == "vr_type" else NONE))
                rows.append(_Row(kind, heads, self._with(found), (self._rate(found), self._never("", found)[0])))
        return _table(("what", "which"), ("contacts", "missed by any"), rows)

    def causes(self) -> Table:
        """A row per cause of misses and of false contacts."""
        rows = [
            _Row(word + label, (word, label, kind, cause or NONE), self._with(found), (self._rate(found, label),))
            for name, word in FAULTS.items()
            for (label, kind, cause), found in grouped(self._rows[name], "detector", "kind", "cause").items()
        ]
        return _table(("what", "detector", "kind", "cause"), ("how many",), rows)

    def _left_out(self) -> Iterator[str]:
        """What is not in the figures, and what makes them hard to compare."""
        runs = self.runs
        if nobody := len(runs.metrics) - len(self._owner):
            where = "they are in the list of sessions and in no figure"
            yield f"{nobody} of {len(runs.metrics)} sessions state no pseudonym: {where}."
        if runs.repeated:
            yield f"Runs left out because their session is there already: {runs.repeated}."
        if runs.unmeasured:
            yield f"Runs left out because they have no metrics: {runs.unmeasured}."
        settings = {(label, row["settings"]) for found in runs.metrics.values() for label, row in found.items()}
        mixed = sorted(label for label, count in Counter(label for label, _ in settings).items() if count > 1)
        if mixed:
            yield f"Not run with the same settings and versions in all sessions: {', '.join(mixed)}."

    def _contacts(self, label: str) -> list[Row]:
        """Contacts of the trusted detector in sessions that a detector saw."""
        return [row for row in self._rows["episodes"] if label in self.runs.metrics[row["run"]]]

    def _sessions(self, label: str = "") -> Counter[str]:
        """Student -> sessions, all or those that a detector saw."""
        seen = self.runs.metrics
        return Counter(student for run, student in self._owner.items() if not label or label in seen[run])

    def _with(self, rows: Iterable[Row]) -> Counter[str]:
        """Student -> sessions in which there is such a row."""
        return Counter(self._owner[run] for run in {row["run"] for row in rows})

    def _rate(self, rows: Sequence[Row], label: str = "") -> Cell:
        """How many rows, and how many that are a session."""
        return cell(self._drawn.ratio(_students(rows), self._sessions(label)), rate, str(len(rows)))

    def _never(self, label: str, contacts: Sequence[Row]) -> tuple[Cell, Estimate]:
        """Contacts that a detector never finds, ``""``: that any does not."""
        lost = _students(row for row in contacts if missed_by(row, label))
        share = self._drawn.ratio(lost, _students(contacts))
        return cell(share, percent, f"{lost.total()} of {len(contacts)}"), share

    def _a_minute(self, label: str) -> Cell:
        """Contacts a minute that a detector sees."""
        values: dict[str, list[float]] = {}
        for run, student in self._owner.items():
            contacts = self.runs.metrics[run].get(label, {}).get("contacts_per_min")
            if contacts is not None:
                values.setdefault(student, []).append(contacts)
        means = {student: float(np.mean(rates)) for student, rates in values.items()}
        return cell(self._drawn.ratio(means, dict.fromkeys(means, 1.0)), "{:.3g}".format)


def _students(rows: Iterable[Row]) -> Counter[str]:
    """Student -> how many rows."""
    return Counter(row["student"] for row in rows)


def _table(heads: Sequence[str], figures: Sequence[str], rows: Sequence[_Row], notes: Iterable[str] = ()) -> Table:
    """The rows below their heads, with the students and sessions of each; of few students their number is all."""
    columns = [*(Column(name, whole=name == heads[0]) for name in heads)]
    columns += (Column(name, float) for name in ("n", "sessions", *figures))
    hidden, values = _hidden(rows), []
    for k, row in enumerate(rows):
        count = len(row.sessions)
        cells: tuple[Cell, ...] = (count, sum(row.sessions.values()), *row.cells)
        if k in hidden:
            cells = (few(count) if count < LEAST_IN_CELL else NOT_SHOWN, *[""] * (1 + len(row.cells)))
        values.append((*row.heads, *cells))
    return Table(tuple(columns), tuple(values), FIGURES, tuple(notes))


def _hidden(rows: Sequence[_Row]) -> set[int]:
    """Which rows show no figure.

    Rows of one whole add up to a figure that stands elsewhere: all but one of them would tell that one, 30 misses less
    26. So those that say nothing have to be of five students at least together, else the row of fewest says nothing
    either.
    """
    hidden = {k for k, row in enumerate(rows) if len(row.sessions) < LEAST_IN_CELL}
    for whole in dict.fromkeys(row.whole for row in rows):
        parts = [k for k, row in enumerate(rows) if row.whole == whole]
        left = sorted((k for k in parts if k not in hidden), key=lambda k: len(rows[k].sessions))
        inside = [k for k in parts if k in hidden]
        while inside and left and len({who for k in inside for who in rows[k].sessions}) < LEAST_IN_CELL:
            inside.append(left.pop(0))
        hidden |= set(inside)
    return hidden


def places(runs: ClassRuns, out: Path) -> dict[str, Place]:
    """Run -> name and address of its report, from a page in the folder ``out``."""
    found = {}
    for run in runs.metrics:
        # A run folder has the name of its session file, which may be a person's.
        name, page = runs.of(run, "session") or run, runs.top / run / REPORT
        found[run] = (name, quote(Path(os.path.relpath(page.resolve(), out.resolve())).as_posix()))
    return found


def sessions_table(runs: ClassRuns, where: Mapping[str, Place]) -> Table:
    """The sessions in which a detector misses most, of five students at least, by name: links, and no figure of one."""
    misses = grouped(runs.tables["misses"], "run", "detector")
    rows, counts = {}, {}
    for run, detectors in runs.metrics.items():
        name, page = where[run]
        audited = [label for label in detectors if runs.of(run, "oracle") not in ("", label)]
        label = max(audited, key=lambda label: len(misses.get((run, label), ())), default="")
        found = misses.get((run, label), [])
        look = Marked("nothing missed" if audited else "not audited")
        if found:
            look = _look(min(found, key=_depth), page, "" if label == audited[0] else label)
        rows[run], counts[run] = (Marked(name, to=page), look, label), len(found)
    students, chosen = set[str](), list[str]()
    for run in sorted(rows, key=lambda run: (-counts[run], run)):
        if len(students) >= LEAST_IN_CELL and len(chosen) >= LEAST_IN_CELL:
            break
        chosen.append(run)
        # A session of nobody may be of anybody already there.
        students |= {runs.of(run, "student")} - {""}
    columns = Column("session", whole=True), Column("look at"), Column("by")
    listed = tuple(rows[run] for run in sorted(chosen))
    return Table(columns, listed, "Sessions with most misses, by name", (ABOUT_RECORDINGS,))


def _depth(miss: Row) -> tuple[bool, float, int]:
    """The longest cut first, as the cards of a report; one that no frame shows has none."""
    return miss["touch"] is not None, -(miss["cut_length"] or 0.0), miss["number"]


def _look(miss: Row, page: str, by: str) -> Marked:
    words = f"{miss['body_a']} - {miss['body_b']} at {miss['start']:.2f} s"
    at = address("miss", miss["number"], quote(by))
    return Marked(words, below=f"miss {miss['number']}, {miss['kind']}", to=f"{page}#{at}")
