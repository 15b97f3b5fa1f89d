"""Cameras of close-ups, and what a recording says of itself.

The close-up's eye is data, not layout: a camera entity whose pose changes from miss to miss. The viewer tracks it, so
wherever the cursor goes, by click, key or play, the view stands before the nearest miss with nothing in between.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
from rerun.chunk import RrdReader

from replay.errors import RunFolderError
from replay.outputs.camera import Eye, look_rotation
from replay.outputs.rerun_log.columns import RecordingWriter, pose_columns


def log_eyes(writer: RecordingWriter, path: str, at: Sequence[tuple[int, int]], eyes: Sequence[Eye]) -> None:
    """Send a camera that stands elsewhere from each moment on: a frame, and nanoseconds after it."""
    writer.rows_later(path, at, eye_columns(eyes))
    log_lens(writer, path)


def eye_columns(eyes: Sequence[Eye]) -> rr.ComponentColumnList:
    """Poses of a camera."""
    rotations = np.array([look_rotation(eye) for eye in eyes]).reshape(-1, 3, 3)
    return pose_columns(np.array([eye.position for eye in eyes]), rotations)


def log_lens(writer: RecordingWriter, path: str) -> None:
    """Send what a camera sees; it is not drawn itself."""
    shape: dict[str, Any] = {"fov_y": 0.9, "aspect_ratio": 1.3, "image_plane_distance": 0.001, "line_width": 0.0}
    writer.static(path, rr.Pinhole(**shape, camera_xyz=rr.ViewCoordinates.RUB))


def read_static(recording: Path, path: str) -> dict[str, list[Any]]:
    """Name -> values of a static row of a recording; empty where it has none."""
    try:
        chunks = RrdReader(recording).stream().filter(content=f"/{path}").to_chunks()
    except (OSError, ValueError, RuntimeError) as error:
        why = f"{recording} cannot be read as a recording ({error})"
        raise RunFolderError(f"{why}; replay the session again") from error
    columns: dict[str, list[Any]] = {}
    for batch in (chunk.to_record_batch() for chunk in chunks):
        columns |= {name.rpartition(":")[2]: batch.column(name).to_pylist()[0] for name in batch.schema.names}
    return columns
