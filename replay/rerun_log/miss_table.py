"""The misses as numbers inside the recording, so that a viewer finds the way to one from the file alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rerun as rr
from rerun.chunk import RrdReader

from replay.audit.outcome import Miss
from replay.errors import RunFolderError
from replay.rerun_log.columns import RecordingWriter
from replay.rerun_log.focus import moments


@dataclass(frozen=True)
class MissPlace:
    """Where and when to look for a miss.

    Parameters
    ----------
    number : the miss's number.
    session_ns : where the cursor meets it, in nanoseconds on the session timeline: its deepest frame, or where between
        frames it touches first (see ``moments``).
    cut_length : metres of intersection curve there.
    """

    number: int
    session_ns: int
    cut_length: float


def log_miss_table(writer: RecordingWriter, path: str, misses: Sequence[Miss]) -> None:
    """Send number, deepest moment and cut length of all misses as one static row; nothing where nothing was missed."""
    if not misses:  # Rerun refuses a row of empty columns.
        return
    at = moments(misses)
    frames, later = np.array([at[miss.number] for miss in misses], dtype=np.int64).T
    writer.static(
        path,
        rr.AnyValues(
            number=np.array([miss.number for miss in misses], dtype=np.int64),
            deepest_ns=writer.clock.ns[frames] + later,
            cut_length=np.array([miss.cut_length for miss in misses], dtype=np.float64),
        ),
    )


def read_misses(recording: Path, path: str = "world/missed/table") -> list[MissPlace]:
    """Misses of the first audited detector, as the recording has them.

    Raises
    ------
    RunFolderError
        The file cannot be read as a recording.
    """
    try:
        chunks = RrdReader(recording).stream().filter(content=f"/{path}").to_chunks()
    except (OSError, ValueError, RuntimeError) as error:
        raise RunFolderError(
            f"{recording} cannot be read as a recording ({error}); replay the session again"
        ) from error
    columns: dict[str, list[float]] = {}
    for chunk in chunks:
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            columns[name.rpartition(":")[2]] = batch.column(name).to_pylist()[0]
    rows = zip(columns.get("number", []), columns.get("deepest_ns", []), columns.get("cut_length", []), strict=True)
    return [MissPlace(int(number), int(ns), float(cut)) for number, ns, cut in rows]
