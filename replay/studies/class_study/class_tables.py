"""The tables of a class: which pairs are missed, how detectors differ, in what tasks, and how good the recordings are.

Every figure has a 95 % interval over students below it, and ``n``: the students whose rows it counts. Rows of fewer
than five students say so and nothing else.
"""

import os
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Final
from urllib.parse import quote

import numpy as np

from replay.outputs.results.run_folder import REPORT
from replay.outputs.tables import Cell, Marked, Table, table
from replay.outputs.words import address
from replay.pipeline.gates import figure
from replay.pipeline.sentences import plural
from replay.studies.class_study.class_runs import ClassRuns, Row, grouped, grouped_by, missed_by
from replay.studies.class_study.refusals import LEAST_IN_CELL, few
from replay.studies.class_study.resampling import Estimate, Resampling
from sessions.mcap_format.metadata import NOT_STATED

FIGURES: Final = "n: students whose rows are counted. Below a figure: 95 % intervals, students drawn anew."
FAULTS: Final = {"misses": "miss", "false_contacts": "false contact"}
NOT_SHOWN: Final = "not shown"
"""Stands for the students of a row that would tell, less from a total, what a row of few students may not."""

NONE: Final = "none"
"""Stands for a task or a stage where no span says one, and for a cause that is not known."""

Write = Callable[[float], str]

ABOUT_RECORDINGS: Final = (
    "A row is a link to one recording, and no figure of it: what is counted of fewer than five students is not shown."
)

Place = tuple[str, str]
"""Name and address of a session's page."""


def percent(value: float) -> str:
    """A share in percent: ``2.6 %``."""
    return f"{figure(100.0 * value)} %"


def plain(value: float) -> str:
    """A number with three digits."""
    return f"{value:.3g}"


def cell(estimate: Estimate, write: Write = plain, counts: str = "", unit: str = "") -> Cell:
    """A figure with its interval below it; ``counts``, what it was made from, then stand in its place."""
    if not estimate.students:
        return NONE
    said, between = write(estimate.value) + unit, f"{write(estimate.low)} to {write(estimate.high)}"
    return Marked(counts, below=f"{said} ({between})") if counts else Marked(said, below=between)


def class_counts(runs: ClassRuns) -> str:
    """Students, sessions and contacts, as the first words of page and terminal; contacts not of few students."""
    counts = f"{few(len(runs.students))} students, {plural(len(runs.metrics), 'session')}"
    contacts = sum(bool(row["student"]) for row in runs.tables["episodes"])
    return counts if len(runs.students) < LEAST_IN_CELL else f"{counts}, {plural(contacts, 'contact')}"


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
        said = []
        for label in self.runs.audited:
            one = self._never(label, self._contacts(label))[1]
            if one.students >= LEAST_IN_CELL:
                between = f"{percent(one.low)} to {percent(one.high)}, n = {one.students}"
                said.append(f"{label} misses {percent(one.value)} of the contacts ({between}).")
        return said

    def sample(self) -> dict[str, str]:
        """What the sessions say of the sample, by the words of Table II."""
        scenes, types = (", ".join(dict.fromkeys(self.runs.of(run, name) or NOT_STATED for run in self.runs.metrics))
                         for name in ("scene", "vr_type"))  # fmt: skip
        return {"content": scenes, "device": f"VR type: {types}"}

    def detectors(self) -> Table:
        """A row per detector, the trusted ones first."""
        trusted = dict.fromkeys(one for run in self.runs.metrics if (one := self.runs.of(run, "oracle")))
        rows = []
        for label in dict.fromkeys((*trusted, *self.runs.audited)):
            cells = [self._a_minute(label), *[""] * 4]
            if label not in trusted:
                faults = ([row for row in self._rows[name] if row["detector"] == label] for name in FAULTS)
                cells[1:] = [self._a_minute(label, less=True), self._never(label, self._contacts(label))[0],
                             *(self._rate(some, label) for some in faults)]  # fmt: skip
            heads = (label, "trusted" if label in trusted else "audited")
            rows.append(_Row(label, heads, self._sessions(label), cells))
        head = (
            "detector", "is", "n", "sessions", "contacts a minute", "against trusted", "contacts never found", "misses",
            "false contacts",
        )  # fmt: skip
        note = "Contacts a minute: the mean over students, each by the mean of their sessions."
        return table(FIGURES, head, _shown(rows), words=2, notes=(note,))

    def pairs(self) -> Table:
        """A row per detector and pair that it missed, those missed most first."""
        touched, rows = grouped(self._rows["episodes"], "body_a", "body_b"), []
        for (label, a, b), misses in grouped(self._rows["misses"], "detector", "body_a", "body_b").items():
            contacts = [row for row in touched.get((a, b), ()) if label in self.runs.metrics[row["run"]]]
            every, hit = self._with([*contacts, *misses]), self._with(misses)
            where = cell(self._drawn.ratio(hit, every), percent, f"{hit.total()} of {every.total()}")
            cells = [self._rate(misses, label), where, self._never(label, contacts)[0]]
            rows.append(_Row(label, (f"{a} - {b}", label), every, cells))
        head = ("pair", "detector", "n", "sessions", "misses", "sessions with a miss", "contacts never found")
        return table(FIGURES, head, _shown(rows), words=2)

    def doing(self) -> Table:
        """A row per task, stage and VR type: how many contacts, how long, how many missed by any detector."""
        types = {run: self.runs.of(run, "vr_type") or NOT_STATED for run in self.runs.metrics}
        contacts, rows = self._rows["episodes"], []
        kinds = {kind: grouped(contacts, kind) for kind in ("task", "stage")}
        kinds["VR type"] = grouped_by(contacts, lambda row: (types[row["run"]],))
        for kind, groups in kinds.items():
            for (value,), found in groups.items():
                lasted = {who: float(np.median([row["end"] - row["start"] for row in own]))
                          for (who,), own in grouped(found, "student").items()}  # fmt: skip
                cells = [self._rate(found), *self._middle(lasted, plain), self._never("", found)[0]]
                rows.append(_Row(kind, (kind, NONE if value is None else value), self._with(found), cells))
        head = ("what", "which", "n", "sessions", "contacts", "lasting s", "middle half s", "missed by any")
        note = (
            "Lasting: the middle student, each by the median of their contacts; half of the students are in the middle."
        )
        return table(FIGURES, head, _shown(rows), words=2, notes=(note,))

    def causes(self) -> Table:
        """A row per cause of misses and of false contacts."""
        rows = [
            _Row(word + label, (word, label, kind, cause or NONE), self._with(found), [self._rate(found, label)])
            for name, word in FAULTS.items()
            for (label, kind, cause), found in grouped(self._rows[name], "detector", "kind", "cause").items()
        ]
        head = ("what", "detector", "kind", "cause", "n", "sessions", "how many")
        return table(FIGURES, head, _shown(rows), words=4)

    def events(self) -> Table:
        """A row per task and recorded event."""
        rows = [
            _Row(f"{task} {name}", (NONE if task is None else task, name), self._with(found), [self._rate(found)])
            for (task, name), found in grouped(self._rows["events"], "task", "name").items()
        ]
        return table(FIGURES, ("task", "event", "n", "sessions", "times"), _shown(rows), words=2)

    def quality(self) -> Table:
        """How far the recordings can be trusted."""
        asked = {
            "minutes tracked, a session": ("valid_minutes", plain),
            "poses not recorded": ("flagged_share", percent),
        }
        rows = []
        for words, (name, write) in asked.items():
            firsts = {run: next(iter(found.values()))[name] for run, found in self.runs.metrics.items()}
            rows.append(_Row(words, (words,), self._sessions(), self._middle(self._means(firsts.get), write)))
        contacts = self._rows["episodes"]
        doubted = cell(
            self._drawn.ratio(_students(row for row in contacts if row["flag"]), _students(contacts)), percent
        )
        rows.append(_Row("doubt", ("contacts with a pose in doubt",), self._with(contacts), [doubted, ""]))
        notes = ("Of a session: the middle student, each by the mean of their sessions.", *self._left_out())
        return table(FIGURES, ("what", "n", "sessions", "figure", "middle half"), _shown(rows), notes=notes)

    def _left_out(self) -> list[str]:
        """What is not in the figures, and what makes them hard to compare."""
        runs, said = self.runs, []
        if nobody := len(runs.metrics) - len(self._owner):
            where = "they are in the list of sessions and in no figure"
            said.append(f"{nobody} of {len(runs.metrics)} sessions state no pseudonym: {where}.")
        if runs.repeated:
            said.append(f"Runs left out because their session is there already: {runs.repeated}.")
        if runs.unmeasured:
            said.append(f"Runs left out because they have no metrics: {runs.unmeasured}.")
        settings = {(label, row["settings"]) for found in runs.metrics.values() for label, row in found.items()}
        mixed = sorted(label for label, count in Counter(label for label, _ in settings).items() if count > 1)
        if mixed:
            said.append(f"Not run with the same settings and versions in all sessions: {', '.join(mixed)}.")
        return said

    def _contacts(self, label: str) -> list[Row]:
        """Contacts of the trusted detector in sessions that a detector saw."""
        return [row for row in self._rows["episodes"] if label in self.runs.metrics[row["run"]]]

    def _sessions(self, label: str = "") -> Counter[str]:
        """Student -> sessions, all or those that a detector saw."""
        seen = self.runs.metrics
        return Counter(student for run, student in self._owner.items() if not label or label in seen[run])

    def _with(self, rows: Iterable[Row]) -> Counter[str]:
        """Student -> sessions in which there is such a row."""
        return Counter(self._owner[run] for run in set(map(itemgetter("run"), rows)))

    def _rate(self, rows: Sequence[Row], label: str = "") -> Cell:
        """How many rows, and how many that are a session."""
        estimate = self._drawn.ratio(_students(rows), self._sessions(label))
        return cell(estimate, "{:.2g}".format, str(len(rows)), " a session")

    def _never(self, label: str, contacts: Sequence[Row]) -> tuple[Cell, Estimate]:
        """Contacts that a detector never finds, ``""``: that any does not, as counts and as a share."""
        lost = _students(row for row in contacts if missed_by(row, label))
        found = self._drawn.ratio(lost, _students(contacts))
        return cell(found, percent, f"{lost.total()} of {len(contacts)}"), found

    def _means(self, value: Callable[[str], float | None]) -> dict[str, float]:
        """Student -> mean of a value of their runs, of those that have it."""
        values: dict[str, list[float]] = {}
        for run, student in self._owner.items():
            if (found := value(run)) is not None:
                values.setdefault(student, []).append(found)
        return {student: float(np.mean(some)) for student, some in values.items()}

    def _a_minute(self, label: str, *, less: bool = False) -> Cell:
        """Contacts a minute that a detector sees; ``less``: how many more than the trusted one."""

        def seen(run: str) -> float | None:
            found, oracle = self.runs.metrics[run], self.runs.of(run, "oracle")
            own, other = (found.get(one, {}).get("contacts_per_min") for one in (label, oracle))
            return own if not less else None if own is None or other is None else float(own - other)

        means = self._means(seen)
        return cell(self._drawn.ratio(means, dict.fromkeys(means, 1.0)), "{:+.2f}".format if less else plain)

    def _middle(self, values: Mapping[str, float], write: Write) -> list[Cell]:
        """The middle student, and between what half of the students are."""
        half = np.quantile(list(values.values()) or [0.0], (0.25, 0.75))
        return [cell(self._drawn.median(values), write), " to ".join(map(write, half.tolist()))]


def _students(rows: Iterable[Row]) -> Counter[str]:
    """Student -> how many rows."""
    return Counter(map(itemgetter("student"), rows))


@dataclass(frozen=True)
class _Row:
    """A row: whose total it is a part of, its words, its students with their sessions, and its figures."""

    whole: str
    heads: Sequence[str]
    sessions: Mapping[str, int]
    cells: Sequence[Cell]


def _shown(rows: Sequence[_Row]) -> list[list[Cell]]:
    """The rows as cells: of few students their number is all a row says.

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
    return [_cells(row, hide=k in hidden) for k, row in enumerate(rows)]


def _cells(row: _Row, *, hide: bool) -> list[Cell]:
    if not hide:
        return [*row.heads, len(row.sessions), sum(row.sessions.values()), *row.cells]
    count = len(row.sessions)
    told = few(count) if count < LEAST_IN_CELL else NOT_SHOWN
    return [*row.heads, told, *[""] * (1 + len(row.cells))]


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
    misses = {(run, label): found for (run, label), found in grouped(runs.tables["misses"], "run", "detector").items()}
    rows: dict[str, list[Cell]] = {}
    for run, detectors in runs.metrics.items():
        audited = [label for label in detectors if runs.of(run, "oracle") not in ("", label)]
        label = max(audited, key=lambda one: len(misses.get((run, one), ())), default="")
        found = misses.get((run, label), [])
        name, page = where[run]
        look: Cell = "nothing missed" if audited else "not audited"
        if found:
            look = _look(min(found, key=_depth), page, "" if label == audited[0] else label)
        rows[run] = [Marked(name, to=page), look, label]
    most = sorted(rows, key=lambda run: (-len(misses.get((run, str(rows[run][2])), ())), run))
    students, chosen = set[str](), list[str]()
    for run in most:
        if len(students) >= LEAST_IN_CELL and len(chosen) >= LEAST_IN_CELL:
            break
        chosen.append(run)
        # A session of nobody may be of anybody already there.
        students |= {runs.of(run, "student")} - {""}
    return table(
        "Sessions with most misses, by name", ("session", "look at", "by"), [rows[run] for run in sorted(chosen)],
        words=3, notes=(ABOUT_RECORDINGS,),
    )  # fmt: skip


def _depth(miss: Row) -> tuple[bool, float, int]:
    """The longest cut first, as the cards of a report; one that no frame shows has none."""
    return miss["touch"] is not None, -(miss["cut_length"] or 0.0), miss["number"]


def _look(miss: Row, page: str, by: str) -> Marked:
    words = f"{miss['body_a']} - {miss['body_b']} at {miss['start']:.2f} s"
    at = address("miss", miss["number"], quote(by))
    return Marked(words, below=f"miss {miss['number']}, {miss['kind']}", to=f"{page}#{at}")
