"""Which miss the close-up shows: the nearest in time, so that a click in the list is followed by the picture.

The close-up's eye is data, not layout: a camera entity whose pose changes from miss to miss. The viewer tracks it, so
wherever the cursor goes, by click, key or play, the view stands before the nearest miss with nothing in between.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import rerun as rr
from rerun.chunk import RrdReader

from replay.comparison.clusters import by_depth
from replay.comparison.outcome import Miss
from replay.errors import RunFolderError
from replay.outputs.camera import Eye, Obstacles, look_rotation, standing, towards_user
from replay.outputs.rerun_log.columns import RecordingWriter, pose_columns
from replay.prepare.assembly import Assembly
from sessions.model.scene import Scene

COUNTED: Final = 500
"""Misses whose close-up is chosen by counting crossings: five milliseconds each."""


@dataclass(frozen=True)
class Focus:
    """From ``later`` nanoseconds after ``frame`` on, the close-up shows ``miss``."""

    frame: int
    later: int
    miss: Miss


def moments(misses: Sequence[Miss]) -> dict[int, tuple[int, int]]:
    """Frame, and nanoseconds after it, at which each miss, by number, has the cursor's attention.

    Its deepest frame, or the moment between frames at which it touches first. Where misses of several pairs share that,
    they follow each other by a nanosecond, the longest cut last, so that the list and ``--miss`` lead to each of them
    and scrubbing to the longest.
    """
    at: dict[int, tuple[int, int]] = {}
    free: dict[tuple[int, int], int] = {}
    for miss in sorted(misses, key=lambda one: (one.cut_length, -one.number)):
        frame, later = miss.shown
        later = free.get((frame, later), later)
        at[miss.number] = frame, later
        free[miss.shown] = later + 1
    return at


def focus(misses: Sequence[Miss]) -> list[Focus]:
    """What the close-up shows, in order of time: it changes half-way between misses, and at the deepest of each.

    So the list leads to each of several misses that overlap in time.
    """
    chosen: dict[tuple[int, int], Miss] = {}
    ordered = sorted(misses, key=lambda miss: (miss.first, miss.number))
    for before, miss in zip([None, *ordered], ordered, strict=False):
        half = 0 if before is None else max(0, (before.last + miss.first + 1) // 2)
        chosen[min(half, miss.first), 0] = miss
    at = moments(misses)
    chosen.update({at[miss.number]: miss for miss in misses})
    return [Focus(frame, after, chosen[frame, after]) for frame, after in sorted(chosen)]


def eyes_of(assembly: Assembly, scene: Scene, misses: Sequence[Miss]) -> dict[int, Eye]:
    """The close-up of each miss, by its number, at its deepest frame.

    Crossings are counted for the ``COUNTED`` longest cuts; beyond, the eye stands on the user's side.
    """
    counted = Obstacles(assembly, scene)
    unseen = Obstacles(replace(assembly, bodies=()), scene)
    eyes = {}
    for rank, miss in enumerate(by_depth(misses)):
        there, frame = standing(assembly, miss)
        user = towards_user(there, scene, frame, miss.point)
        obstacles = counted if rank < COUNTED else unseen
        eyes[miss.number] = obstacles.close_up(frame, miss.point, user, there.motion)
    return eyes


def log_eye(writer: RecordingWriter, path: str, shown: Sequence[Focus], eye_of: Mapping[int, Eye]) -> None:
    """Send the camera that the close-up tracks."""
    log_eyes(writer, path, [(one.frame, one.later) for one in shown], [eye_of[one.miss.number] for one in shown])


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


@dataclass(frozen=True)
class MissPlace:
    """Where the cursor meets a miss, in nanoseconds on the session timeline (see ``moments``).

    ``cut_length`` is in metres of intersection curve there.
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
    columns = {
        "number": np.array([miss.number for miss in misses], dtype=np.int64),
        "deepest_ns": writer.clock.ns[frames] + later,
        "cut_length": np.array([miss.cut_length for miss in misses], dtype=np.float64),
    }
    writer.static(path, rr.AnyValues(**columns))


def read_misses(recording: Path, path: str = "world/missed/table") -> list[MissPlace]:
    """Misses of the first audited detector, as the recording has them; ``RunFolderError`` where it cannot be read."""
    columns = read_static(recording, path)
    rows = zip(*(columns.get(name, []) for name in ("number", "deepest_ns", "cut_length")), strict=True)
    return [MissPlace(int(number), int(ns), float(cut)) for number, ns, cut in rows]


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
