"""The tables of a batch in few files: parts of some hundred runs each, and a list of which run stands in which part.

``batch.tables/misses/part-00000-<digest>.parquet`` holds the misses of the runs of a part, by name; any engine that
reads a folder of Parquet files reads ``batch.tables/misses``. A part is written before the list names it, and removed
after the list does not: whoever is killed leaves the old list or the new one.
"""

import hashlib
import json
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import pyarrow as pa
import pyarrow.parquet as pq

from replay.errors import OutputError
from replay.show.results.reading import read_json
from sessions.whole_files import whole_file

TABLES_FOLDER: Final = "batch.tables"
SHARDS_FILE: Final = "parts.json"
SCHEMA: Final = "vrlab-replay/parts/1"

RUNS_PER_SHARD: Final = 500
"""Runs of a part: of a hundred thousand there are 200 files a table."""

GROUP_ROWS: Final = 16_384
"""Rows that are read together: who asks for one session reads those of a few others, and not the whole part."""

STEM_PATTERN: Final = re.compile(r"part-\d{5}-[0-9a-f]{16}")

FolderMark = tuple[str, int, int]
"""What a run folder was when its rows were copied: what was asked of it, and size and time of its summary."""

TableOf = Callable[[str, str], pa.Table]
"""Name of a table and name of a run -> the rows of that run."""


@dataclass(frozen=True)
class Shard:
    """Some runs of a batch whose rows stand in one file a table; ``runs`` are name -> what the run was then."""

    stem: str
    runs: Mapping[str, FolderMark]

    def file(self, batch: Path, table: str) -> Path:
        """Return the file of its rows of a table."""
        return batch / TABLES_FOLDER / table / f"{self.stem}.parquet"


def read_shards(batch: Path) -> tuple[Shard, ...]:
    """The parts of a batch; none where there is no list of them that can be read."""
    try:
        index_data = read_json(batch / TABLES_FOLDER / SHARDS_FILE)
        if index_data["schema"] != SCHEMA:
            return ()
        shards = [
            Shard(str(entry["stem"]), {name: _mark(mark) for name, mark in entry["runs"].items()})
            for entry in index_data["parts"]
        ]
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return ()
    return tuple(shards) if all(STEM_PATTERN.fullmatch(shard.stem) for shard in shards) else ()


def _mark(mark_values: Any) -> FolderMark:
    request, size, changed = mark_values
    return str(request), int(size), int(changed)


def write_shards(batch: Path, runs: Mapping[str, FolderMark], tables: Iterable[str], rows_of: TableOf) -> None:
    """Write the tables of a batch anew where its runs are not those of before; ``rows_of`` makes the rows of a run.

    Raises ``OutputError``: they cannot be written.
    """
    old_stems = {shard.stem for shard in read_shards(batch)}
    run_names, tables = sorted(runs), tuple(tables)
    name_chunks = [run_names[start : start + RUNS_PER_SHARD] for start in range(0, len(run_names), RUNS_PER_SHARD)]
    shards = [_shard(number, {name: runs[name] for name in chunk}) for number, chunk in enumerate(name_chunks)]
    for shard in shards:
        if shard.stem not in old_stems:
            for table in tables:
                _write_shard(shard.file(batch, table), shard, table, rows_of)
    index_text = json.dumps({"schema": SCHEMA, "parts": [{"stem": shard.stem, "runs": shard.runs} for shard in shards]})
    with whole_file(batch / TABLES_FOLDER / SHARDS_FILE, OutputError, parents=True) as file:
        file.write(index_text.encode())
    kept_stems = {shard.stem for shard in shards}
    for table in tables:
        for written_file in (batch / TABLES_FOLDER / table).glob("part-*.parquet"):
            if written_file.stem not in kept_stems:
                with suppress(OSError):
                    written_file.unlink()


def _shard(number: int, runs: dict[str, FolderMark]) -> Shard:
    digest = hashlib.sha256(json.dumps(runs, sort_keys=True).encode()).hexdigest()
    return Shard(f"part-{number:05d}-{digest[:16]}", runs)


def _write_shard(target: Path, shard: Shard, table: str, rows_of: TableOf) -> None:
    """One file of a table, with the rows of a part in order of its runs."""
    shard_rows = pa.concat_tables([rows_of(table, name) for name in shard.runs], promote_options="default")
    with whole_file(target, OutputError, parents=True) as file:
        pq.write_table(shard_rows, file, compression="zstd", row_group_size=GROUP_ROWS)


def summaries(top_folder: Path, file_name: str) -> Iterator[tuple[Path, os.stat_result]]:
    """Files of a name at or below a folder, in no hidden folder, with size and time; no link is followed."""
    pending_folders = [top_folder]
    while pending_folders:
        try:
            with os.scandir(pending_folders.pop()) as entries:
                for entry in entries:
                    if entry.is_dir(follow_symlinks=False):
                        if not entry.name.startswith("."):
                            pending_folders.append(Path(entry.path))
                    elif entry.name == file_name:
                        yield Path(entry.path), entry.stat()
        except OSError:
            continue
