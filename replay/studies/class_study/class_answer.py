"""The first answers about a class: what was found, where to look, why contacts are missed, what to do, how sure."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from replay import words
from replay.auditing.fault import Cause
from replay.document.columns import file_names
from replay.document.fault_sentences import REASONS
from replay.document.tables import Marked
from replay.studies.class_study.analysis import Study
from replay.studies.class_study.class_tables import ClassTables, Place, sessions_table
from replay.studies.class_study.refusals import LEAST_IN_CELL, few
from replay.studies.class_study.tables import behind, headlines
from replay.words import plural

MOST_SESSIONS: Final = 3
"""Sessions that are named on the first screen; the table below has the others."""

MOST_FOUND: Final = 3
"""Results that are named there."""

MOST_REFUSED: Final = 2
"""Results left out that are named there."""

DETECTOR, MEAN_MS = file_names("metrics", "detector", "mean_ms")
"""Column of the metrics with the milliseconds of a detector a frame."""


@dataclass(frozen=True)
class AnswerRow:
    """A heading and its sentences; ``links`` are the texts and addresses of what it leads to."""

    name: str
    text: str
    links: tuple[tuple[str, str], ...] = ()


def class_answer(tables: ClassTables, where: Mapping[str, Place], study: Study | None) -> list[AnswerRow]:
    """Return the rows below the first sentence of a class; a row without text or links is left out."""
    rows = [
        AnswerRow("What", " ".join(filter(None, [tables.rate_difference(), _results(study), *tables.headlines()]))),
        AnswerRow("When", "Look first at", _first_sessions(tables, where)),
        AnswerRow("Why", _causes(tables)),
        AnswerRow("Do", _detector(tables, study)),
        AnswerRow("Cost", _times(tables)),
        AnswerRow("Or", _other_detectors(study)),
        AnswerRow("Sure", " ".join(_certainty(tables, study))),
    ]
    return [row for row in rows if row.text and (row.name != "When" or row.links)]


def _results(study: Study | None) -> str:
    """The associations, most pronounced first."""
    if study is None:
        return "Nothing was tested: there is no questionnaire."
    found = headlines(study)
    more = f" {len(found) - MOST_FOUND} more below." if len(found) > MOST_FOUND else ""
    return " ".join(f"{sentence}." for sentence in found[:MOST_FOUND]) + more


def _first_sessions(tables: ClassTables, where: Mapping[str, Place]) -> tuple[tuple[str, str], ...]:
    """The sessions in which most is missed, by name, each with its miss."""
    links = []
    for name, look, _ in sessions_table(tables.runs, where).rows:
        if isinstance(name, Marked) and isinstance(look, Marked) and look.to:
            links.append((f"{name.text}: {look.text}", look.to))
    return tuple(links[:MOST_SESSIONS])


CAUSES: Final[Mapping[str, str]] = {
    Cause.BETWEEN_SAMPLES: "the contact, or a part of it, falls between two samples",
    Cause.LATE: "its reports come late",
    Cause.EARLY: "its reports end early",
    **REASONS["misses"],
}
"""Cause -> why a contact is missed, as the end of a sentence; others stand as they are called."""


def _causes(tables: ClassTables) -> str:
    """The most frequent cause of the misses of each detector that five students or more have, with its count."""
    counts_of: dict[str, dict[str, float]] = {}
    totals: dict[str, float] = {}
    for (label, cause), counts in tables.counts("misses", "detector", "cause").items():
        totals[label] = totals.get(label, 0.0) + counts.sum()
        if cause and tables.students_with(counts) >= LEAST_IN_CELL:
            counts_of.setdefault(label, {})[cause] = counts.sum()
    sentences = []
    for label, causes in counts_of.items():
        most = max(causes.values())
        for cause in (cause for cause, count in causes.items() if count == most):
            # What is left over could be of few students.
            every = totals[label] == sum(causes.values())
            share = f"{most:.0f} of {totals[label]:.0f}" if every else "most"
            sentences.append(f"{label}: {CAUSES.get(cause, cause)} ({share} missed or late contacts).")
    return " ".join(sentences)


def _detector(tables: ClassTables, study: Study | None) -> str:
    """The detector whose contacts to use."""
    if study is not None:
        return f"Use the contacts of {study.detector}: every figure about contacts on this page comes from them."
    trusted = dict.fromkeys(oracle for run in tables.runs.metrics if (oracle := tables.runs.of(run, "oracle")))
    if not trusted:
        return ""
    return f"Use the contacts of {' or '.join(trusted)}, the reference: the others are measured against them."


def _other_detectors(study: Study | None) -> str:
    """The other detectors that would do, and those that change a conclusion; ``""``: none was tested."""
    tested = [row for row in study.sensitivity if row.tested] if study is not None else []
    changing = list(dict.fromkeys(row.detector for row in tested if row.changes))
    same = [label for label in dict.fromkeys(row.detector for row in tested) if label not in changing]
    sentences = []
    if same:
        sentences.append(f"The same conclusions follow with {', '.join(same)}.")
    if changing:
        sentences.append(f"Another conclusion follows with {', '.join(changing)}.")
    return " ".join(sentences)


def _times(tables: ClassTables) -> str:
    """Milliseconds a frame of each detector, in the mean of the sessions that measured it."""
    metrics = tables.runs.every_metric
    if MEAN_MS not in metrics.column_names:
        return "Times of the detectors were not measured."
    times: dict[str, list[float]] = {}
    for row in metrics.select([DETECTOR, MEAN_MS]).to_pylist():
        if row[MEAN_MS] is not None and np.isfinite(row[MEAN_MS]):
            times.setdefault(row[DETECTOR], []).append(row[MEAN_MS] / 1e3)
    if not times:
        return "Times of the detectors were not measured."
    means = [f"{label} {words.frame_time(float(np.mean(values)))}" for label, values in times.items()]
    return f"A frame takes in the mean of the sessions: {', '.join(means)}."


def _certainty(tables: ClassTables, study: Study | None) -> Iterator[str]:
    """Sentences on the students behind the figures, on what was left out, and on what no figure says."""
    students = len(tables.runs.students)
    if study is not None:
        yield f"{behind(study)}."
    else:
        yield f"{few(students)} students." if students < LEAST_IN_CELL else f"{plural(students, 'student')}."
    yield "Brackets and bars are 95 % intervals: other classes like this one may give any figure within."
    if study is not None:
        refused = [f"{refusal.what} ({refusal.reason})" for refusal in study.refusals]
        if refused:
            rest = f"; {len(refused) - MOST_REFUSED} more under Method" if len(refused) > MOST_REFUSED else ""
            yield f"Left out: {'; '.join(refused[:MOST_REFUSED])}{rest}."
        yield "Only associations were observed: no figure says what causes what."
