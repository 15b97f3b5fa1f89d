"""The one reader of files of a run folder, which anybody may have sent: what it returns has the types a run writes.

A file that is none, a value of another type, a number beyond any recording, a row of a body that there is not: each
ends in one ``RunFolderError``. Nothing that is read leads to an import, or to a file outside the folder.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pyarrow as pa
import pyarrow.compute as pc

from replay.errors import RunFolderError
from replay.outputs.results.parquet import TYPES

if TYPE_CHECKING:
    from jsonschema import Draft202012Validator

LARGEST_INT: Final = 2**63 - 1
LARGEST_SECONDS: Final = 1e10
"""Seconds of any session, three hundred years; a sum of squares of larger numbers may not be finite."""

AGAIN: Final = "run its session again"

SECONDS: Final = ("start", "end", "time", "end_time")
NUMBERED: Final = ("number", "episode", "truth")
"""Columns that count from 1, where they are not null."""


def read_json(path: Path) -> Any:
    """What a JSON file holds; ``ValueError``: no JSON, a number that no run writes, ``OSError``: no readable file."""
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


def checked_summary(path: Path, summary: Mapping[str, Any]) -> dict[str, Any]:
    """A summary whose values have the types of ``summary.schema.json``; keys that it does not know stay as they are."""
    fault = next(_schema().iter_errors(summary), None)
    if fault is not None:
        where = ".".join(str(key) for key in fault.absolute_path) or "the summary"
        raise RunFolderError(f"{path}: {where} is not as a run writes it ({fault.message[:120]}); {AGAIN}")
    labels = summary["detectors"].keys()
    unknown = summary["audit"].keys() - labels
    if unknown or (summary["audit"] and summary["oracle"] not in labels):
        name = next(iter(unknown), summary["oracle"])
        raise RunFolderError(f"{path} speaks of {name!r}, which is none of its detectors; {AGAIN}")
    if {answer["label"] for answer in summary["answers"]} != summary["audit"].keys():
        raise RunFolderError(f"{path}: answers are told of other detectors than those audited; {AGAIN}")
    return dict(summary)


@cache
def _schema() -> Draft202012Validator:
    from jsonschema import Draft202012Validator

    references = []

    def opened(part: dict[str, Any]) -> dict[str, Any]:
        """What another version wrote besides does a reader no harm."""
        if part.get("additionalProperties") is False:
            del part["additionalProperties"]
        if "$ref" in part:
            references.append(part)
        return part

    text = files("replay.outputs.results").joinpath("summary.schema.json").read_text(encoding="utf-8")
    schema = json.loads(text, object_hook=opened)
    # jsonschema looks every reference up anew for every value, which took two thirds of the time.
    for part in references:
        part |= schema["$defs"][part.pop("$ref").rpartition("/")[2]]
    return Draft202012Validator(schema)


def checked_table(path: Path, table: pa.Table, kinds: Mapping[str, type], needed: frozenset[str]) -> pa.Table:
    """A table whose columns have these types, dictionaries unpacked; ``needed`` columns are there and hold no null.

    Numbers are finite, and seconds those of a session. A column that is not known stays where it is plain. Raises
    ``RunFolderError``.
    """
    if missing := sorted(needed - set(table.column_names)):
        raise RunFolderError(f"{path} lacks the column {missing[0]!r}; {AGAIN}")
    if len(set(table.column_names)) < len(table.column_names):
        raise RunFolderError(f"{path} has two columns of one name; {AGAIN}")
    for place, name in enumerate(table.column_names):
        column = table.column(place)
        type_ = column.type.value_type if pa.types.is_dictionary(column.type) else column.type
        allowed = (TYPES[kinds[name]], pa.null()) if name in kinds else tuple(TYPES.values())
        if type_ not in allowed:
            raise RunFolderError(f"{path}: the column {name!r} is {type_}, not {allowed[0]}; {AGAIN}")
        column = column.cast(allowed[0]) if name in kinds else column.cast(type_)
        _require_plain(path, name, column, needed)
        table = table.set_column(place, name, column)
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


def checked_contacts(path: Path, table: pa.Table, summary: Mapping[str, Any]) -> pa.Table:
    """Rows of contacts, misses or false contacts that are of the detectors, bodies and frames of a summary."""
    named = {"detector": summary["detectors"], "body_a": summary["session"]["bodies"]}
    named["body_b"] = named["body_a"]
    for column, names in named.items():
        for word in pc.unique(table[column]).to_pylist():
            if word not in names:
                raise RunFolderError(f"{path}: {word[:40]!r} is no {column.partition('_')[0]} of its run; {AGAIN}")
    if not len(table):
        return table
    ordered = pc.all(pc.less_equal(table["first"], table["last"])).as_py()
    within = pc.max(table["last"]).as_py() < summary["session"]["frames"]
    in_time = pc.all(pc.less_equal(table["start"], table["end"])).as_py()
    there = all(
        pc.all(pc.less(table[name], summary["session"]["frames"])).as_py() is not False
        for name in ("deepest", "widest")
        if name in table.column_names
    )
    if not (ordered and within and in_time and there):
        raise RunFolderError(f"{path} has a row outside the frames of its run; {AGAIN}")
    numbers = table.group_by(["detector", "number"]).aggregate([])
    if len(numbers) < len(table):
        raise RunFolderError(f"{path} has two rows of one number; {AGAIN}")
    return table
