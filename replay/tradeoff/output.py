"""The files of a tradeoff: the table as Parquet and JSON, the picture as PNG and SVG; all of them or none."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Final
from uuid import uuid4

import pyarrow as pa
import pyarrow.parquet as pq

from replay.errors import OutputError
from replay.tradeoff.picture import picture
from replay.tradeoff.trading import Tradeoff

TABLE: Final = "tradeoff.parquet"
JSON: Final = "tradeoff.json"
PICTURES: Final = ("png", "svg")


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
    for kind in PICTURES:
        (folder / f"tradeoff.{kind}").write_bytes(picture(done.rows, title_of(done), kind))


def check_tradeoff_target(out: Path, *, force: bool = False) -> None:
    """Refuse a folder that cannot be written, before the work and not after.

    Raises
    ------
    OutputError
        Says what is in the way.
    """
    if out.is_file():
        raise OutputError(f"{out} is a file; name a folder")
    if out.exists() and any(out.iterdir()):
        if not (out / JSON).is_file():
            raise OutputError(f"{out} holds something else and is not replaced; name another folder")
        if not force:
            raise OutputError(f"{out} exists; name another folder, or replace it with --force")


def write_tradeoff_folder(done: Tradeoff, out: Path, *, force: bool = False) -> Path:
    """Write a folder of its own: complete under another name first, then renamed.

    Raises
    ------
    OutputError
        The folder is in the way, or cannot be written.
    """
    check_tradeoff_target(out, force=force)
    partial = out.with_name(f"{out.name}.{uuid4().hex[:8]}.partial")
    try:
        partial.mkdir(parents=True)
        write_tradeoff(done, partial)
        if out.exists():
            shutil.rmtree(out)
        partial.rename(out)
    except OSError as error:
        raise OutputError(f"{out} cannot be written: {error}; look at space and rights") from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)
    return out
