"""All runs below a folder as one data set: a table each of contacts, misses, false contacts, events and metrics."""

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pyarrow as pa
import pyarrow.compute as pc

from replay.document.columns import FILE_TABLES, file_columns
from replay.document.metrics.row import TYPES_OF_MEASURES
from replay.document.tables import Column
from replay.errors import RunFolderError
from replay.prepare.session_input import require_folder
from replay.show.results.batch_parts import (
    SHARDS_FILE,
    TABLES_FOLDER,
    FolderMark,
    Shard,
    read_shards,
    summaries,
    write_shards,
)
from replay.show.results.parquet import COLUMN_TYPES, READING_ERRORS, SCHEMA, read_table
from replay.show.results.reading import checked_table
from replay.show.results.run_folder import READ_TABLES, SUMMARY_FILE, table_file

(RUN,) = file_columns("run")

ADDED_COLUMNS: Final = (RUN.name, *TYPES_OF_MEASURES)
"""Columns of metrics that are none: where a row is from, beside which reference, and what the detector took."""

DATA_SET: Final = {
    FILE_TABLES[name].joined: (f"{name}.parquet", {RUN.name: RUN, **columns_by_name})
    for name, columns_by_name in READ_TABLES.items()
}
"""Table -> the file in a run folder, and its columns by name."""


def read(folder: Path | str) -> dict[str, pa.Table]:
    """Read all run folders at or below a folder as tables to ask questions of.

    The tables are ``episodes`` (contacts), ``misses``, ``false_contacts``, ``events`` and ``metrics``. Every row has
    ``run`` (the run folder below ``folder``, with ``/``), ``session`` (16 hex digits over every pose), ``student``
    (the pseudonym, ``""``: none stated), ``task`` and ``stage``; those of metrics have ``oracle`` and ``vr_type`` too,
    and what the detector took (milliseconds of a frame: ``mean_ms``, ``p99_ms``, ``worst_ms``; null: not timed so).
    A session that was run twice is there twice. Raises
    ``RunFolderError``: there is no run folder, a table cannot be read, or a newer version wrote it.
    """
    run_set = find_runs(require_folder(folder))
    return {name: joined_table(run_set, name) for name in DATA_SET}


@dataclass(frozen=True)
class RunSet:
    """The run folders at or below a folder, by path, and the shards of batches that hold the rows of some of them."""

    top: Path
    runs: tuple[str, ...]
    shards: tuple[tuple[str, Shard, frozenset[str]], ...]  # path of the batch, shard, and whose rows of it are true

    def pieces(self, name: str, columns: Sequence[str] | None = None) -> Iterator[pa.Table]:
        """The rows of a table, those of some hundred runs at a time: by shard, then of each run that is in none.

        ``columns`` are those wanted; ``None``: all.
        """
        file, copied_runs = DATA_SET[name][0], set[str]()
        for batch, shard, valid_runs in self.shards:
            try:
                with _tight_memory():
                    rows = _plain_table(shard.file(self.top / batch, name), name, columns, shard=True)
            except RunFolderError:
                continue  # a shard is a copy: its rows are read from the run folders
            paths = pc.binary_join_element_wise(batch, rows["run"], "/") if batch else rows["run"]
            rows = rows.set_column(rows.column_names.index("run"), "run", paths)
            run_paths = _paths(batch, valid_runs)
            copied_runs |= run_paths
            # Whatever else stands in the file: a run is where its folder is.
            if not run_paths.issuperset(pc.unique(rows["run"]).to_pylist()):
                rows = rows.filter(pc.is_in(rows["run"], pa.array(sorted(run_paths), pa.string())))
            yield rows
        for run in self.runs:
            if run not in copied_runs and (self.top / run / file).is_file():
                yield rows_of_run(self.top, run, name)


@contextmanager
def _tight_memory() -> Iterator[None]:
    """Let Arrow allocate from the system: its own pool held 60 MB more for 120 MB of tables (2026-11-23)."""
    default_pool = pa.default_memory_pool()
    pa.set_memory_pool(pa.system_memory_pool())
    try:
        yield
    finally:
        pa.set_memory_pool(default_pool)


def find_runs(top_folder: Path) -> RunSet:
    """The run folders at or below a folder; those half written have hidden names and are left out.

    Raises ``RunFolderError``: there is none.
    """
    file_status_of_run = {
        file.parent: file_status
        for file, file_status in summaries(top_folder, SUMMARY_FILE)
        if table_file(file.parent, "episodes").is_file()
    }
    if not file_status_of_run:
        raise RunFolderError(f"{top_folder} holds no run folders; make them with `replay run`")
    shards = []
    for batch in sorted(
        file.parent.parent for file, _ in summaries(top_folder, SHARDS_FILE) if file.parent.name == TABLES_FOLDER
    ):
        for shard in read_shards(batch):
            # Rows of a folder that is gone or was made anew are none of its.
            valid_runs = {
                name for name, mark in shard.runs.items() if _is_unchanged(file_status_of_run.get(batch / name), mark)
            }
            if valid_runs:
                shards.append((_relative_path(top_folder, batch), shard, frozenset(valid_runs)))
    return RunSet(
        top_folder, tuple(_relative_path(top_folder, run) for run in sorted(file_status_of_run)), tuple(shards)
    )


def _is_unchanged(file_status: os.stat_result | None, mark: FolderMark) -> bool:
    return file_status is not None and (file_status.st_size, file_status.st_mtime_ns) == mark[1:]


def _relative_path(top_folder: Path, folder: Path) -> str:
    """The path of a folder below another; ``""``: the same."""
    path = folder.relative_to(top_folder).as_posix()
    return "" if path == "." else path


def _paths(batch: str, names: Iterable[str]) -> set[str]:
    return {f"{batch}/{name}" if batch else name for name in names}


def write_batch_tables(batch: Path, requests: Mapping[str, str]) -> None:
    """Copy the rows of the runs of a batch into its few files; ``requests`` are name -> what was asked of it.

    Raises ``RunFolderError``: a table cannot be read; ``OutputError``: they cannot be written.
    """
    mark_of_run = {}
    for name, request in requests.items():
        file_status = (batch / name / SUMMARY_FILE).stat()
        mark_of_run[name] = (request, file_status.st_size, file_status.st_mtime_ns)
    write_shards(batch, mark_of_run, DATA_SET, lambda table, name: rows_of_run(batch, name, table))


def joined_table(run_set: RunSet, name: str) -> pa.Table:
    """One table of all runs; the columns that every run should have come first."""
    file, columns_by_name = DATA_SET[name]
    tables = [_no_rows(columns_by_name), *run_set.pieces(name)]
    try:
        return pa.concat_tables(tables, promote_options="default")
    except READING_ERRORS as error:
        raise RunFolderError(
            f"the tables {file} below {run_set.top} are not of one kind; run their sessions again"
        ) from error


def _no_rows(columns: Mapping[str, Column]) -> pa.Table:
    return pa.Table.from_batches(
        [], pa.schema([(name, COLUMN_TYPES[column.dtype]) for name, column in columns.items()])
    )


def rows_of_run(top_folder: Path, run: str, name: str) -> pa.Table:
    """The rows of one table of a run folder; of a run that has no such table none."""
    file, columns_by_name = DATA_SET[name]
    path = top_folder / run / file
    if not path.is_file():
        return _no_rows(columns_by_name)
    table = _plain_table(path, name)
    return table.append_column("run", pa.array([run or "."] * len(table), COLUMN_TYPES[str]))


def _plain_table(path: Path, name: str, columns: Sequence[str] | None = None, *, shard: bool = False) -> pa.Table:
    """A file with the rows of a table, with words in place of numbers of words, which differ from file to file.

    Only the file of a ``part`` says which run a row is of; ``columns``: read no others.
    """
    table = read_table(path, columns)
    schema = (table.schema.metadata or {}).get(b"schema", b"").decode(errors="replace")
    version = schema.rpartition("/")[2] or "0"
    if not version.isdecimal() or int(version[:9]) > int(SCHEMA.rpartition("/")[2]):
        raise RunFolderError(f"{path} has schema {schema!r}, this version reads up to {SCHEMA!r}; update it")
    columns_by_name = DATA_SET[name][1]
    if not shard:
        columns_by_name = {column: declared for column, declared in columns_by_name.items() if column != RUN.name}
        if RUN.name in table.column_names:
            table = table.drop_columns(RUN.name)
    if columns is not None:
        columns_by_name = {column: declared for column, declared in columns_by_name.items() if column in columns}
    return checked_table(path, table, columns_by_name)
