"""Questionnaire and metrics, joined student by student; a row that cannot be joined is an error."""

import csv
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdcore.numerics import FloatArray
from replay.errors import StudyError
from replay.studies.class_study.codebook import Codebook, Item
from replay.studies.class_study.refusals import StudyRefusedError

PSEUDONYM: Final = re.compile(r"(?=.*\d)[A-Za-z0-9_-]{1,32}")
"""A pseudonym has a digit and neither space nor sign: ``S01``. A name has no digit, an address has a sign."""

STUDENT: Final = "student"
DETECTOR: Final = "detector"
RECALL: Final = "recall"
CONTACT_FRAMES: Final = "contact_frames"


@dataclass(frozen=True)
class Questionnaire:
    """Answers of each student, by pseudonym, sorted: item -> (students,), turned where the item is reverse-coded.

    nan: not answered; ``group`` is the declared group of each student, or ``()``.
    """

    students: tuple[str, ...]
    answers: dict[str, FloatArray]
    group: tuple[str, ...] = ()

    def scores(self, items: Sequence[Item]) -> FloatArray:
        """Mean answer over the items of a construct, (students,); nan where one is missing."""
        return np.asarray(np.mean([self.answers[item.name] for item in items], axis=0), dtype=np.float64)


def check_pseudonyms(students: Sequence[str], where: str) -> None:
    """Refuse, as ``ids``, what is missing or looks like a name or an address; rows are named, never the words."""
    wrong = [k + 1 for k, student in enumerate(students) if not PSEUDONYM.fullmatch(student)]
    if wrong:
        rows = ", ".join(map(str, wrong[:5])) + (", ..." if len(wrong) > 5 else "")
        raise StudyRefusedError(
            "ids", f"{where}, data row {rows}: no pseudonym (letters and at least one digit, as S01)"
        )


def read_rows(path: Path) -> list[dict[str, str]]:
    """The rows of a CSV file; one that cannot be read is a ``StudyError``."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            return list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise StudyError(f"{path} cannot be read as CSV: {error}") from error


def read_questionnaire(path: Path, codebook: Codebook) -> Questionnaire:
    """Read the answers that the codebook names from a CSV file.

    Raises ``StudyError``: a column is missing, an answer is no number or off its scale (names row and column);
    ``StudyRefusedError``: ``ids``, a pseudonym is missing or there twice; ``undeclared-groups``.
    """
    rows = read_rows(path)
    if not rows:
        raise StudyError(f"{path} has no rows below its heading")
    columns = [codebook.student, *(item.name for item in codebook.items)]
    columns += [codebook.groups[0]] if codebook.groups else []
    missing = [name for name in columns if name not in rows[0]]
    if missing:
        raise StudyError(f"{path.name} lacks the column {missing[0]!r} that the codebook names")
    told = {name: [(row[name] or "").strip() for row in rows] for name in columns}
    students = told[codebook.student]
    check_pseudonyms(students, path.name)
    twice = sorted(student for student, count in Counter(students).items() if count > 1)
    if twice:
        raise StudyRefusedError("ids", f"{path.name}: {', '.join(twice[:5])} answered more than once")
    order = np.argsort(students)
    answers = {item.name: _answers(told[item.name], item, path.name)[order] for item in codebook.items}
    group = np.array(told[codebook.groups[0]])[order].tolist() if codebook.groups else []
    if codebook.groups and not {*group} <= {*codebook.group_names}:
        words = f"{path.name}: {codebook.groups[0]} holds a group that the codebook does not declare"
        raise StudyRefusedError("undeclared-groups", words)
    return Questionnaire(tuple(np.array(students)[order].tolist()), answers, tuple(group))


def _answers(texts: Sequence[str], item: Item, where: str) -> FloatArray:
    """One column as numbers, turned where the item is reverse-coded."""
    values = np.full(len(texts), np.nan)
    low, high = item.scale
    for k, text in enumerate(texts):
        if not text:
            continue
        place = f"{where}, data row {k + 1}, column {item.name}"
        try:
            values[k] = float(text)
        except ValueError:
            raise StudyError(f"{place}: {text!r:.40} is no number; leave it empty if it was not answered") from None
        if not low <= values[k] <= high:
            raise StudyError(f"{place}: {text} is off the scale {low:g} to {high:g} that the codebook gives")
    return low + high - values if item.reversed else values


@dataclass(frozen=True)
class Metrics:
    """Metrics, a row per session and detector, as columns of one length."""

    columns: dict[str, list[Any]]

    def __len__(self) -> int:
        return len(self.columns[STUDENT])

    @property
    def detectors(self) -> tuple[str, ...]:
        """Detectors with rows, in order of appearance."""
        return tuple(dict.fromkeys(self.columns[DETECTOR]))

    def of(self, detector: str) -> "Metrics":
        """The rows of one detector."""
        keep = [k for k, name in enumerate(self.columns[DETECTOR]) if name == detector]
        return Metrics({name: [values[k] for k in keep] for name, values in self.columns.items()})

    def numbers(self, name: str) -> FloatArray:
        """One column as numbers, nan where there is none."""
        return np.array([np.nan if value is None else float(value) for value in self.columns[name]], dtype=np.float64)

    def recall(self) -> float | None:
        """Share of all contact frames of all rows that are reported; ``None`` when it was not measured in each row."""
        frames, share = self.numbers(CONTACT_FRAMES), self.numbers(RECALL)
        touched = frames > 0
        if not np.isfinite(frames).all() or not np.isfinite(share[touched]).all() or not touched.any():
            return None
        return float(np.average(share[touched], weights=frames[touched]))


def means_of_students(metrics: Metrics, questionnaire: Questionnaire, names: Iterable[str]) -> dict[str, FloatArray]:
    """Column of metrics -> its mean over the sessions of each student of the questionnaire, (students,); nan: none.

    One value a student: with the rows of sessions and cluster-robust errors p was below 0.05 in 25 % of classes without
    any association, where three of 15 students had 20 sessions each. Raises ``StudyRefusedError`` ``ids``: a student is
    in one file only.
    """
    place = {student: k for k, student in enumerate(questionnaire.students)}
    lost = sorted(place.keys() ^ set(metrics.columns[STUDENT]))
    if lost:
        words = ", ".join(lost[:5]) + (", ..." if len(lost) > 5 else "")
        raise StudyRefusedError("ids", f"joining answers and metrics: {words} in one of the files only")
    rows = np.array([place[student] for student in metrics.columns[STUDENT]])
    means = {}
    for name in names:
        values = metrics.numbers(name)
        known = np.isfinite(values)
        count = np.bincount(rows[known], minlength=len(place))
        total = np.bincount(rows[known], weights=values[known], minlength=len(place))
        means[name] = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return means
