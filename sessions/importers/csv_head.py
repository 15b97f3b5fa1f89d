"""The head of a CSV that no mapping describes: its delimiter, where its table begins, what its columns are called.

Columns may be set apart by several spaces. Recordings are UTF-8; only questionnaires, which people type, are read in
the encodings of spreadsheets too.
"""

import csv
import io
import re
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from sessions.errors import ImportFileError
from sessions.file_kinds import named_encoding
from sessions.importers.csv_columns_and_units import (
    ROW_MAJOR,
    VOCABULARY,
    CsvLayout,
    is_row_of_units,
    unit_in_cell,
    unit_in_name,
)
from sessions.importers.csv_missing import EMPTY_CELLS
from sessions.importers.csv_table import (
    NUMBER,
    ends_empty,
    excel_separator,
    split_lines,
)
from sessions.importers.wall_clock import wall_clock_ns
from sessions.input_files import check_encoding, open_input

HEAD_BYTES: Final = 200_000
VECTOR: Final = re.compile(r"[(\[]\s*-?[0-9.eE+-]+(?:\s*[,; ]\s*-?[0-9.eE+-]+){1,3}\s*[)\]]")
"""Numbers of a vector in brackets, as Unity prints one."""
FIRST_ROWS: Final = 200
"""Rows by which a draft tells units and kinds of columns."""
LINES_ABOVE: Final = 50
"""Lines above the rows that are looked for a header, beside ``FIRST_ROWS``."""
DELIMITERS: Final = (",", ";", "\t", "|", " ")
SPREADSHEET_DELIMITERS: Final = (",", ";", "\t", "|")
"""Characters that spreadsheets put between columns; where the decimal comma is usual, Excel writes semicolons."""

NAMES: Final = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "bars", " ": "spaces"}
"""Delimiters as a sentence names them."""
DRAWN_LINE: Final = re.compile(r"\s*[|+]?[\s:]*-{2,}[-:\s]*([|+][-:\s]*)+")
"""A line of dashes between bars or crosses, as below the header of a table in Markdown or of a database's shell."""
INFINITE: Final = re.compile("[-+]?inf(inity)?", re.IGNORECASE)
"""A number that no pose has; its row is one of the table all the same."""
DECIMAL_COMMA: Final = re.compile(r"[+-]?\d+,\d+")
DIGIT: Final = re.compile(r"\d")
"""A text without a digit is no date and no time of day."""
DATE: Final = re.compile(r"[0-9]{1,4}([-/.])[0-9]{1,2}\1[0-9]{1,4}")
UNORDERED: Final = ("q1", "q2", "q3", "q4")
"""A quaternion whose order a file does not tell: TUM's files have the scalar last, others first."""
NAMELESS: Final = {12: ROW_MAJOR, 8: ("timestamp", "tx", "ty", "tz", *UNORDERED)}
"""Columns of files that do not name them, by their number: KITTI, and a stamp with a place and a quaternion."""


@dataclass(frozen=True)
class CsvHead:
    """How a file is to be read, its columns, and the cells of its first rows.

    Parameters
    ----------
    layout : with ``columns`` where no line of the file names them.
    columns : a name each.
    rows : at most ``FIRST_ROWS``, each as long as ``columns``.
    units : the row of units below the header, or nothing.
    """

    source: Path
    layout: CsvLayout
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...] = ()
    units: tuple[str, ...] = ()

    @property
    def columns_by_number(self) -> bool:
        """Whether nothing in the file names its columns: their meaning is taken from how many they are."""
        width = len(self.columns)
        return bool(self.layout.columns) and self.columns in (NAMELESS.get(width), _numbered_columns(width))

    def cells(self, column: str) -> list[str]:
        """The first cells of a column."""
        index = self.columns.index(column)
        return [row[index] for row in self.rows]

    def numbers(self, column: str) -> list[float]:
        """The numbers among the first cells of a column."""
        return [float(cell.replace(",", ".")) for cell in self.cells(column) if NUMBER.fullmatch(cell)]

    def stated_unit(self, column: str) -> str:
        """The unit that a column's name or the row of units states, or nothing."""
        return unit_in_name(column) or self.unit(column)

    def unit(self, column: str) -> str:
        """The unit that the row of units gives a column, or nothing."""
        return unit_in_cell(self.units[self.columns.index(column)]) if self.units else ""


def read_head(source: Path, known: Collection[str] = ()) -> CsvHead:
    """The head of a file that no mapping describes; a first line with all the ``known`` names is its header.

    Raises ``ImportFileError``: the text is in UTF-16, or the file cannot be read.
    """
    with open_input(source, "recording", ImportFileError) as stream:
        data = stream.read(HEAD_BYTES)
    check_encoding(source, data)
    lines = data.decode("utf-8-sig", errors="replace").splitlines()[: FIRST_ROWS + LINES_ABOVE]
    separator = excel_separator(lines[0]) if lines else ""
    delimiters = (separator,) if separator else DELIMITERS
    skipped = 1 if separator else 0
    for delimiter in delimiters:
        cells = split_lines(lines[skipped:], delimiter)
        if known and cells and {*known} <= {*cells[0]}:
            rows = tuple(tuple(row) for row in cells[1:] if len(row) == len(cells[0]))[:FIRST_ROWS]
            if any(map(any, cells[1:])) and not rows:  # other characters stand between the cells of the rows
                continue
            return CsvHead(source, _layout(delimiter, rows, skipped), tuple(cells[0]), rows)
    unlike_header = None
    for delimiter in delimiters:
        cells = split_lines(lines[skipped:], delimiter)
        first = _first_row(cells)
        if first is not None and (first == 0 or len(cells[first - 1]) == len(cells[first])):
            return _of_rows(source, lines[skipped:], cells, first, delimiter, skipped)
        # Decimal commas between semicolons look like few cells, but then the header has another number of them.
        if first is not None and unlike_header is None:
            unlike_header = cells, first, delimiter
    if unlike_header is not None:
        return _of_rows(source, lines[skipped:], *unlike_header, skipped)
    for number, line in enumerate(lines[: skipped + FIRST_ROWS], 1):
        if DRAWN_LINE.fullmatch(line):
            raise _drawn_table_error(source, number)
        if vector := VECTOR.search(line):
            raise ImportFileError(
                f"{source}: line {number}: {vector[0][:40]!r} is several numbers in one cell; export a column for each"
            )
    columns = tuple(re.split("[,;\t]", lines[skipped])) if lines[skipped:] else ()
    return CsvHead(source, _layout(separator or ",", (), skipped), columns)


def _first_row(cells: Sequence[Sequence[str]]) -> int | None:
    """The first row of which half the cells are numbers, or the rows above it that lack theirs; ``None``: no row."""
    first = next((k for k, row in enumerate(cells) if len(row) > 1 and _numbers(row) * 2 >= len(row)), None)
    if first is None:  # all the first rows lack their numbers
        named = (k for k in range(1, len(cells)) if all(cells[k - 1]) and not _numbers(cells[k - 1]))
        return next((k for k in named if len(cells[k - 1]) == len(cells[k]) and _lacks_numbers(cells[k], ())), None)
    width = len(cells[first])
    known = {cell for row in cells[first:] for cell in row}
    while first > 0 and len(cells[first - 1]) == width and _lacks_numbers(cells[first - 1], known):
        first -= 1
    return first


def _lacks_numbers(row: Sequence[str], known: Collection[str]) -> bool:
    """Whether a row holds nothing but numbers, dates, words for missing numbers, and cells that rows below have."""
    return all(cell in EMPTY_CELLS or cell in known or _is_measured(cell) for cell in row) and any(
        map(_is_measured, row)
    )


def _is_measured(cell: str) -> bool:
    return bool(NUMBER.fullmatch(cell) or INFINITE.fullmatch(cell)) or is_date_or_time(cell)


def _of_rows(
    source: Path, lines: Sequence[str], cells: list[list[str]], first: int, delimiter: str, skipped: int
) -> CsvHead:
    """The head of a file whose rows begin at the line ``first`` of those that are not skipped."""
    width, above, units = len(cells[first]), first - 1, tuple[str, ...]()
    while above > 0 and not any(cells[above]):  # empty lines
        above -= 1
    if above > 0 and is_row_of_units(cells[above]) and len(cells[above - 1]) == width:
        units = tuple(cells[above])
        above -= 1
    columns, own = (cells[above] if first else []), tuple[str, ...]()
    if any(map(DRAWN_LINE.fullmatch, lines[max(above - 1, 0) : first + 2])):
        number = skipped + 1 + next(k for k, line in enumerate(lines) if DRAWN_LINE.fullmatch(line))
        raise _drawn_table_error(source, number)
    if len(columns) == 1 and (other := _header_delimiter(columns[0], width)):
        raise ImportFileError(
            f"{source}: line {skipped + above + 1} has {NAMES[other]} between its cells, the rows below have "
            f"{NAMES[delimiter]}; write the same in both"
        )
    if len(columns) != width and (not columns or _numbers(columns) or columns[0].startswith("#")):
        # No line names the columns, or a comment does.
        above = first
        columns = lines[first - 1].lstrip("#% ").split() if first else []
        if len(columns) != width:
            columns = list(NAMELESS.get(width, _numbered_columns(width)))
        own = tuple(columns)
    if not own and len(columns) == width - 1 and columns[-1] and ends_empty(cells[first]):
        columns = [*columns, ""]
    rows = [tuple(row) for row in cells[first : first + FIRST_ROWS] if len(row) == len(columns)]
    layout = _layout(delimiter, rows, skipped + max(above, 0), own)
    return CsvHead(source, layout, tuple(columns), tuple(rows), units)


def _drawn_table_error(source: Path, number: int) -> ImportFileError:
    return ImportFileError(
        f"{source}: line {number} draws a table, as in Markdown; save the table as CSV, without drawn lines"
    )


def _header_delimiter(line: str, width: int) -> str:
    """The delimiter that cuts a header into as many cells as its rows have, or ``""``."""
    fits = (delimiter for delimiter in DELIMITERS if len(split_lines([line], delimiter)[0]) == width)
    return next(fits, "") if not line.startswith("#") else ""


def _numbered_columns(width: int) -> tuple[str, ...]:
    return tuple(f"column_{k + 1}" for k in range(width))


def _layout(delimiter: str, rows: Sequence[Sequence[str]], skip_lines: int, columns: tuple[str, ...] = ()) -> CsvLayout:
    """Decimal commas can only stand where no comma is between the cells."""
    return CsvLayout(delimiter, decimal_letter(delimiter, rows[:1]), skip_lines=skip_lines, columns=columns)


def text_format(cells: Sequence[str]) -> str | None:
    """The format of the wall-clock texts of a column: "" for ISO 8601, else as ``strptime`` takes it.

    ``None``: the first text is none. Of several formats that most texts fit, such as those with day and month in either
    order, it is the one by which their times are closest together.
    """
    if not cells or NUMBER.fullmatch(cells[0]) or not DIGIT.search(cells[0]):
        return None
    best, fitting_best = None, (0, 0)
    for form in ("", *VOCABULARY["formats"]):
        if _stamp_or_none(cells[0], form) is None:
            continue
        stamps = [stamp for stamp in (_stamp_or_none(cell, form) for cell in cells) if stamp is not None]
        fitting = (len(stamps), min(stamps) - max(stamps))
        if fitting > fitting_best:
            best, fitting_best = form, fitting
    return best


def _stamp_or_none(cell: str, form: str) -> int | None:
    with suppress(ValueError):
        return wall_clock_ns(cell, form)
    return None


def is_date_or_time(cell: str) -> bool:
    """Returns whether a text is a date, a time of day, or both."""
    return DATE.fullmatch(cell) is not None or text_format([cell]) is not None


def _numbers(row: Sequence[str]) -> int:
    return sum(NUMBER.fullmatch(cell) is not None for cell in row)


def decoded_text(data: bytes) -> str:
    """Returns a text by its byte order mark; without one as UTF-8, or else as Excel writes it on Windows.

    Raises UnicodeDecodeError: it is none of these.
    """
    if encoding := named_encoding(data):
        return data.decode(encoding)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252")


def widest_delimiter(line: str) -> str:
    """Returns the delimiter that cuts a line into most cells; the comma where none cuts it."""
    return max(SPREADSHEET_DELIMITERS, key=lambda delimiter: len(next(csv.reader([line], delimiter=delimiter), [])))


def decimal_letter(delimiter: str, rows: Sequence[Sequence[str]]) -> str:
    """Returns the decimal comma where cells hold one and no comma stands between them, else the point."""
    has_commas = delimiter in ";\t|" and any(DECIMAL_COMMA.fullmatch(cell) for row in rows for cell in row)
    return "," if has_commas else "."


def spreadsheet_rows(data: bytes) -> list[list[str]]:
    """Returns the rows of a spreadsheet that are not empty; numbers with decimal commas become those with points.

    Raises UnicodeDecodeError, csv.Error: it is no such text.
    """
    text = decoded_text(data)
    first, _, rest = text.partition("\n")
    delimiter = excel_separator(first)
    if delimiter:
        text = rest
    else:
        delimiter = widest_delimiter(next((line for line in text.splitlines() if line.strip()), ""))
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter)
    rows = [row for row in ([cell.strip() for cell in line] for line in reader) if any(row)]
    if decimal_letter(delimiter, rows[1:]) == ".":
        return rows
    points = ([cell.replace(",", ".") if DECIMAL_COMMA.fullmatch(cell) else cell for cell in row] for row in rows[1:])
    return [*rows[:1], *points]
