"""The files of a tradeoff: the table as Parquet and JSON, the picture as PNG and SVG and for dark pages."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import pyarrow as pa
import pyarrow.parquet as pq

from replay.pipeline.run_result import Tradeoff
from replay.tradeoffs.picture import DARK, LIGHT, picture

TABLE: Final = "tradeoff.parquet"
JSON: Final = "tradeoff.json"
PICTURES: Final = {
    "tradeoff.png": ("png", LIGHT), "tradeoff.svg": ("svg", LIGHT), "tradeoff-dark.png": ("png", DARK),
}  # fmt: skip


def title_of(done: Tradeoff) -> str:
    """What the picture is called."""
    about = done.about
    return (
        f"What accuracy costs: {about['session']}, {about['contacts']} contacts, {about['frames']:,} frames, "
        f"beside {about['oracle']}"
    )


def table_of(done: Tradeoff) -> pa.Table:
    """One row per setting; counters as a JSON text, because every algorithm counts something else."""
    return pa.Table.from_pylist([{**row, "work": json.dumps(row["work"], sort_keys=True)} for row in done.rows])


def write_tradeoff(done: Tradeoff, folder: Path) -> None:
    """Write the files into a folder that exists."""
    pq.write_table(table_of(done), folder / TABLE)
    text = json.dumps(done.as_json(), indent=1, allow_nan=False)
    (folder / JSON).write_text(text + "\n", encoding="utf-8", newline="\n")
    for name, (kind, theme) in PICTURES.items():
        (folder / name).write_bytes(picture(done.rows, title_of(done), kind, theme))


@contextmanager
def tradeoff_files(done: Tradeoff) -> Iterator[dict[str, Path]]:
    """Name -> file, as ``write_run_folder`` takes further files; they are gone when the block ends."""
    with TemporaryDirectory() as folder:
        write_tradeoff(done, Path(folder))
        yield {path.name: path for path in sorted(Path(folder).iterdir())}
