"""Contacts that an engine reported, as a CSV of ``time, a, b, begin|end`` on the engine's own clock."""

import csv
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Final

from sessions.errors import ImportFileError
from sessions.file_kinds import file_kind
from sessions.importers.csv_columns_and_units import CLOCK_NS, name_and_unit
from sessions.importers.csv_head import widest_delimiter
from sessions.importers.csv_table import excel_separator
from sessions.importers.ledger import Ledger
from sessions.input_files import read_text
from sessions.model.event import LiveContact

PHASE_OF: Final = {"begin": "enter", "enter": "enter", "end": "exit", "exit": "exit", "stay": "stay"}
"""Words of the last column and what they mean."""
ENGINE_WORD: Final = re.compile(
    r"(?:on)?(?:component|actor|collision|trigger)*(begin|enter|end|exit|stay)(?:overlap)?(?:2d)?"
)
"""Names of an engine's own messages around these words, without underscores and in small letters."""

COLUMNS: Final = ("time", "a", "b", "what")
COLUMN_NAMES: Final = {
    "time": ("time", "t", "seconds", "timestamp"),
    "a": ("a", "bodya", "body1", "first", "objecta"),
    "b": ("b", "bodyb", "body2", "second", "other", "objectb"),
    "what": ("what", "event", "phase", "kind", "type"),
}
"""Column -> its names in small letters, without underscores and spaces."""
FORM: Final = "write four: time, a, b, begin or end"
REPEATED: Final = "that repeat a report"
LONGEST_STAMP_NS: Final = 9_000_000_000_000_000_000
"""Beyond it nanoseconds no longer fit 64 bits: the year 2255 of the Unix epoch."""


@dataclass(frozen=True)
class _Layout:
    """Indices of the four columns in the order of ``COLUMNS``, and the unit of the times."""

    indices: tuple[int, ...] = (0, 1, 2, 3)
    unit: str = "s"


def read_contacts(source: str | Path, ledger: Ledger) -> tuple[LiveContact, ...]:
    """Every report of the file in order of time, each once; stamps are nanoseconds of the file's own clock.

    ``source``: rows ``time, a, b, what``: seconds, two body names, begin or end (enter, exit, stay). A header may name
    the columns in another order, and the unit of time. Cells are set apart by commas, semicolons, tabs or ``|``.

    Raises ``ImportFileError``: names file and line: another number of columns, a time that is none, an unknown word, a
    body that touches itself; or nothing is in it.
    """
    path = Path(source)
    text = read_text(path, "contact file", ImportFileError)
    if kind := file_kind(text.encode()):
        raise ImportFileError(f"contact file {path} is {kind}")
    rows = list(_rows(path, text))
    if not rows:
        raise ImportFileError(f"{path} holds no contact; write rows of: time, a, b, begin or end")
    contacts = {(row.time_ns, frozenset((row.body_a, row.body_b)), row.phase): row for row in reversed(rows)}.values()
    merged = {REPEATED: len(rows) - len(contacts)}
    ledger.book("contacts", path.name, read=len(rows), kept=len(contacts), merged=merged)
    return tuple(sorted(contacts, key=lambda contact: contact.time_ns))


def _rows(path: Path, text: str) -> Iterator[LiveContact]:
    lines = text.splitlines()
    separator = excel_separator(lines[0])
    first = next((line for line in lines[bool(separator) :] if line.strip() and not _is_remark(line)), "")
    delimiter = separator or widest_delimiter(first)
    layout = None
    for number, cells in enumerate(csv.reader(lines, delimiter=delimiter), 1):
        row = [cell.strip() for cell in cells]
        if not any(row) or _is_remark(row[0]) or (number == 1 and separator):
            continue
        where = f"{path}: line {number}"
        if layout is None:
            layout = _layout_of(where, row)
            if layout is not None:
                continue
            layout = _Layout()
        if len(row) != len(COLUMNS):
            raise ImportFileError(f"{where}: {len(row)} column{'s' * (len(row) != 1)}; {FORM}")
        time, a, b, what = (row[index] for index in layout.indices)
        phase = _phase(what)
        if not phase:
            raise ImportFileError(f"{where}: {what[:40]!r} is neither begin nor end; use one of: {', '.join(PHASE_OF)}")
        if a == b or not (a and b):
            raise ImportFileError(f"{where}: the bodies are {a[:40]!r} and {b[:40]!r}; name two bodies")
        yield LiveContact(_stamp(where, time, layout.unit, delimiter), a, b, phase)


def _is_remark(line: str) -> bool:
    return line.lstrip().startswith("#")


def _phase(word: str) -> str:
    """Returns the phase that a word of the last column means, or ``""``."""
    match = ENGINE_WORD.fullmatch(word.lower().replace("_", ""))
    return PHASE_OF[match[1]] if match else ""


def _layout_of(where: str, row: list[str]) -> _Layout | None:
    """Returns the layout that a header names; ``None``: the row is none.

    Where it names no column, its columns are in the usual order.

    Raises ImportFileError: it names a column twice, too few or too many.
    """
    names = [name_and_unit(cell) for cell in row]
    plain = ["".join(tokens).lower() for tokens, _ in names]
    matches = {column: [k for k, name in enumerate(plain) if name in COLUMN_NAMES[column]] for column in COLUMNS}
    if not any(matches.values()):
        is_header = len(row) == len(COLUMNS) and not _phase(row[-1]) and not any(map(_is_number, row))
        return _Layout() if is_header else None
    if any(map(_is_number, row)) or (len(row) == len(COLUMNS) and _phase(row[-1])):
        return None  # of a row with bodies of such names
    if len(row) == len(COLUMNS) and all(matches[column] in ([], [k]) for k, column in enumerate(COLUMNS)):
        matches = {column: [k] for k, column in enumerate(COLUMNS)}  # names of others stand in the usual order
    missing = [column for column in COLUMNS if len(matches[column]) != 1]
    if len(row) == len(COLUMNS) and len(missing) == 1 and not matches[missing[0]]:
        matches[missing[0]] = [k for k in range(len(row)) if [k] not in matches.values()]
        missing = []
    if missing or len(row) != len(COLUMNS):
        lack = f", and {missing[0]!r} {'twice' if matches[missing[0]] else 'not'}" if missing else ""
        raise ImportFileError(f"{where}: the header names {', '.join(map(repr, row))[:80]}{lack}; {FORM}")
    indices = tuple(matches[column][0] for column in COLUMNS)
    unit = names[indices[0]][1] or "s"
    if unit not in CLOCK_NS:
        raise ImportFileError(f"{where}: {unit[:20]!r} is no unit of time; write seconds")
    return _Layout(indices, unit)


def _is_number(cell: str) -> bool:
    with suppress(ValueError):
        float(cell.replace(",", "."))
        return True
    return False


def _stamp(where: str, text: str, unit: str, delimiter: str) -> int:
    number = text if delimiter == "," else text.replace(",", ".")
    with suppress(InvalidOperation, OverflowError, ValueError):
        stamp = int((Decimal(number) * int(CLOCK_NS[unit])).to_integral_value())
        if abs(stamp) < LONGEST_STAMP_NS:
            return stamp
    raise ImportFileError(f"{where}: {text[:40]!r} is no time in seconds; write seconds of one clock")
