"""The one door to Parquet: plain rows in and out, with a type for every column, and the columns that join runs."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import pyarrow as pa
import pyarrow.parquet as pq

from replay.document.columns import file_columns
from replay.document.metrics.hands import ACTIVITY_KINDS, activities_at
from replay.document.metrics.row import pseudonym
from replay.document.run_result import RunResult
from replay.document.summary import session_digest
from replay.document.tables import ARROW_TYPES, Column, Table, types_of
from replay.errors import RunFolderError

COLUMN_TYPES: Final = {kind: pa.type_for_alias(name) for kind, name in ARROW_TYPES.items()}
"""Type of Python -> type of a column."""

READING_ERRORS: Final = (OSError, pa.ArrowException)
"""What reading a file raises that is no Parquet."""


def table_of(rows: Sequence[Mapping[str, Any]], type_of_name: Mapping[str, type]) -> pa.Table:
    """Rows with named values as a table of these columns."""
    columns = (Column(name, kind) for name, kind in type_of_name.items())
    return Table(tuple(columns), tuple(tuple(row[name] for name in type_of_name) for row in rows)).to_arrow()


MOST_ROWS_PER_BYTE: Final = 1000
"""Rows, and bytes of content, that a byte of a file can stand for; a file of a kilobyte can claim any number."""


def read_table(path: Path, columns: Sequence[str] | None = None) -> pa.Table:
    """A table of a run as it was written, or some of its columns; ``RunFolderError``: it cannot be read."""
    if not path.is_file():
        raise RunFolderError(f"{path} is no file; run its session again")
    try:
        # Read by this thread alone: one of Arrow's that lets go of a file while the interpreter ends aborts it, one
        # program in sixty (2026-11-22). `pq.read_table` would make columns of folders named like `student=S01` too.
        with path.open("rb") as file, pq.ParquetFile(file, pre_buffer=False) as table:
            _require_dense(table.metadata, file.seek(0, 2), path)
            read_rows = table.read(columns=columns, use_threads=False)
            read_rows.validate(full=True)
            return read_rows
    except READING_ERRORS as error:
        raise RunFolderError.unreadable(path, error) from error


def _require_dense(file_metadata: pq.FileMetaData, file_size: int, path: Path) -> None:
    """Refuse a table that is larger than a file of ``file_size`` bytes can be."""
    groups = [file_metadata.row_group(k) for k in range(file_metadata.num_row_groups)]
    uncompressed_bytes = sum(group.total_byte_size for group in groups)
    row_count = sum(group.num_rows for group in groups)
    if row_count != file_metadata.num_rows or max(row_count, uncompressed_bytes) > MOST_ROWS_PER_BYTE * file_size:
        raise RunFolderError(
            f"{path} claims {file_metadata.num_rows:,} rows that it does not hold; run its session again"
        )


KEY_TYPES: Final = types_of(file_columns("keys"))

SCHEMA: Final = "vrlab-replay/tables/2"
"""Stands as ``schema`` in the metadata of each table that has ``KEY_TYPES``; a table of version 1 has neither."""


def with_keys(table: pa.Table, result: RunResult) -> pa.Table:
    """A table with the columns ``KEY_TYPES``; rows of metrics, which are about a whole session, bring them.

    Task and stage are those at the row's ``stamp_ns``, or else at its ``first`` frame; null: none.
    """
    if not KEY_TYPES.keys() <= set(table.column_names):
        frames = result.assembly.stamp_ns
        stamps = table["stamp_ns"].to_numpy() if "stamp_ns" in table.column_names else frames[table["first"].to_numpy()]
        columns = [
            [session_digest(result)] * len(table),
            [pseudonym(result)] * len(table),
            *(activities_at(result.session, kind, stamps) for kind in ACTIVITY_KINDS),
        ]
        for name, values in zip(KEY_TYPES, columns, strict=True):
            table = table.append_column(name, pa.array(values, COLUMN_TYPES[str]))
    return table.replace_schema_metadata({"schema": SCHEMA})
