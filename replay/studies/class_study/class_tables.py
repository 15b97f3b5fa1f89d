"""The tables of a class: which pairs are missed, how detectors differ, in what tasks, and why.

Every figure has a 95 % interval over students below it, and ``n``: the students whose rows it counts. Rows of fewer
than five students say so and nothing else.
"""

import os
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from cdcore.numerics import FloatArray
from replay import words
from replay.auditing.fault import FaultKind
from replay.document.tables import Cell, Column, Marked, Table
from replay.show.report.markup import moment_address
from replay.show.results.run_folder import REPORT_FILE
from replay.studies.class_study.class_runs import ClassRuns, Row
from replay.studies.class_study.refusals import LEAST_IN_CELL, count_text
from replay.studies.class_study.resampling import Estimate, Resampling
from replay.words import plural
from sessions.mcap.metadata import NOT_STATED

FIGURES_NOTE: Final = "n: students whose rows are counted. Below a figure: its 95 % interval over students."
FAULT_BY_COUNT: Final = {"misses": "miss", "false_contacts": "false contact"}
SUPPRESSED_TEXT: Final = "not shown"
"""Stands for the students of a row that would tell, less from a total, what a row of few students may not."""

NO_NAME: Final = "none"
"""Stands for a task or a stage where no span says one, and for a cause that is not known."""

RECORDINGS_NOTE: Final = "Each row links to a recording. Figures of fewer than five students are not shown."

PageLink = tuple[str, str]
"""Name and address of a session's page."""

N_NOTE: Final = "n counts the students behind a row; sessions counts their recordings."

Counts = Mapping[tuple[str, ...], FloatArray]
"""Values of some columns -> how many of their rows each session has, those of most rows first."""


def percent(value: float) -> str:
    """A share in percent: ``2.6 %``."""
    return f"{words.as_percentage(value)}"


def per_minute(value: float) -> str:
    """How many contacts a minute, the number alone."""
    return f"{value:.3g}"


def rate(value: float) -> str:
    """How many a session."""
    return f"{value:.2g} a session"


def estimate_cell(estimate: Estimate, number_text: Callable[[float], str], counts_text: str = "") -> Cell:
    """A figure with its interval below it; ``counts_text``, what it was made from, then stand in its place."""
    if not estimate.students:
        return NO_NAME
    value, lower, upper = map(number_text, (estimate.value, estimate.low, estimate.high))
    return (
        Marked(counts_text, below=f"{value} ({lower} to {upper})")
        if counts_text
        else Marked(value, below=f"{lower} to {upper}")
    )


def class_counts(runs: ClassRuns) -> str:
    """Students, sessions and contacts, as the first words of page and terminal; contacts not of few students."""
    students, sessions = len(runs.students), plural(len(runs.metrics), "session")
    if students < LEAST_IN_CELL:
        return f"{count_text(students)} students, {sessions}"
    contacts = int(sum(counts.sum() for counts in ClassTables(runs).counts("episodes").values()))
    return f"{students} students, {sessions}, {plural(contacts, 'contact')}"


@dataclass(frozen=True)
class _Row:
    """A row: whose total it is a part of, its words, how many sessions each student (n,) has in it, and its figures."""

    whole: str
    heads: tuple[str, ...]
    sessions: FloatArray
    cells: tuple[Cell, ...]


@dataclass(frozen=True)
class Mistakes:
    """Contacts of the sessions that a detector saw, those that it got wrong, and its false contacts.

    ``prolonging``: false contacts that begin or end at a true one, so that no contact more is counted.
    """

    contacts: int
    missed: int
    late_or_cut_short: int
    false_contacts: int
    prolonging: int = 0

    @property
    def wrong_contacts(self) -> int:
        """Contacts missed, late or cut short."""
        return self.missed + self.late_or_cut_short


class ClassTables:
    """The tables of the sessions of a class; ``seed`` is that of the draws. Rows of nobody count in the list alone."""

    def __init__(self, runs: ClassRuns, seed: int = 0) -> None:
        students = runs.students
        self.runs = runs
        self._resampling = Resampling(len(students), seed)
        self._students_of_sessions = [runs.shared_value(run, "student") for run in runs.metrics]
        self._has_owner = np.array([owner != "" for owner in self._students_of_sessions], dtype=np.bool_)
        self._student = np.searchsorted(students, self._students_of_sessions)
        self._known_counts: dict[tuple[str, ...], Counts] = {}

    def headlines(self) -> list[str]:
        """Sentences on the contacts that each audited detector misses."""
        lines = []
        contacts = self.counts("episodes", "missed_by")
        for label in self.runs.audited_detectors:
            estimate = self._never_reported(label, contacts)[1]
            if estimate.students >= LEAST_IN_CELL:
                students = self._counted_students(estimate.students)
                interval_text = f"{percent(estimate.low)} to {percent(estimate.high)}, {students}"
                lines.append(
                    f"{label} misses {percent(estimate.value)} of the contacts ({interval_text})"
                    f"{self._false_contacts(label)}."
                )
        return lines

    def rate_difference(self) -> str:
        """Sentence on the detector whose contacts a minute differ most from the reference's; ``""``: none differs.

        Both have to be measured in the same sessions: else the difference could be one of students.
        """
        trusted_labels = self.trusted_detectors
        if len(trusted_labels) != 1:
            return ""
        (oracle,) = trusted_labels
        is_measured, reference_rate = np.isfinite(self._contact_rates(oracle)), self._contacts_a_minute(oracle)
        if reference_rate.students < LEAST_IN_CELL:
            return ""
        rates = {
            label: self._contacts_a_minute(label).value
            for label in self.runs.audited_detectors
            if np.array_equal(np.isfinite(self._contact_rates(label)), is_measured)
        }
        most_different_label = max(rates, key=lambda label: abs(rates[label] - reference_rate.value), default="")
        if not most_different_label or per_minute(rates[most_different_label]) == per_minute(reference_rate.value):
            return ""
        direction_text = ""
        if reference_rate.value:
            relative_change = rates[most_different_label] / reference_rate.value - 1.0
            direction_text = f" ({'+' if relative_change > 0 else '-'}{percent(abs(relative_change))})"
        return (
            f"{most_different_label} reports {per_minute(rates[most_different_label])} contacts a minute, "
            f"{oracle} {per_minute(reference_rate.value)}{direction_text}."
        )

    @property
    def trusted_detectors(self) -> list[str]:
        """Detectors that others are compared with, in order of appearance."""
        return list(
            dict.fromkeys(oracle for run in self.runs.metrics if (oracle := self.runs.shared_value(run, "oracle")))
        )

    @property
    def recorded_seconds(self) -> float:
        """Seconds with known poses, of all sessions together; 0: none states them, or few students have any."""
        first_metric_rows = [next(iter(rows.values())) for rows in self.runs.metrics.values()]
        minutes = [row.get("valid_minutes") for row in first_metric_rows]
        known_minutes = [value for value in minutes if value is not None and np.isfinite(value)]
        return (
            60.0 * sum(known_minutes)
            if len(self.runs.students) >= LEAST_IN_CELL and len(known_minutes) == len(first_metric_rows)
            else 0.0
        )

    def _false_contacts(self, label: str) -> str:
        """Words on the false contacts of a detector, to follow those on its misses."""
        counts = self.counts("false_contacts", "detector").get((label,), np.zeros(len(self._students_of_sessions)))
        estimate = self._resampling.ratio(
            self._sum_by_student(counts), self._sum_by_student(self._observed_sessions(label))
        )
        if not counts.any():
            return " and reports no false contact"
        interval_text = f"{estimate.low:.2g} to {estimate.high:.2g}"
        return f" and reports {estimate.value:.2g} false contacts a session ({interval_text})"

    def _counted_students(self, counted: int) -> str:
        """``52 students``, or ``44 of 52 students``, and why: one without a contact has no share of missed ones."""
        students = len(self.runs.students)
        if counted == students:
            return f"{counted} students"
        return f"{counted} of {students} students; the others had no contact to miss"

    def sample(self) -> dict[str, str]:
        """Content and device of the sessions, under the names of Table II."""

        def stated_values(name: str) -> str:
            return ", ".join(
                dict.fromkeys(self.runs.shared_value(run, name) or NOT_STATED for run in self.runs.metrics)
            )

        return {"content": stated_values("scene"), "device": f"VR type: {stated_values('vr_type')}"}

    def detectors(self) -> Table:
        """A row per detector, the trusted ones first."""
        trusted_labels = self.trusted_detectors
        contacts = self.counts("episodes", "missed_by")
        faults = [self.counts(name, "detector") for name in FAULT_BY_COUNT]
        rows = []
        for label in dict.fromkeys((*trusted_labels, *self.runs.audited_detectors)):
            rate_cells = [estimate_cell(self._contacts_a_minute(label), per_minute), "", "", ""]
            if label not in trusted_labels:
                no_counts = np.zeros(len(self._students_of_sessions))
                rates = (self._rate_cell(counts.get((label,), no_counts), label) for counts in faults)
                rate_cells[1:] = [self._never_reported(label, contacts)[0], *rates]
            row_heads = (label, "trusted" if label in trusted_labels else "audited")
            rows.append(_Row(label, row_heads, self._sum_by_student(self._observed_sessions(label)), tuple(rate_cells)))
        note = "Contacts a minute: the mean over students, each by the mean of their sessions."
        figure_headings = ("contacts a minute", "contacts never found", "misses", "false contacts")
        return _table_of_rows(("detector", "is"), figure_headings, rows, (note, *self._omission_sentences()))

    def pairs(self) -> Table:
        """A row per detector and pair that it missed, those missed most first."""
        contacts_by_pair, rows = self.counts("episodes", "body_a", "body_b", "missed_by"), []
        for (label, *pair), misses in self.counts("misses", "detector", "body_a", "body_b").items():
            contacts = {
                label_and_pair: counts
                for label_and_pair, counts in contacts_by_pair.items()
                if [*label_and_pair[:2]] == pair
            }
            observed_sessions = sum(contacts.values(), misses) * self._observed_sessions(label)
            sessions_of_students, students_with_miss = (
                self._sum_by_student(counts > 0) for counts in (observed_sessions, misses)
            )
            miss_sessions_cell = estimate_cell(
                self._resampling.ratio(students_with_miss, sessions_of_students),
                percent,
                f"{students_with_miss.sum():.0f} of {sessions_of_students.sum():.0f}",
            )
            cells = (self._rate_cell(misses, label), miss_sessions_cell, self._never_reported(label, contacts)[0])
            rows.append(_Row(label, (" - ".join(pair), label), sessions_of_students, cells))
        figure_headings = ("misses", "sessions with a miss", "contacts never found")
        return _table_of_rows(("pair", "detector"), figure_headings, rows)

    def activity_table(self) -> Table:
        """A row per task, stage and VR type: how many contacts, how many missed by any detector."""
        rows = []
        for activity_column in ("task", "stage", "vr_type"):
            contacts = self.counts("episodes", activity_column, "missed_by")
            for (activity_name,), durations in self.counts("episodes", activity_column).items():
                never_reported_cell = self._never_reported(
                    "", {key: counts for key, counts in contacts.items() if key[0] == activity_name}
                )[0]
                row_heads = (
                    activity_column.replace("vr_type", "VR type"),
                    activity_name or (NOT_STATED if activity_column == "vr_type" else NO_NAME),
                )
                rows.append(
                    _Row(
                        activity_column,
                        row_heads,
                        self._sum_by_student(durations > 0),
                        (self._rate_cell(durations), never_reported_cell),
                    )
                )
        return _table_of_rows(("what", "which"), ("contacts", "missed by any"), rows)

    def causes(self) -> Table:
        """A row per cause of misses and of false contacts."""
        rows = [
            _Row(
                fault_word + label,
                (fault_word, label, kind, cause or NO_NAME),
                self._sum_by_student(counts > 0),
                (self._rate_cell(counts, label),),
            )
            for name, fault_word in FAULT_BY_COUNT.items()
            for (label, kind, cause), counts in self.counts(name, "detector", "kind", "cause").items()
        ]
        return _table_of_rows(("what", "detector", "kind", "cause"), ("how many",), rows)

    def contact_seconds_a_minute(self, members: Collection[str] | None) -> Estimate:
        """Return seconds of contact of the trusted detector a minute with known poses; ``None``: of all students."""
        episodes = self.runs.tables["episodes"]
        lengths = np.nan_to_num((episodes["end"].to_numpy() - episodes["start"].to_numpy()).astype(np.float64))
        sessions = len(self._students_of_sessions)
        seconds = np.bincount(episodes["place"].to_numpy(), lengths, sessions)
        minutes = np.array(
            [next(iter(rows.values())).get("valid_minutes") or 0.0 for rows in self.runs.metrics.values()]
        )
        is_member = np.array(
            [members is None or student in members for student in self._students_of_sessions], dtype=np.float64
        )
        return self._resampling.ratio(
            self._sum_by_student(seconds * is_member), self._sum_by_student(minutes * is_member)
        )

    def counts(self, name: str, *columns: str) -> Counts:
        """How many rows of a table there are, by values of some columns, in the sessions of known students."""
        if (name, *columns) not in self._known_counts:
            self._known_counts[name, *columns] = self._row_counts(name, columns)
        return self._known_counts[name, *columns]

    def _row_counts(self, name: str, columns: Sequence[str]) -> Counts:
        """Count the rows; ``counts`` remembers them, since a page needs the same several times."""
        row_counts: dict[tuple[str, ...], FloatArray] = {}
        grouped_counts = self.runs.tables[name].group_by([*columns, "place"]).aggregate([([], "count_all")])
        for row in grouped_counts.to_pylist():
            if self._has_owner[row["place"]]:
                column_values = tuple(row[column] or "" for column in columns)
                row_counts.setdefault(column_values, np.zeros(len(self._students_of_sessions)))[row["place"]] += row[
                    "count_all"
                ]
        return dict(sorted(row_counts.items(), key=lambda item: (-item[1].sum(), item[0])))

    def mistakes(self, label: str) -> Mistakes | None:
        """Return the mistakes of an audited detector; ``None``: fewer than five students have a contact."""
        observed_contacts = sum(
            self.counts("episodes").values(), np.zeros(len(self._students_of_sessions))
        ) * self._observed_sessions(label)
        if self.students_with(observed_contacts) < LEAST_IN_CELL:
            return None
        misses = self.runs.tables["misses"].select(["detector", "place", "episode", "kind"])
        miss_rows = [row for row in misses.to_pylist() if row["detector"] == label]
        wrong_contacts = {(row["place"], row["episode"]) for row in miss_rows if self._has_owner[row["place"]]}
        never_reported = {
            (row["place"], row["episode"]) for row in miss_rows if row["kind"] == FaultKind.NEVER_REPORTED
        }
        never_reported_count = len(wrong_contacts & never_reported)
        false_counts = self.counts("false_contacts", "detector", "kind")
        false_contacts = {kind: int(counts.sum()) for (own, kind), counts in false_counts.items() if own == label}
        total = sum(false_contacts.values())
        prolonging = total - false_contacts.get(FaultKind.NO_CONTACT, 0)
        return Mistakes(
            int(observed_contacts.sum()),
            never_reported_count,
            len(wrong_contacts) - never_reported_count,
            total,
            prolonging,
        )

    def students_with(self, counts: FloatArray) -> int:
        """Number of students in whose sessions anything is counted."""
        return int(np.count_nonzero(self._sum_by_student(counts)))

    def _omission_sentences(self) -> Iterator[str]:
        """Yields sentences on sessions left out and on settings that differ."""
        runs = self.runs
        if sessions_without_student := self._students_of_sessions.count(""):
            nobody_clause = "they are in the list of sessions and in no figure"
            yield f"{sessions_without_student} of {len(runs.metrics)} sessions state no pseudonym: {nobody_clause}."
        if runs.repeated:
            yield f"Runs left out because their session is there already: {runs.repeated}."
        if runs.unmeasured:
            yield f"Runs left out because they have no metrics: {runs.unmeasured}."
        settings = {(label, row["settings"]) for detectors in runs.metrics.values() for label, row in detectors.items()}
        mixed_labels = sorted(label for label, count in Counter(label for label, _ in settings).items() if count > 1)
        if mixed_labels:
            yield f"Not run with the same settings and versions in all sessions: {', '.join(mixed_labels)}."

    def _sum_by_student(self, counts: NDArray[np.generic]) -> FloatArray:
        """The sum of what each session has, of every student."""
        is_known = self._has_owner
        return np.bincount(self._student[is_known], counts[is_known], len(self.runs.students)).astype(np.float64)

    def _observed_sessions(self, label: str) -> FloatArray:
        """1.0 of each session that a detector saw; ``""``: of all."""
        return np.array([float(not label or label in detectors) for detectors in self.runs.metrics.values()])

    def _rate_cell(self, counts: FloatArray, label: str = "") -> Cell:
        """How many rows, and how many that are a session."""
        sessions = self._sum_by_student(self._observed_sessions(label))
        return estimate_cell(
            self._resampling.ratio(self._sum_by_student(counts), sessions), rate, f"{counts.sum():.0f}"
        )

    def _never_reported(self, label: str, contacts: Counts) -> tuple[Cell, Estimate]:
        """Contacts that a detector never finds, ``""``: that any does not; the last of each key says who missed it."""
        contact_counts, lost_counts = np.zeros((2, len(self._students_of_sessions)))
        for (*_, missed_by), counts in contacts.items():
            contact_counts += counts
            lost_counts += counts * (label in missed_by.split(",") if label else missed_by != "")
        contact_counts, lost_counts = (
            self._sum_by_student(counts * self._observed_sessions(label)) for counts in (contact_counts, lost_counts)
        )
        estimate = self._resampling.ratio(lost_counts, contact_counts)
        return estimate_cell(estimate, percent, f"{lost_counts.sum():.0f} of {contact_counts.sum():.0f}"), estimate

    def _contacts_a_minute(self, label: str) -> Estimate:
        """Contacts a minute that a detector sees."""
        rates = self._contact_rates(label)
        measured_sessions = self._sum_by_student(np.isfinite(rates))
        means = self._sum_by_student(np.nan_to_num(rates)) / np.maximum(measured_sessions, 1.0)
        return self._resampling.ratio(means, np.minimum(measured_sessions, 1.0))

    def _contact_rates(self, label: str) -> FloatArray:
        """Contacts a minute that a detector sees in each session; NaN where it saw none of the session."""
        detector_rows = (detectors.get(label, {}) for detectors in self.runs.metrics.values())
        return np.array([row.get("contacts_per_min") for row in detector_rows], dtype=np.float64)


def _table_of_rows(
    row_headings: Sequence[str], figure_headings: Sequence[str], rows: Sequence[_Row], notes: Iterable[str] = ()
) -> Table:
    """The rows below their heads, with the students and sessions of each; of few students their number is all."""
    columns = [*(Column(name, whole=name == row_headings[0]) for name in row_headings)]
    columns += (Column(name, float) for name in ("n", "sessions", *figure_headings))
    hidden_rows, cell_rows = _hidden_rows(rows), []
    for k, row in enumerate(rows):
        students = int(np.count_nonzero(row.sessions))
        cells: tuple[Cell, ...] = (students, int(row.sessions.sum()), *row.cells)
        if k in hidden_rows:
            cells = (
                count_text(students) if students < LEAST_IN_CELL else SUPPRESSED_TEXT,
                *[""] * (1 + len(row.cells)),
            )
        cell_rows.append((*row.heads, *cells))
    return Table(tuple(columns), tuple(cell_rows), FIGURES_NOTE, (*notes, N_NOTE))


def _hidden_rows(rows: Sequence[_Row]) -> set[int]:
    """Complementary suppression: indices of rows that show no figure.

    Rows of one whole add up to a figure that stands elsewhere: all but one of them would tell that one, 30 misses less
    26. So those that say nothing have to be of five students at least together, else the row of fewest says nothing
    either.
    """
    hidden_rows: set[int] = set()
    for total_name in dict.fromkeys(row.whole for row in rows):
        students = {k: row.sessions > 0 for k, row in enumerate(rows) if row.whole == total_name}
        has_hidden = np.zeros(len(rows[0].sessions), dtype=np.bool_)
        for k in sorted(students, key=lambda k: np.count_nonzero(students[k])):
            is_too_few = np.count_nonzero(students[k]) < LEAST_IN_CELL
            if is_too_few or 0 < np.count_nonzero(has_hidden) < LEAST_IN_CELL:
                hidden_rows.add(k)
                has_hidden |= students[k]
    return hidden_rows


def places(runs: ClassRuns, out: Path) -> dict[str, PageLink]:
    """Run -> name and address of its report, from a page in the folder ``out``.

    A session has the code of its student; of one who has several, or of nobody, digits over its poses stand there.
    """
    sessions_of_student = Counter(runs.shared_value(run, "student") for run in runs.metrics)
    first_run_of_student, names = {}, {}
    for run in runs.metrics:
        student, session = runs.shared_value(run, "student"), runs.shared_value(run, "session") or run
        session_suffix = f", session {session}" if sessions_of_student[student] > 1 else ""
        names[run] = f"{student}{session_suffix}" if student else session
    for run in runs.metrics:
        # A run folder has the name of its session file, which may be a person's.
        page = runs.top / run / REPORT_FILE
        first_run_of_student[run] = (names[run], quote(Path(os.path.relpath(page.resolve(), out.resolve())).as_posix()))
    return first_run_of_student


def sessions_table(runs: ClassRuns, address_of_run: Mapping[str, PageLink]) -> Table:
    """The sessions in which a detector misses most, of five students at least, by name: links, and no figure of one."""
    misses = runs.tables["misses"]
    index_and_detector = [*zip(misses["place"].to_pylist(), misses["detector"].to_pylist(), strict=True)]
    miss_counts = Counter(index_and_detector)
    ranked_runs = []
    for index, (run, detectors) in enumerate(runs.metrics.items()):
        audited_labels = [label for label in detectors if runs.shared_value(run, "oracle") not in ("", label)]
        worst = max(audited_labels, key=lambda label: miss_counts[index, label], default="")
        ranked_runs.append((-miss_counts[index, worst], run, index, worst, audited_labels))
    students, rows_by_run = set[str](), {}
    for negated_count, run, index, label, audited_labels in sorted(ranked_runs):
        if len(students) >= LEAST_IN_CELL:
            break
        # A session of nobody may be of anybody already there.
        students |= {runs.shared_value(run, "student")} - {""}
        name, page = address_of_run[run]
        example = Marked("nothing missed" if audited_labels else "not audited")
        if negated_count:
            own_misses = misses.take(
                [
                    k
                    for k, miss_index_and_detector in enumerate(index_and_detector)
                    if miss_index_and_detector == (index, label)
                ]
            )
            example = _example_cell(
                min(own_misses.to_pylist(), key=_miss_sort_key), page, "" if label == audited_labels[0] else label
            )
        rows_by_run[run] = Marked(name, to=page), example, label
    rows = tuple(rows_by_run[run] for run in sorted(rows_by_run))
    columns = Column("session", whole=True), Column("look at"), Column("by")
    return Table(columns, rows, "Sessions with most misses, by name", (RECORDINGS_NOTE,))


def _miss_sort_key(miss: Row) -> tuple[bool, float, int]:
    """The longest cut first, as the cards of a report; one that no frame shows has none."""
    return miss["touch"] is not None, -(miss["cut_length"] or 0.0), miss["number"]


def _example_cell(miss: Row, page: str, viewer_option: str) -> Marked:
    text = f"{miss['body_a']} - {miss['body_b']} at {miss['start']:.2f} s"
    address = moment_address("miss", miss["number"], viewer_option)
    return Marked(text, below=f"miss {miss['number']}, {miss['kind']}", to=f"{page}#{address}")
