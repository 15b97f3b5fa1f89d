"""The text of a CSV: its encoding, what stands between its cells, where its table begins, what its columns are called.

Excel's line ``sep=;`` is passed over, and so is a row of units below the header. Columns may be set apart by several
spaces. Recordings are UTF-8; only questionnaires, which people type, are read in the encodings of spreadsheets too.
"""

import codecs
import csv
import io
import re
import tomllib
from collections.abc import Collection, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, Final

from sessions.errors import ImportFileError
from sessions.importers.csv_mapping import LENGTHS, ROW_MAJOR, CsvLayout
from sessions.input_files import opened

HEAD_BYTES: Final = 200_000
FIRST_BYTES: Final = 200
"""Bytes of a file in which a text of two bytes a letter has zeros."""
FIRST_ROWS: Final = 200
"""Rows by which a draft tells units and kinds of columns."""
LINES_ABOVE: Final = 50
"""Lines above the rows that are looked for a header, beside ``FIRST_ROWS``."""
DELIMITERS: Final = (",", ";", "\t", " ")
SPREADSHEET_DELIMITERS: Final = (",", ";", "\t", "|")
"""Characters that spreadsheets put between columns; where the decimal comma is usual, Excel writes semicolons."""

SEPARATOR: Final = re.compile('"?sep=(.)"?', re.IGNORECASE)
"""The line that Excel begins a CSV with to say what stands between its cells."""

DECIMAL_COMMA: Final = re.compile(r"[+-]?\d+,\d+")
BYTE_ORDER_MARK: Final = codecs.BOM_UTF8
ENCODINGS: Final = {
    codecs.BOM_UTF32_LE: "UTF-32",
    codecs.BOM_UTF32_BE: "UTF-32",
    codecs.BOM_UTF16_LE: "UTF-16",
    codecs.BOM_UTF16_BE: "UTF-16",
}
"""First bytes of a text in another encoding than UTF-8 that says so; those of UTF-32 begin with those of UTF-16."""
VOCABULARY: Final[dict[str, Any]] = tomllib.loads(Path(__file__).with_name("csv_words.toml").read_text("utf-8"))
"""What words of a column's name say: its kind, the axis of an angle, a unit; and wall clocks beside ISO 8601."""
STATED_UNIT: Final = re.compile(r"[\[(]\s*([^\])]+?)\s*[\])]")
"""What a column's name holds in brackets."""
TIME: Final = frozenset(VOCABULARY["time"])
KNOWN_UNITS: Final = frozenset(VOCABULARY["units"].values())
STATED_LENGTHS: Final = (*LENGTHS, "um")
DATE: Final = re.compile(r"[0-9]{1,4}([-/.])[0-9]{1,2}\1[0-9]{1,4}")
SUFFIXES, TIME_SUFFIXES = frozenset(VOCABULARY["suffixes"]), frozenset(VOCABULARY["time_suffixes"])
NUMBER: Final = re.compile(r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?|nan|NaN")
UNITS: Final = frozenset(VOCABULARY["units"]) | frozenset(VOCABULARY["more_units"])
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
        if not self.units:
            return ""
        return str(VOCABULARY["units"].get(bare_unit(self.units[self.columns.index(column)]), ""))


def read_head(source: Path, known: Collection[str] = ()) -> CsvHead:
    """The head of a file that no mapping describes; a first line with all the ``known`` names is its header.

    Raises ``ImportFileError``: the text is in UTF-16, or the file cannot be read.
    """
    with opened(source, "recording", ImportFileError) as stream:
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
            return CsvHead(source, _layout(delimiter, rows, skipped), tuple(cells[0]), rows)
    for delimiter in delimiters:
        cells = split_lines(lines[skipped:], delimiter)
        first = next((k for k, row in enumerate(cells) if len(row) > 1 and _numbers(row) * 2 >= len(row)), None)
        if first is not None:
            return _of_rows(source, lines[skipped:], cells, first, delimiter, skipped)
    columns = tuple(re.split("[,;\t]", lines[skipped])) if lines[skipped:] else ()
    return CsvHead(source, _layout(separator or ",", (), skipped), columns)


def _of_rows(
    source: Path, lines: Sequence[str], cells: list[list[str]], first: int, delimiter: str, skipped: int
) -> CsvHead:
    """The head of a file whose rows begin at the line ``first`` of those that are not skipped."""
    width, above, units = len(cells[first]), first - 1, tuple[str, ...]()
    if above > 0 and is_row_of_units(cells[above]) and len(cells[above - 1]) == width:
        units = tuple(cells[above])
        above -= 1
    columns, own = (cells[above] if first else []), tuple[str, ...]()
    if len(columns) != width and (not columns or _numbers(columns) or columns[0].startswith("#")):
        # No line names the columns, or a comment does.
        above = first
        columns = lines[first - 1].lstrip("#% ").split() if first else []
        if len(columns) != width:
            columns = list(NAMELESS.get(width, _numbered_columns(width)))
        own = tuple(columns)
    rows = [tuple(row) for row in cells[first : first + FIRST_ROWS] if len(row) == len(columns)]
    layout = _layout(delimiter, rows, skipped + max(above, 0), own)
    return CsvHead(source, layout, tuple(columns), tuple(rows), units)


def _numbered_columns(width: int) -> tuple[str, ...]:
    return tuple(f"column_{k + 1}" for k in range(width))


def _layout(delimiter: str, rows: Sequence[Sequence[str]], skip_lines: int, columns: tuple[str, ...] = ()) -> CsvLayout:
    """Decimal commas can only stand where no comma is between the cells."""
    return CsvLayout(delimiter, decimal_letter(delimiter, rows[:1]), skip_lines=skip_lines, columns=columns)


def check_encoding(source: Path, data: bytes) -> None:
    """Refuse text in another encoding than UTF-8 that says so by its first bytes, or by zeros between its letters."""
    first = data[:FIRST_BYTES]
    if encoding := named_encoding(data) or ("UTF-16" if 4 * first.count(0) > len(first) else ""):
        raise ImportFileError(f"{source}: this is no CSV text in UTF-8 but in {encoding}; save it as UTF-8")


def is_row_of_units(cells: Sequence[str]) -> bool:
    """Whether cells are units or empty, and one is a unit of a length, a time or an angle."""
    written = [bare_unit(cell) for cell in cells if cell.strip()]
    return any(cell in VOCABULARY["units"] for cell in written) and all(cell in UNITS for cell in written)


def bare_unit(cell: str) -> str:
    """A unit in small letters, without brackets."""
    return cell.strip(" []()").lower()


def name_and_unit(column: str) -> tuple[list[str], str]:
    """The words of a name, and the unit that it states; one that no mapping has as it stands there."""
    stated = STATED_UNIT.search(column)
    tokens = re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+", re.sub(r"[\[(].*?[\])]", "", column))
    unit = VOCABULARY["units"].get(stated[1].lower(), stated[1]) if stated else ""
    *before, last = [token.lower() for token in tokens] or [""]
    if before and (last in SUFFIXES or (last in TIME_SUFFIXES and not TIME.isdisjoint(before))):
        tokens.pop()
        unit = unit or VOCABULARY["units"][last]
    return tokens, unit


def name_tokens_of(column: str) -> list[str]:
    """Returns the words of a column's name."""
    return name_and_unit(column)[0]


def unit_in_name(column: str) -> str:
    """Returns the unit that a column's name states, as a mapping writes it, or ``""``.

    One that no mapping has is the text in the brackets.
    """
    return name_and_unit(column)[1]


def stated_units(units: Iterable[str], kind: Collection[str]) -> list[str]:
    """Returns the different units of a kind, such as lengths, among those that columns state.

    A text in brackets that is no unit at all may be one of this kind.
    """
    return [*dict.fromkeys(unit for unit in units if unit and (unit in kind or unit not in KNOWN_UNITS))]


def text_format(cell: str) -> str | None:
    """The format of a wall-clock text: "" for ISO 8601, else as ``strptime`` takes it; ``None`` where it is none."""
    for form in ("", *VOCABULARY["formats"]) if not NUMBER.fullmatch(cell) else ():
        with suppress(ValueError):
            _ = datetime.strptime(cell, form) if form else datetime.fromisoformat(cell)
            return form
    return None


def is_date_or_time(cell: str) -> bool:
    """Returns whether a text is a date, a time of day, or both."""
    return DATE.fullmatch(cell) is not None or text_format(cell) is not None


def _numbers(row: Sequence[str]) -> int:
    return sum(NUMBER.fullmatch(cell) is not None for cell in row)


def named_encoding(data: bytes) -> str:
    """Returns the encoding other than UTF-8 that the first bytes of a text name, or ``""``."""
    return next((name for start, name in ENCODINGS.items() if data.startswith(start)), "")


def decoded(data: bytes) -> str:
    """Returns a text by its byte order mark; without one as UTF-8, or else as Excel writes it on Windows.

    Raises UnicodeDecodeError: it is none of these.
    """
    if encoding := named_encoding(data):
        return data.decode(encoding)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252")


def excel_separator(line: str) -> str:
    """Returns the character that Excel's first line ``sep=;`` names, or ``""``."""
    match = SEPARATOR.fullmatch(line.strip("\r\n \ufeff"))
    return match[1] if match else ""


def split_lines(lines: Sequence[str], delimiter: str) -> list[list[str]]:
    """Returns the cells of lines, without spaces around them; spaces between cells may be several."""
    texts = (" ".join(line.split()) for line in lines) if delimiter == " " else lines
    return [[cell.strip() for cell in row] for row in csv.reader(texts, delimiter=delimiter)]


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
    text = decoded(data)
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
