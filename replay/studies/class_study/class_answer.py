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
from replay.studies.class_study.analysis import Sensitivity, Study
from replay.studies.class_study.class_tables import ClassTables, Mistakes, Place, sessions_table
from replay.studies.class_study.refusals import LEAST_IN_CELL, few
from replay.studies.class_study.regression import LEVEL
from replay.studies.class_study.tables import behind, headlines
from replay.words import plural

MOST_SESSIONS: Final = 3
"""Sessions that are named on the first screen; the table below has the others."""

FIRST_SESSIONS: Final = (
    "These are among the sessions with most missed or late contacts; each link opens the one where the surfaces "
    "intersect most."
)

MOST_DETECTORS: Final = 3
"""Detectors whose mistakes are counted in a sentence."""

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
        _reason(tables, study),
        AnswerRow("Do", *_first_and_rest(_detector(tables, study))),
        AnswerRow("Cost", *_first_and_rest(_times(tables, study))),
        AnswerRow("Or", *_first_and_rest(_other_detectors(study, _trusted(tables)))),
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


def _reason(tables: ClassTables, study: Study | None) -> AnswerRow:
    """Why a conclusion changes or not: the mistakes of the detectors compared; else why contacts are missed."""
    causes = _causes(tables)
    tested = [row for row in study.sensitivity if row.tested] if study is not None else []
    changing = {row.detector for row in tested if row.changes}
    compared = changing or {row.detector for row in tested}
    if study is not None and tested:
        compared = compared | {study.detector}
    counted = {label: tables.mistakes(label) for label in tables.runs.audited if label in compared}
    known = [(label, counts) for label, counts in counted.items() if counts is not None]
    known.sort(key=lambda item: (item[0] not in changing, -item[1].wrong))
    if study is None or not any(counts.wrong or counts.false_contacts for _, counts in known):
        return AnswerRow("Why", *_first_and_rest(causes))
    sentences = [f"{label} {_mistakes_text(counts)}." for label, counts in known]
    if changing:
        (first, counts), *_ = known
        subject = f"{first} leads to another conclusion: it" if first in changing else f"{first}, which counts here,"
        text = f"{subject} {_mistakes_text(counts)}."
        return AnswerRow("Why", text, " ".join(sentences[1:]), details=" ".join(causes))
    (first, counts), *others = known[:MOST_DETECTORS]
    several = len({counts.contacts for _, counts in known}) > 1
    wrong = [f"{label} {own.wrong}{f' of {own.contacts}' if several else ''}" for label, own in others]
    wrong.insert(0, f"{first} got {counts.wrong} of {plural(counts.contacts, 'contact')} wrong")
    moved = "moved no result" if _same_results(tested) else "changed no conclusion"
    text = f"The detectors' mistakes {moved}: {', '.join(wrong)}."
    least = least_association(study.students)
    if least is not None and _takes_more_students(study):
        sentences.insert(0, text)
        few_students = f"{study.students} students are too few for an association below {words.number(least, 2)}"
        text = f"{few_students}; the detectors' mistakes {moved}."
    return AnswerRow("Why", text, " ".join(sentences), details=" ".join(causes))


def _same_results(tested: list[Sensitivity]) -> bool:
    """Whether each result has the same figure with every detector, to the digits printed."""
    return all(row.after is not None and f"{row.before.beta:.3f}" == f"{row.after.beta:.3f}" for row in tested)


def _mistakes_text(counts: Mistakes) -> str:
    """Return the mistakes of a detector by their kind, as the end of a sentence."""
    missed = f"missed {counts.missed} of {plural(counts.contacts, 'contact')}"
    late = f"was late or cut short in {counts.late_or_cut_short}"
    return f"{missed}, {late} and reported {plural(counts.false_contacts, 'false contact')}"


def _detector(tables: ClassTables, study: Study | None) -> list[str]:
    """The detector with which to count, and where nothing is associated the students that a link takes."""
    trusted = _trusted(tables)
    if study is None:
        if not trusted:
            return []
        return [f"Count contacts with {' or '.join(trusted)}, the reference.", "The others are measured against it."]
    recommended = study.detector if not trusted or study.detector in trusted else " or ".join(trusted)
    source = f"Every result about contacts on this page is counted with {study.detector}."
    students = students_needed(MEDIUM)
    if not _takes_more_students(study):
        return [f"Count contacts with {recommended}.", source]
    return [
        f"Count contacts with {recommended}; to find an association of {MEDIUM:g}, take {students} students.",
        f"A class of {students} finds it in 4 of 5 cases (one test at p < {LEVEL:g}).",
        source,
    ]


def _takes_more_students(study: Study) -> bool:
    """Whether nothing is associated and a medium association takes more students than were asked."""
    return study.students < students_needed(MEDIUM) and not any(finding.associated for finding in study.findings)


def _trusted(tables: ClassTables) -> list[str]:
    """References of the runs, in order of appearance."""
    return list(dict.fromkeys(oracle for run in tables.runs.metrics if (oracle := tables.runs.of(run, "oracle"))))


def _other_detectors(study: Study | None, trusted: list[str]) -> list[str]:
    """The detector beside the trusted that finds most and changes no conclusion; empty: none was tested."""
    tested = [row for row in study.sensitivity if row.tested] if study is not None else []
    changing = list(dict.fromkeys(row.detector for row in tested if row.changes))
    same = [label for label in dict.fromkeys(row.detector for row in tested) if label not in changing]
    if changing and not same:
        return ["None: every other detector that was tested changes a conclusion."]
    same = [label for label in same if label not in trusted]
    recalls = {row.detector: row.recall for row in tested if row.detector in same and row.recall is not None}
    if not recalls:
        return [f"Count with {' or '.join(same)}."] if same else []
    most = max(recalls.values())
    best = [label for label, recall in recalls.items() if recall == most]
    each = "it" if len(best) == 1 else "each"
    finds = f"{each} finds {words.as_percentage(most)} of contact frames and changes no conclusion"
    return [f"Where the reference is too slow, count with {' or '.join(best)}: {finds}."]


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
    seconds = {label: float(np.mean(values)) for label, values in times.items()}
    cheapest = all(
        seconds[first] < value and means[first] != means[label] for label, value in seconds.items() if label != first
    )
    least = ", less than every other detector" if cheapest and others else ""
    text = f"{first} takes {means[first]} a frame{least}."
    if study is not None and _takes_more_students(study):
        more = plural(students_needed(MEDIUM) - study.students, "more student")
        text = f"{more}; counting with {text}"
    return [text, f"{others}: means over the sessions." if others else ""]


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
        reliable = f"{study.students} students show only associations above {words.number(least, 2)} reliably."
        text = f"Not very: {reliable}" if least > MEDIUM else reliable
        needed = (
            f"An association of {MEDIUM:g} takes {students_needed(MEDIUM)} students "
            f"(found in 4 of 5 such classes, one test at p < {LEVEL:g})."
        )
        figures = figures if _takes_more_students(study) else [needed, *figures]
    else:
        figures = []
    refused = [f"{refusal.what} ({refusal.reason})" for refusal in study.refusals]
    if refused:
        rest = f"; {len(refused) - MOST_REFUSED} more under Method" if len(refused) > MOST_REFUSED else ""
        figures.append(f"Left out: {'; '.join(refused[:MOST_REFUSED])}{rest}.")
    observed = "Only associations were observed: no figure says what causes what."
    return AnswerRow("Sure", text, " ".join(figures), details=f"{intervals} {observed}")
