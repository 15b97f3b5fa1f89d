"""Contacts that an engine reported, as a CSV of ``time, a, b, begin|end`` on the engine's own clock."""

import csv
from collections.abc import Iterator
from contextlib import suppress
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Final

from sessions.errors import ImportFileError
from sessions.importers.ledger import Ledger
from sessions.input_files import read_text
from sessions.model.event import LiveContact

PHASE_OF: Final = {"begin": "enter", "enter": "enter", "end": "exit", "exit": "exit", "stay": "stay"}
"""Words of the last column and what they mean."""

COLUMNS: Final = 4
LONGEST_STAMP_NS: Final = 9_000_000_000_000_000_000
"""Beyond it nanoseconds no longer fit 64 bits: the year 2255 of the Unix epoch."""


def read_contacts(source: str | Path, ledger: Ledger) -> tuple[LiveContact, ...]:
    """Every report of the file in order of time; stamps are nanoseconds of the file's own clock.

    ``source``: rows ``time, a, b, what``: seconds, two body names, begin or end (enter, exit, stay); a header is
    skipped.

    Raises ``ImportFileError``: names file and line: another number of columns, a time that is none, an unknown word; or
    nothing is in it.
    """
    path = Path(source)
    contacts = list(_rows(path, read_text(path, "contact file", ImportFileError)))
    if not contacts:
        raise ImportFileError(f"{path} holds no contact; write rows of: time, a, b, begin or end")
    ledger.book("contacts", path.name, read=len(contacts), kept=len(contacts))
    return tuple(sorted(contacts, key=lambda contact: contact.time_ns))


def _rows(path: Path, text: str) -> Iterator[LiveContact]:
    for line, cells in enumerate(csv.reader(text.splitlines()), 1):
        row = [cell.strip() for cell in cells]
        if not any(row) or (line == 1 and row[0].lower() in ("time", "t", "time_s", "seconds")):
            continue
        where = f"{path}: line {line}"
        if len(row) != COLUMNS:
            raise ImportFileError(f"{where}: {len(row)} columns; write four: time, a, b, begin or end")
        phase = PHASE_OF.get(row[3].lower())
        if phase is None:
            raise ImportFileError(
                f"{where}: {row[3][:40]!r} is neither begin nor end; use one of: {', '.join(PHASE_OF)}"
            )
        yield LiveContact(_stamp(where, row[0]), row[1], row[2], phase)


def _stamp(where: str, text: str) -> int:
    with suppress(InvalidOperation, OverflowError, ValueError):
        stamp = int((Decimal(text) * 1_000_000_000).to_integral_value())
        if abs(stamp) < LONGEST_STAMP_NS:
            return stamp
    raise ImportFileError(f"{where}: {text[:40]!r} is no time in seconds; write seconds of one clock")
