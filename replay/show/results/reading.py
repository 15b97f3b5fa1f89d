"""The one reader of files of a run folder, which anybody may have sent: what it returns has the types a run writes.

A file that is none, a value of another type, a number beyond any recording, a row of a body that there is not: each
ends in one ``RunFolderError``. Nothing that is read leads to an import, or to a file outside the folder.
"""

import json
from collections.abc import Collection, Mapping
from math import isfinite
from pathlib import Path
from typing import Any, Final

import pyarrow as pa

from replay.document.coding import document_of
from replay.document.run_document import RunDocument
from replay.document.tables import Column, Holds
from replay.errors import RunFolderError
from replay.show.results.parquet import COLUMN_TYPES

LARGEST_INT: Final = 2**63 - 1
LARGEST_SECONDS: Final = 1e10
"""Seconds of any session, three hundred years; a sum of squares of larger numbers may not be finite."""

RUN_AGAIN: Final = "run its session again"


def read_json(path: Path) -> Any:
    """Return the content of a JSON file.

    Raises ``ValueError``: no JSON, or a number that no run writes; ``OSError``: no readable file.
    """
    if not path.is_file():
        raise FileNotFoundError(f"{path} is no file")
    try:
        return json.loads(
            path.read_text(encoding="utf-8"),
            parse_int=_parse_int,
            parse_float=_parse_finite_float,
            parse_constant=_refuse_constant,
        )
    except RecursionError as error:
        raise ValueError("it is nested deeper than any summary") from error


def _parse_int(text: str) -> int:
    if len(text) > 20 or abs(int(text)) > LARGEST_INT:
        raise ValueError(f"{text[:20]} has more than 64 bits")
    return int(text)


def _parse_finite_float(text: str) -> float:
    number = float(text)
    if not isfinite(number):
        raise ValueError(f"{text[:20]} is no finite number")
    return number


def _refuse_constant(text: str) -> Any:
    raise ValueError(f"{text} is no number of JSON")


def checked_document(path: Path, json_value: Any) -> RunDocument:
    """Return the document that a file holds; ``RunFolderError`` names every value that is not as a run writes it."""
    document, problems = document_of(json_value)
    if document is None:
        raise RunFolderError.of_problems(path, problems)
    return document


def checked_table(path: Path, table: pa.Table, columns: Mapping[str, Column]) -> pa.Table:
    """A table whose columns have these types, dictionaries unpacked; required ones are there and hold no null.

    Numbers are finite, and seconds those of a session. A column that is not known stays where it is plain. Raises
    ``RunFolderError``.
    """
    required_names = {name for name, column in columns.items() if column.required}
    if missing_names := sorted(required_names - set(table.column_names)):
        raise RunFolderError(f"{path} lacks the column {missing_names[0]!r}; {RUN_AGAIN}")
    if len(set(table.column_names)) < len(table.column_names):
        raise RunFolderError(f"{path} has two columns of one name; {RUN_AGAIN}")
    for index, name in enumerate(table.column_names):
        values, declared_column = table.column(index), columns.get(name, Column(name))
        type_ = values.type.value_type if pa.types.is_dictionary(values.type) else values.type
        allowed_types = (
            (COLUMN_TYPES[declared_column.dtype], pa.null()) if name in columns else tuple(COLUMN_TYPES.values())
        )
        if type_ not in allowed_types:
            raise RunFolderError(f"{path}: the column {name!r} is {type_}, not {allowed_types[0]}; {RUN_AGAIN}")
        values = values.cast(allowed_types[0]) if name in columns else values.cast(type_)
        _require_plain(path, declared_column, values)
        table = table.set_column(index, name, values)
    return table


def _require_plain(path: Path, column: Column, values: pa.ChunkedArray) -> None:
    """Refuse a column with values that no run writes."""
    if column.required and values.null_count:
        raise RunFolderError(f"{path}: the column {column.name!r} has a row without a value; {RUN_AGAIN}")
    from pyarrow import compute as pc

    # No number of Python goes into these calculations: to take one, Arrow loads pandas where it is installed, 36 MB.
    if pa.types.is_floating(values.type):
        largest_value = LARGEST_SECONDS if column.unit == "s" else 1e300
        smallest_value, greatest_value = (extreme or 0.0 for extreme in pc.min_max(values).as_py().values())
        has_wrong_value = max(-smallest_value, greatest_value) > largest_value or pc.any(pc.is_nan(values)).as_py()
    elif pa.types.is_integer(values.type) and column.unit != "ns":
        smallest = pc.min_max(values).as_py()["min"]
        has_wrong_value = smallest is not None and smallest < (1 if column.holds is Holds.NUMBER else 0)
    else:
        has_wrong_value = False
    if has_wrong_value:
        raise RunFolderError(f"{path}: the column {column.name!r} has a value that no run writes; {RUN_AGAIN}")


def checked_rows(path: Path, table: pa.Table, columns: Mapping[str, Column], document: RunDocument) -> pa.Table:
    """Rows whose detectors, bodies and frames are those of a document, and whose intervals do not run backwards."""
    from pyarrow import compute as pc  # a run that writes tables and reads none does without: 30 ms

    known_names: dict[Holds | None, Collection[str]] = {
        Holds.DETECTOR: document.detectors.keys(),
        Holds.BODY: document.session.bodies.keys(),
    }
    frames = document.session.frames
    present_columns = [columns[name] for name in table.column_names if name in columns]
    for column in present_columns:
        for text in pc.unique(table[column.name]).to_pylist() if column.holds in known_names else ():
            if text not in known_names[column.holds]:
                raise RunFolderError(f"{path}: {text[:40]!r} is no {column.holds} of its run; {RUN_AGAIN}")
    is_in_session = all(
        pc.all(pc.less(table[column.name], frames)).as_py() is not False
        for column in present_columns
        if column.holds is Holds.FRAME
    )
    is_ordered = all(
        pc.all(pc.less_equal(table[first], table[last])).as_py() is not False
        for first, last in (("first", "last"), ("start", "end"))
        if first in columns
    )
    if not (is_in_session and is_ordered):
        raise RunFolderError(f"{path} has a row outside the frames of its run; {RUN_AGAIN}")
    if "number" in columns:
        numbers = table.group_by(["detector", "number"]).aggregate([])
        if len(numbers) < len(table):
            raise RunFolderError(f"{path} has two rows of one number; {RUN_AGAIN}")
    return table
