"""Text as spreadsheets save it: what stands between its cells, its encoding, its decimal commas.

The importers of recordings and the reader of questionnaires share it. Recordings are UTF-8; only questionnaires, which
people type, are read in the other encodings too.
"""

import codecs
import csv
import io
import re
from collections.abc import Sequence
from typing import Final

DELIMITERS: Final = (",", ";", "\t", "|")
"""Characters that spreadsheets put between columns; where the decimal comma is usual, Excel writes semicolons."""

SEPARATOR: Final = re.compile('"?sep=(.)"?', re.IGNORECASE)
"""The line that Excel begins a CSV with to say what stands between its cells."""

DECIMAL_COMMA: Final = re.compile(r"[+-]?\d+,\d+")
BYTE_ORDER_MARK: Final = codecs.BOM_UTF8
ENCODINGS: Final = {codecs.BOM_UTF16_LE: "UTF-16", codecs.BOM_UTF16_BE: "UTF-16"}
"""First bytes of a text in another encoding than UTF-8 that says so."""


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
    return max(DELIMITERS, key=lambda delimiter: len(next(csv.reader([line], delimiter=delimiter), [])))


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
