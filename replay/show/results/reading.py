"""The one reader of files of a run folder, which anybody may have sent: what it returns has the types a run writes.

A file that is none, a value of another type, a number beyond any recording, a row of a body that there is not: each
ends in one ``RunFolderError``. Nothing that is read leads to an import, or to a file outside the folder.
"""

import json
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import Any, Final

import pyarrow as pa
import pyarrow.compute as pc

from replay.document.coding import document_of
from replay.document.run_document import RunDocument
from replay.errors import RunFolderError
from replay.show.results.parquet import TYPES

LARGEST_INT: Final = 2**63 - 1
LARGEST_SECONDS: Final = 1e10
"""Seconds of any session, three hundred years; a sum of squares of larger numbers may not be finite."""

AGAIN: Final = "run its session again"

SECONDS: Final = ("start", "end", "time", "end_time")
NUMBERED: Final = ("number", "episode", "truth")
"""Columns that count from 1, where they are not null."""


def read_json(path: Path) -> Any:
    """Return the content of a JSON file.

    Raises ``ValueError``: no JSON, or a number that no run writes; ``OSError``: no readable file.
    """
    if not path.is_file():
        raise FileNotFoundError(f"{path} is no file")
    try:
        return json.loads(
            path.read_text(encoding="utf-8"), parse_int=_whole, parse_float=_finite, parse_constant=_constant
        )
    except RecursionError as error:
        raise ValueError("it is nested deeper than any summary") from error


def _whole(text: str) -> int:
    if len(text) > 20 or abs(int(text)) > LARGEST_INT:
        raise ValueError(f"{text[:20]} has more than 64 bits")
    return int(text)


def _finite(text: str) -> float:
    number = float(text)
    if not isfinite(number):
        raise ValueError(f"{text[:20]} is no finite number")
    return number


def _constant(text: str) -> Any:
    raise ValueError(f"{text} is no number of JSON")


def checked_document(path: Path, plain: Any) -> RunDocument:
    """Return the document that a file holds; ``RunFolderError`` names every value that is not as a run writes it."""
    document, problems = document_of(plain)
    if document is None:
        raise RunFolderError.of_problems(path, problems)
    return document


def checked_table(path: Path, table: pa.Table, kinds: Mapping[str, type], needed: frozenset[str]) -> pa.Table:
    """A table whose columns have these types, dictionaries unpacked; ``needed`` columns are there and hold no null.

    Numbers are finite, and seconds those of a session. A column that is not known stays where it is plain. Raises
    ``RunFolderError``.
    """
    if missing := sorted(needed - set(table.column_names)):
        raise RunFolderError(f"{path} lacks the column {missing[0]!r}; {AGAIN}")
    if len(set(table.column_names)) < len(table.column_names):
        raise RunFolderError(f"{path} has two columns of one name; {AGAIN}")
    for index, name in enumerate(table.column_names):
        column = table.column(index)
        type_ = column.type.value_type if pa.types.is_dictionary(column.type) else column.type
        allowed = (TYPES[kinds[name]], pa.null()) if name in kinds else tuple(TYPES.values())
        if type_ not in allowed:
            raise RunFolderError(f"{path}: the column {name!r} is {type_}, not {allowed[0]}; {AGAIN}")
        column = column.cast(allowed[0]) if name in kinds else column.cast(type_)
        _require_plain(path, name, column, needed)
        table = table.set_column(index, name, column)
    return table


def _require_plain(path: Path, name: str, column: pa.ChunkedArray, needed: frozenset[str]) -> None:
    """Refuse a column with values that no run writes."""
    if name in needed and column.null_count:
        raise RunFolderError(f"{path}: the column {name!r} has a row without a value; {AGAIN}")
    # No number of Python goes into these calculations: to take one, Arrow loads pandas where it is installed, 36 MB.
    if pa.types.is_floating(column.type):
        limit = LARGEST_SECONDS if name in SECONDS else 1e300
        least, most = (end or 0.0 for end in pc.min_max(column).as_py().values())
        wrong = max(-least, most) > limit or pc.any(pc.is_nan(column)).as_py()
    elif pa.types.is_integer(column.type) and not name.endswith("stamp_ns"):
        smallest = pc.min_max(column).as_py()["min"]
        wrong = smallest is not None and smallest < (1 if name in NUMBERED else 0)
    else:
        wrong = False
    if wrong:
        raise RunFolderError(f"{path}: the column {name!r} has a value that no run writes; {AGAIN}")


def checked_contacts(path: Path, table: pa.Table, document: RunDocument) -> pa.Table:
    """Rows of contacts, misses or false contacts that are of the detectors, bodies and frames of a document."""
    bodies = document.session.bodies.keys()
    named = {"detector": document.detectors.keys(), "body_a": bodies, "body_b": bodies}
    for column, names in named.items():
        for word in pc.unique(table[column]).to_pylist():
            if word not in names:
                raise RunFolderError(f"{path}: {word[:40]!r} is no {column.partition('_')[0]} of its run; {AGAIN}")
    if not len(table):
        return table
    ordered = pc.all(pc.less_equal(table["first"], table["last"])).as_py()
    within = pc.max(table["last"]).as_py() < document.session.frames
    in_time = pc.all(pc.less_equal(table["start"], table["end"])).as_py()
    in_session = all(
        pc.all(pc.less(table[name], document.session.frames)).as_py() is not False
        for name in ("deepest", "widest")
        if name in table.column_names
    )
    if not (ordered and within and in_time and in_session):
        raise RunFolderError(f"{path} has a row outside the frames of its run; {AGAIN}")
    numbers = table.group_by(["detector", "number"]).aggregate([])
    if len(numbers) < len(table):
        raise RunFolderError(f"{path} has two rows of one number; {AGAIN}")
    return table
