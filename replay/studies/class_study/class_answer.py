"""The first answers about a class: what was found, where to look, why contacts are missed, what to do, how sure."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import atanh, ceil, sqrt, tanh
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
from replay.studies.class_study.regression import LEVEL
from replay.studies.class_study.tables import behind, headlines
from replay.words import plural

MOST_SESSIONS: Final = 3
"""Sessions that are named on the first screen; the table below has the others."""

FIRST_SESSIONS: Final = "Of the sessions with most missed or late contacts, each with its longest one."

MOST_FOUND: Final = 3
"""Results that are named there."""

MOST_REFUSED: Final = 2
"""Results left out that are named there."""

FEWEST: Final = 20
"""Students from which on Fisher's transformation is near enough."""

DETECTOR, MEAN_MS = file_names("metrics", "detector", "mean_ms")
"""Column of the metrics with the milliseconds of a detector a frame."""


@dataclass(frozen=True)
class AnswerRow:
    """A heading with its texts, as ``replay.document.answer.Reason`` has them.

    Parameters
    ----------
    name : the heading.
    text : the answer itself, one short sentence.
    figures : the sentences below it; ``""``: none.
    links : texts and addresses of what it leads to, behind ``text``.
    details : what the page folds and a terminal prints with ``-v``; ``""``: nothing.
    """

    name: str
    text: str
    figures: str = ""
    links: tuple[tuple[str, str], ...] = ()
    details: str = ""


def class_answer(tables: ClassTables, where: Mapping[str, Place], study: Study | None) -> list[AnswerRow]:
    """Return the rows below the first sentence of a class; a row without text or links is left out."""
    result, *others = _results(study)
    rows = [
        AnswerRow(
            "What",
            result,
            " ".join(filter(None, [*others, tables.rate_difference()])),
            details=" ".join(tables.headlines()),
        ),
        AnswerRow("When", "Look first at", FIRST_SESSIONS, links=_first_sessions(tables, where)),
        AnswerRow("Why", *_first_and_rest(_causes(tables))),
        AnswerRow("Do", *_first_and_rest(_detector(tables, study))),
        AnswerRow("Cost", *_first_and_rest(_times(tables, study))),
        AnswerRow("Or", *_first_and_rest(_other_detectors(study))),
        _certainty(tables, study),
    ]
    return [row for row in rows if row.text and (row.name != "When" or row.links)]


def _first_and_rest(sentences: list[str]) -> tuple[str, str]:
    """The first sentence, and the others as one text."""
    return sentences[0] if sentences else "", " ".join(sentences[1:])


def _results(study: Study | None) -> list[str]:
    """The associations, most pronounced first."""
    if study is None:
        return ["Nothing was tested: there is no questionnaire."]
    results = headlines(study)
    more = [f"{len(results) - MOST_FOUND} more below."] if len(results) > MOST_FOUND else []
    return [*(f"{sentence}." for sentence in results[:MOST_FOUND]), *more]


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


def _causes(tables: ClassTables) -> list[str]:
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
            because = f" because {CAUSES[cause]}" if cause in CAUSES else f": {cause}"
            sentences.append(f"{label} is wrong{because} ({share} missed or late contacts).")
    return sentences


def _detector(tables: ClassTables, study: Study | None) -> list[str]:
    """The detector whose contacts to use."""
    if study is not None:
        return [
            f"Use the contacts of {study.detector}.",
            "Every figure about contacts on this page comes from them.",
        ]
    trusted = _trusted(tables)
    if not trusted:
        return []
    return [f"Use the contacts of {' or '.join(trusted)}, the reference.", "The others are measured against them."]


def _trusted(tables: ClassTables) -> list[str]:
    """References of the runs, in order of appearance."""
    return list(dict.fromkeys(oracle for run in tables.runs.metrics if (oracle := tables.runs.of(run, "oracle"))))


def _other_detectors(study: Study | None) -> list[str]:
    """The other detectors that would do, and those that change a conclusion; ``""``: none was tested."""
    tested = [row for row in study.sensitivity if row.tested] if study is not None else []
    changing = list(dict.fromkeys(row.detector for row in tested if row.changes))
    same = [label for label in dict.fromkeys(row.detector for row in tested) if label not in changing]
    sentences = []
    if same:
        sentences.append(f"The same conclusions follow with {', '.join(same)}.")
    if changing:
        sentences.insert(0, f"Another conclusion follows with {', '.join(changing)}.")
    return sentences


def _times(tables: ClassTables, study: Study | None) -> list[str]:
    """Milliseconds a frame of each detector, the recommended one first, in the mean of the sessions measured."""
    metrics = tables.runs.every_metric
    unknown = ["Times of the detectors were not measured."]
    if MEAN_MS not in metrics.column_names:
        return unknown
    times: dict[str, list[float]] = {}
    for row in metrics.select([DETECTOR, MEAN_MS]).to_pylist():
        if row[MEAN_MS] is not None and np.isfinite(row[MEAN_MS]):
            times.setdefault(row[DETECTOR], []).append(row[MEAN_MS] / 1e3)
    if not times:
        return unknown
    means = {label: words.frame_time(float(np.mean(values))) for label, values in times.items()}
    recommended = study.detector if study is not None else next(iter(_trusted(tables)), "")
    first = recommended if recommended in means else next(iter(means))
    others = ", ".join(f"{label} {time}" for label, time in means.items() if label != first)
    return [f"{first} takes {means[first]} a frame.", f"{others}: means over the sessions." if others else ""]


TWO_SIDED: Final = 1.959964
"""Quantile of the normal distribution at 97.5 %: a test of two sides at p below 0.05."""

MEDIUM: Final = 0.3
"""A correlation of medium size (Cohen 1988)."""

FOUR_IN_FIVE: Final = 0.841621
"""Quantile at 80 %: the association is found in four of five samples."""


def least_association(students: int) -> float | None:
    """The correlation that a test at 5 % finds in four of five samples of so many students; ``None``: too few.

    Source: Fisher's z transformation, of which the deviation is 1 / sqrt(n - 3).
    """
    return None if students < FEWEST else tanh((TWO_SIDED + FOUR_IN_FIVE) / sqrt(students - 3))


def students_needed(association: float) -> int:
    """The fewest students of which a test at 5 % finds this correlation in four of five samples."""
    return ceil(((TWO_SIDED + FOUR_IN_FIVE) / atanh(association)) ** 2 + 3)


def _certainty(tables: ClassTables, study: Study | None) -> AnswerRow:
    """How strong an association must be to be found; the students behind the figures; what was left out."""
    students = len(tables.runs.students)
    intervals = "Brackets and bars are 95 % intervals: other classes like this one may give any figure within."
    if study is None:
        count = f"{few(students)} students." if students < LEAST_IN_CELL else f"{plural(students, 'student')}."
        return AnswerRow("Sure", count, intervals)
    figures = [f"{behind(study)}."]
    text, least = figures[0], least_association(study.students)
    if least is not None:
        text = f"With {study.students} students, only associations above {words.number(least, 2)} are found reliably."
        figures = [
            f"An association of {MEDIUM:g} takes {students_needed(MEDIUM)} students "
            f"(found in 4 of 5 such classes, one test at p < {LEVEL:g}).",
            *figures,
        ]
    else:
        figures = []
    refused = [f"{refusal.what} ({refusal.reason})" for refusal in study.refusals]
    if refused:
        rest = f"; {len(refused) - MOST_REFUSED} more under Method" if len(refused) > MOST_REFUSED else ""
        figures.append(f"Left out: {'; '.join(refused[:MOST_REFUSED])}{rest}.")
    observed = "Only associations were observed: no figure says what causes what."
    return AnswerRow("Sure", text, " ".join(figures), details=f"{intervals} {observed}")
