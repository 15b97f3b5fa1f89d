"""All runs below a folder as one data set: a table each of contacts, misses, false contacts, events and metrics."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import pyarrow as pa

from replay.errors import RunFolderError
from replay.metrics.row import METRICS as METRIC_COLUMNS
from replay.outputs.results.fault_tables import FALSE_COLUMNS, FALSE_MEASURES, MISS_COLUMNS, MISS_MEASURES
from replay.outputs.results.parquet import KEYS, SCHEMA, TYPES, UNREADABLE, read_table
from replay.outputs.results.parquet_tables import EPISODE_COLUMNS, EVENT_COLUMNS, HEADS
from replay.outputs.results.reading import checked_table, read_json
from replay.outputs.results.run_folder import (
    EPISODES,
    EVENTS,
    FALSE_CONTACTS,
    METRICS,
    MISSES,
    READ_TABLES,
    SUMMARY,
)

RUN: Final[dict[str, type]] = {"run": str}

SAID: Final = ("oracle", "vr_type")
"""Columns of metrics from the summary of a run, which has them at any age."""

ADDED: Final = ("run", *SAID)
"""Columns that reading adds; a file that has one of them was written by nobody's run."""

YOUNGER: Final = frozenset(("cause",))
"""Columns that readers of one run need and older versions did not write."""

DATA_SET: Final[dict[str, tuple[str, Mapping[str, type]]]] = {
    "episodes": (EPISODES, RUN | HEADS | EPISODE_COLUMNS | KEYS),
    "misses": (MISSES, RUN | HEADS | MISS_COLUMNS | MISS_MEASURES | KEYS),
    "false_contacts": (FALSE_CONTACTS, RUN | HEADS | FALSE_COLUMNS | FALSE_MEASURES | KEYS),
    "events": (EVENTS, RUN | EVENT_COLUMNS | KEYS),
    "metrics": (METRICS, RUN | METRIC_COLUMNS | dict.fromkeys(SAID, str)),
}
"""Table -> the file in a run folder, and its columns."""


def read(folder: Path | str) -> dict[str, pa.Table]:
    """Read all run folders at or below a folder, of any age, as tables to ask questions of.

    The tables are ``episodes`` (contacts), ``misses``, ``false_contacts``, ``events`` and ``metrics``. Every row has
    ``run`` (the run folder below ``folder``, with ``/``), ``session`` (16 hex digits over every pose), ``student``
    (the pseudonym, ``""``: none stated), ``task`` and ``stage``; those of metrics have ``oracle`` and ``vr_type`` too.
    What an older version did not write is null. A session that was run twice is there twice. Raises
    ``RunFolderError``: there is no run folder, a table cannot be read, or a newer version wrote it.
    """
    top = Path(folder)
    runs = run_folders(top)
    if not runs:
        raise RunFolderError(f"{top} holds no run folders; make them with `replay run`")
    return {name: _joined(top, runs, file, kinds) for name, (file, kinds) in DATA_SET.items()}


def run_folders(folder: Path) -> list[Path]:
    """The run folders at or below a folder, by path; those half written have hidden names and are left out."""
    found = (file.parent for file in folder.rglob(SUMMARY) if (file.parent / EPISODES).is_file())
    return sorted(run for run in found if not any(part.startswith(".") for part in run.relative_to(folder).parts))


def _joined(top: Path, runs: list[Path], name: str, kinds: Mapping[str, type]) -> pa.Table:
    """One table of all runs; the columns that every run should have come first."""
    parts = [pa.schema([(column, TYPES[kind]) for column, kind in kinds.items()]).empty_table()]
    for run in runs:
        if (run / name).is_file():
            table, columns = _plain(run / name, kinds), {"run": run.relative_to(top).as_posix()}
            columns |= _said(run) if name == METRICS else {}
            for column, value in columns.items():
                table = table.append_column(column, pa.array([value] * len(table), TYPES[str]))
            parts.append(table)
    try:
        return pa.concat_tables(parts, promote_options="default")
    except UNREADABLE as error:
        raise RunFolderError(f"the tables {name} below {top} are not of one kind ({error})") from error


def _said(run: Path) -> dict[str, Any]:
    """The detector that is trusted in a run, and how its session was seen."""
    try:
        summary = read_json(run / SUMMARY)
        words = summary.get("oracle"), summary["session"]["facts"].get("vr_type")
        if not all(isinstance(word, str | None) for word in words):
            raise TypeError("oracle or vr_type is no text")
        return dict(zip(SAID, words, strict=True))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise RunFolderError(f"{run / SUMMARY} cannot be read ({error!r}); run its session again") from error


def _plain(file: Path, kinds: Mapping[str, type]) -> pa.Table:
    """A table with words in place of numbers of words, which differ from file to file."""
    table = read_table(file)
    schema = (table.schema.metadata or {}).get(b"schema", b"").decode(errors="replace")
    version = schema.rpartition("/")[2] or "0"
    if not version.isdecimal() or int(version[:9]) > int(SCHEMA.rpartition("/")[2]):
        raise RunFolderError(f"{file} has schema {schema!r}, this version reads up to {SCHEMA!r}; update it")
    needed = READ_TABLES[file.name][1] - YOUNGER
    table = table.drop_columns([column for column in ADDED if column in table.column_names])
    return checked_table(file, table, kinds, needed)
