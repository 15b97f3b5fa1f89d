"""Questionnaire and metrics, joined student by student; a row that cannot be joined is counted and named."""

import csv
import re
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Final

from replay.errors import StudyError
from replay.studies.class_study.codebook import Codebook, Item
from replay.studies.class_study.refusals import StudyRefusedError
from sessions.file_kinds import file_kind, named_encoding
from sessions.importers.csv_head import spreadsheet_rows
from sessions.input_files import read_bytes

if TYPE_CHECKING:
    from pandas import DataFrame, Series

PSEUDONYM: Final = re.compile(r"(?=.*\d)[A-Za-z0-9_-]{1,32}")
"""A pseudonym has a digit and neither space nor sign: ``S01``. A name has no digit, an address has a sign."""

STUDENT: Final = "student"
DETECTOR: Final = "detector"
RECALL_COLUMN: Final = "recall"
CONTACT_FRAMES: Final = "contact_frames"


def check_pseudonyms(students: Sequence[str], file_text: str) -> None:
    """Refuse, as ``ids``, what is missing or looks like a name or an address; rows are named, never the words."""
    wrong_rows = [k + 1 for k, student in enumerate(students) if not PSEUDONYM.fullmatch(student)]
    if wrong_rows:
        message = (
            f"{file_text}, data row {_first_five_text(wrong_rows)}: no pseudonym (letters and at least "
            f"one digit, as S01)"
        )
        raise StudyRefusedError("ids", message)


def _first_five_text(listed_items: Sequence[object]) -> str:
    """At most five of them."""
    return ", ".join(map(str, listed_items[:5])) + (", ..." if len(listed_items) > 5 else "")


def read_rows(path: Path) -> list[dict[str, str]]:
    """Rows of a CSV file as spreadsheets write it: with commas, semicolons or tabs, in UTF-8, UTF-16 or Windows-1252.

    A first line ``sep=;`` is obeyed. Where columns are not set apart by commas, ``2,5`` is read as ``2.5``. Empty rows
    are left out, names of columns lose the space around them. Raises ``StudyError``: not such a file, a row longer
    than the heading, or two columns of one name.
    """
    try:
        data = read_bytes(path, "table", StudyError)
        kind = file_kind(data)
        if kind is not None and not named_encoding(data):
            raise StudyError(f"table {path} is {kind}")
        lines = spreadsheet_rows(data)
    except (UnicodeDecodeError, csv.Error) as error:
        raise StudyError(f"{path} cannot be read as CSV: {error}") from error
    if not lines:
        return []
    column_names, *data_lines = lines
    repeated_names = [name for name in column_names if name and column_names.count(name) > 1]
    if repeated_names:
        raise StudyError(f"{path.name} has two columns {repeated_names[0]!r}; give each a name of its own")
    rows = []
    for number, line in enumerate(data_lines, start=1):
        if any(line[len(column_names) :]):
            raise StudyError(
                f"{path.name}, data row {number}: {len(line)} cells below {len(column_names)} names of columns"
            )
        padded_cells = [*line, *[""] * (len(column_names) - len(line))]
        rows.append(dict(zip(column_names, padded_cells, strict=False)))
    return rows


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
    missing_columns = [name for name in columns if name not in rows[0]]
    if missing_columns:
        raise StudyError(f"{path.name} lacks the column {missing_columns[0]!r} that the codebook names")
    table = DataFrame(rows, columns=columns, dtype=str).fillna("").apply(lambda column: column.str.strip())
    students = table[codebook.student]
    check_pseudonyms(students.tolist(), path.name)
    repeated_names = sorted(set(students[students.duplicated()]))
    if repeated_names:
        raise StudyRefusedError("ids", f"{path.name}: {', '.join(repeated_names[:5])} answered more than once")
    if codebook.groups and not {*table[codebook.group_column]} <= {*codebook.groups}:
        message = f"{path.name}: {codebook.group_column} holds a group that the codebook does not declare"
        raise StudyRefusedError("undeclared-groups", message)
    for item in codebook.items:
        table[item.name] = _numeric_answers(table[item.name], item, path.name)
    return table.set_index(codebook.student).sort_index()


def _numeric_answers(answer_texts: "Series", item: Item, file_text: str) -> "Series":
    """One column as numbers, turned where the item is reverse-coded."""
    from pandas import to_numeric

    numbers = to_numeric(answer_texts, errors="coerce").astype(float)
    smallest, largest = item.scale
    wrong_rows = answer_texts[(answer_texts != "") & ~numbers.between(smallest, largest)]
    for row, text in wrong_rows.items():
        raise StudyError(
            f"{file_text}, data row {row + 1}, column {item.name}: {text!r:.40} is not between {smallest:g} and "
            f"{largest:g}, the scale of this item; declare another in the codebook "
            f"(`{item.name}: {{..., scale: [0, 100]}}`), or leave the cell empty if nothing was answered"
        )
    return smallest + largest - numbers if item.reversed else numbers


def recall_of(metrics: "DataFrame") -> float | None:
    """Share of all contact frames of all rows that are reported; ``None`` when it was not measured in each row."""
    # A row without contacts has no recall; one whose contacts were not counted is no such row.
    contact_rows = metrics[metrics[CONTACT_FRAMES] != 0]
    reported_frames = (contact_rows[RECALL_COLUMN] * contact_rows[CONTACT_FRAMES]).sum(skipna=False)
    return (
        float(reported_frames / contact_rows[CONTACT_FRAMES].sum())
        if len(contact_rows) and reported_frames == reported_frames
        else None
    )


def means_of_students(metrics: "DataFrame", answers: "DataFrame", names: Sequence[str]) -> "DataFrame":
    """Means of columns of metrics over the sessions of each student who is in both files.

    One value a student: with the rows of sessions and cluster-robust errors p was below 0.05 in 25 % of classes without
    any association, where three of 15 students had 20 sessions each. Raises ``StudyRefusedError`` ``ids``: no student
    is in both files.
    """
    common_rows = metrics[metrics[STUDENT].isin(answers.index)]
    if not len(common_rows):
        raise StudyRefusedError("ids", "joining answers and metrics: no student is in both files")
    return common_rows.groupby(STUDENT)[names].mean()


def unmatched_students(answers: Iterable[str], recorded_students: Iterable[str]) -> list[str]:
    """A sentence for each student of one file who is not in the other, with the pseudonym that may be meant.

    ``answers``: pseudonyms of the questionnaire; ``recorded_students``: pseudonyms of the sessions.
    """
    answering_students, recording_students = {*answers}, {*recorded_students}
    only_answers = sorted(answering_students - recording_students)
    only_recorded = sorted(recording_students - answering_students)
    sentences = []
    for student in only_answers:
        sentences.append(
            f"{student!r} of the questionnaire matches no recording{_suggestion_text(student, only_recorded)}"
        )
    for student in only_recorded:
        sentences.append(
            f"{student!r} of the recordings is not in the questionnaire{_suggestion_text(student, only_answers)}"
        )
    return sentences


def _suggestion_text(student: str, candidates: Sequence[str]) -> str:
    """``; did you mean 'S07'?`` for the one candidate that differs in case, spaces, zeros or a single letter."""
    equal_candidates = [
        candidate for candidate in candidates if _normalised_pseudonym(candidate) == _normalised_pseudonym(student)
    ]
    near_candidates = equal_candidates or get_close_matches(student, candidates, n=1, cutoff=0.75)
    return f"; did you mean {near_candidates[0]!r}?" if len(near_candidates) == 1 else ""


def _normalised_pseudonym(student: str) -> str:
    """A pseudonym without case, signs and leading zeros: "s-07" and "S7" are alike."""
    return re.sub(r"(?<!\d)0+(?=\d)", "", re.sub(r"[\s_-]", "", student.casefold()))
