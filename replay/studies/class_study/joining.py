"""Questionnaire and metrics, joined student by student; a row that cannot be joined is an error."""

import csv
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from replay.errors import StudyError
from replay.studies.class_study.codebook import Codebook, Item
from replay.studies.class_study.refusals import StudyRefusedError

if TYPE_CHECKING:
    from pandas import DataFrame, Series

PSEUDONYM: Final = re.compile(r"(?=.*\d)[A-Za-z0-9_-]{1,32}")
"""A pseudonym has a digit and neither space nor sign: ``S01``. A name has no digit, an address has a sign."""

STUDENT: Final = "student"
DETECTOR: Final = "detector"
RECALL: Final = "recall"
CONTACT_FRAMES: Final = "contact_frames"


def check_pseudonyms(students: Sequence[str], where: str) -> None:
    """Refuse, as ``ids``, what is missing or looks like a name or an address; rows are named, never the words."""
    wrong = [k + 1 for k, student in enumerate(students) if not PSEUDONYM.fullmatch(student)]
    if wrong:
        said = f"{where}, data row {_first(wrong)}: no pseudonym (letters and at least one digit, as S01)"
        raise StudyRefusedError("ids", said)


def _first(items: Sequence[object]) -> str:
    """At most five of them."""
    return ", ".join(map(str, items[:5])) + (", ..." if len(items) > 5 else "")


def read_rows(path: Path) -> list[dict[str, str]]:
    """The rows of a CSV file; one that cannot be read is a ``StudyError``."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            return list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise StudyError(f"{path} cannot be read as CSV: {error}") from error


def read_questionnaire(path: Path, codebook: Codebook) -> "DataFrame":
    """Read the answers that the codebook names from a CSV file.

    A row a student, by pseudonym and sorted; a column an item, turned where it is reverse-coded, nan: not answered; and
    the column of the declared groups. Raises ``StudyError``: a column is missing, an answer is off its scale (names row
    and column); ``StudyRefusedError``: ``ids``, a pseudonym is missing or there twice; ``undeclared-groups``.
    """
    from pandas import DataFrame

    rows = read_rows(path)
    if not rows:
        raise StudyError(f"{path} has no rows below its heading")
    columns = [codebook.student, *(item.name for item in codebook.items)]
    columns += [codebook.group_column] if codebook.groups else []
    missing = [name for name in columns if name not in rows[0]]
    if missing:
        raise StudyError(f"{path.name} lacks the column {missing[0]!r} that the codebook names")
    table = DataFrame(rows, columns=columns, dtype=str).fillna("").apply(lambda column: column.str.strip())
    students = table[codebook.student]
    check_pseudonyms(students.tolist(), path.name)
    twice = sorted(set(students[students.duplicated()]))
    if twice:
        raise StudyRefusedError("ids", f"{path.name}: {', '.join(twice[:5])} answered more than once")
    if codebook.groups and not {*table[codebook.group_column]} <= {*codebook.groups}:
        words = f"{path.name}: {codebook.group_column} holds a group that the codebook does not declare"
        raise StudyRefusedError("undeclared-groups", words)
    for item in codebook.items:
        table[item.name] = _answers(table[item.name], item, path.name)
    return table.set_index(codebook.student).sort_index()


def _answers(texts: "Series", item: Item, where: str) -> "Series":
    """One column as numbers, turned where the item is reverse-coded."""
    from pandas import to_numeric

    values = to_numeric(texts, errors="coerce").astype(float)
    low, high = item.scale
    wrong = texts[(texts != "") & ~values.between(low, high)]
    for row, text in wrong.items():
        raise StudyError(
            f"{where}, data row {row + 1}, column {item.name}: {text!r:.40} is not on the scale {low:g} to {high:g} "
            "that the codebook gives; leave it empty if it was not answered"
        )
    return low + high - values if item.reversed else values


def recall_of(metrics: "DataFrame") -> float | None:
    """Share of all contact frames of all rows that are reported; ``None`` when it was not measured in each row."""
    # A row without contacts has no recall; one whose contacts were not counted is no such row.
    touched = metrics[metrics[CONTACT_FRAMES] != 0]
    found = (touched[RECALL] * touched[CONTACT_FRAMES]).sum(skipna=False)
    return float(found / touched[CONTACT_FRAMES].sum()) if len(touched) and found == found else None


def means_of_students(metrics: "DataFrame", answers: "DataFrame", names: Sequence[str]) -> "DataFrame":
    """The mean of columns of metrics over the sessions of each student of the questionnaire.

    One value a student: with the rows of sessions and cluster-robust errors p was below 0.05 in 25 % of classes without
    any association, where three of 15 students had 20 sessions each. Raises ``StudyRefusedError`` ``ids``: a student is
    in one file only.
    """
    lost = sorted({*answers.index} ^ {*metrics[STUDENT]})
    if lost:
        raise StudyRefusedError("ids", f"joining answers and metrics: {_first(lost)} in one of the files only")
    return metrics.groupby(STUDENT)[names].mean()
