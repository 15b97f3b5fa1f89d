"""Where the cursor meets each moment, as the recording says it: ``replay view`` and a shared page are led by it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Any, Final

import numpy as np
import rerun as rr
from rerun.chunk import RrdReader

from replay.errors import RunFolderError
from replay.outputs.rerun_log.columns import RecordingWriter

TABLE: Final = "moments/table"


@dataclass(frozen=True)
class MomentPlace:
    """Where the cursor meets a moment; ``kind``: "miss", "false" or "contact"; ``leads``: the picture opens there."""

    label: str
    kind: str
    number: int
    session_ns: int
    leads: bool


MOMENT_COLUMNS: Final = tuple(one.name for one in fields(MomentPlace))


def log_moment_table(writer: RecordingWriter, places: Sequence[MomentPlace]) -> None:
    """Send where to look."""
    rows = zip(*map(astuple, places), strict=True)
    columns: dict[str, Any] = {name: list(values) for name, values in zip(MOMENT_COLUMNS, rows, strict=True)}
    for name, kind in (("number", np.int64), ("leads", np.bool_), ("session_ns", np.int64)):
        columns[name] = np.array(columns[name], dtype=kind)
    writer.static(TABLE, rr.AnyValues(**columns))


def read_moments(recording: Path) -> list[MomentPlace]:
    """The moments, as a recording has them; none in one that compares nothing."""
    try:
        chunks = RrdReader(recording).stream().filter(content=f"/{TABLE}").to_chunks()
    except (OSError, ValueError, RuntimeError) as error:
        why = f"{recording} cannot be read as a recording ({error})"
        raise RunFolderError(f"{why}; replay the session again") from error
    columns: dict[str, list[Any]] = {}
    for batch in (chunk.to_record_batch() for chunk in chunks):
        columns |= {name.rpartition(":")[2]: batch.column(name).to_pylist()[0] for name in batch.schema.names}
    return [MomentPlace(*row) for row in zip(*(columns.get(name, []) for name in MOMENT_COLUMNS), strict=True)]
