"""The first answers about a class: what was found, where to look, why contacts are missed, what to use, how sure."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from replay import words
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

MEAN_MS: Final = "mean_ms"
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
        AnswerRow("Found", _results(study)),
        AnswerRow("Missed", " ".join(tables.headlines())),
        AnswerRow("When", "Look first at", _first_sessions(tables, where)),
        AnswerRow("Why", _causes(tables)),
        AnswerRow("Use", _detector(tables, study)),
        AnswerRow("Cost", _times(tables)),
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


def _causes(tables: ClassTables) -> str:
    """The most frequent cause of the misses of each detector that five students or more have."""
    counts_of: dict[str, dict[str, float]] = {}
    for (label, cause), counts in tables.counts("misses", "detector", "cause").items():
        if cause and tables.students_with(counts) >= LEAST_IN_CELL:
            counts_of.setdefault(label, {})[cause] = counts.sum()
    sentences = []
    for label, causes in counts_of.items():
        most = [cause for cause, count in causes.items() if count == max(causes.values())]
        sentences.append(f"{label} misses most often because of: {', '.join(most)}.")
    return " ".join(sentences)


def _detector(tables: ClassTables, study: Study | None) -> str:
    """The detector that the figures come from, and whether another one would do."""
    trusted = dict.fromkeys(oracle for run in tables.runs.metrics if (oracle := tables.runs.of(run, "oracle")))
    if study is None:
        return f"{' or '.join(trusted)}: the reference of these sessions." if trusted else ""
    tested = [row for row in study.sensitivity if row.tested]
    changing = list(dict.fromkeys(row.detector for row in tested if row.changes))
    source = f"{study.detector}: every figure on contacts comes from it."
    if changing:
        return f"{source} Another conclusion follows with {', '.join(changing)}."
    same = list(dict.fromkeys(row.detector for row in tested))
    return f"{source} The same conclusions follow with {', '.join(same)}." if same else source


def _times(tables: ClassTables) -> str:
    """Milliseconds a frame of each detector, in the mean of the sessions that measured it."""
    metrics = tables.runs.every_metric
    if MEAN_MS not in metrics.column_names:
        return "Times of the detectors were not measured."
    times: dict[str, list[float]] = {}
    for row in metrics.select(["detector", MEAN_MS]).to_pylist():
        if row[MEAN_MS] is not None and np.isfinite(row[MEAN_MS]):
            times.setdefault(row["detector"], []).append(row[MEAN_MS] / 1e3)
    if not times:
        return "Times of the detectors were not measured."
    means = [f"{label} {words.frame_time(float(np.mean(values)))}" for label, values in times.items()]
    return f"A frame takes in the mean of the sessions: {', '.join(means)}."


def _certainty(tables: ClassTables, study: Study | None) -> Iterator[str]:
    """Sentences on the students behind the figures, on what was refused, and on what no figure says."""
    students = len(tables.runs.students)
    if study is not None:
        yield f"{behind(study)}."
    else:
        yield f"{few(students)} students." if students < LEAST_IN_CELL else f"{plural(students, 'student')}."
    yield "Brackets and bars are 95 % intervals over students drawn anew."
    if study is not None:
        if study.refusals:
            yield f"{plural(len(study.refusals), 'result')} not given: Method says which and why."
        yield "Associations of the students observed: no figure says what causes what."
