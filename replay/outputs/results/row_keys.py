"""Who and where a row is: the columns by which the tables of many runs are joined, and the version of all columns."""

from typing import Final

import pyarrow as pa

from replay.metrics.hands import DOING, doing
from replay.metrics.row import pseudonym, session_digest
from replay.outputs.results.parquet import TYPES
from replay.pipeline.run_result import RunResult

KEYS: Final[dict[str, type]] = dict.fromkeys(("session", "student", *DOING), str)

SCHEMA: Final = "vrlab-replay/tables/2"
"""Stands as ``schema`` in the metadata of each table that has ``KEYS``; a table of version 1 has neither."""


def with_keys(table: pa.Table, result: RunResult) -> pa.Table:
    """A table with the columns ``KEYS``; rows of metrics, which are about a whole session, bring them.

    Task and stage are those at the row's ``stamp_ns``, or else at its ``first`` frame; null: none.
    """
    if not KEYS.keys() <= set(table.column_names):
        frames = result.assembly.stamp_ns
        stamps = table["stamp_ns"].to_numpy() if "stamp_ns" in table.column_names else frames[table["first"].to_numpy()]
        columns = [
            [session_digest(result)] * len(table), [pseudonym(result)] * len(table),
            *(doing(result.session, kind, stamps) for kind in DOING),
        ]  # fmt: skip
        for name, values in zip(KEYS, columns, strict=True):
            table = table.append_column(name, pa.array(values, TYPES[str]))
    return table.replace_schema_metadata({"schema": SCHEMA})
