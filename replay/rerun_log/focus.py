"""Which miss the close-up shows: the nearest in time, so that a click in the list is followed by the picture.

The close-up's eye is data, not layout: a camera entity whose pose changes from miss to miss. The viewer tracks it, so
wherever the cursor goes, by click, key or play, the view stands before the nearest miss with nothing in between.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun as rr

from replay.assembly import Assembly
from replay.audit.outcome import Miss
from replay.rerun_log.camera import Eye, Obstacles, look_rotation, towards_user
from replay.rerun_log.columns import RecordingWriter
from replay.rerun_log.quaternions import quaternions_xyzw
from sessions.scene import Scene


def focus(misses: Sequence[Miss]) -> tuple[list[int], list[Miss]]:
    """Frames at which the close-up changes, and the miss it shows from each on.

    It changes half-way between two misses, and at the deepest frame of each, so that overlapping misses of several
    pairs are all met where the list leads. Of two with the same deepest frame the one with the longer cut is shown.
    """
    chosen: dict[int, Miss] = {}
    ordered = sorted(misses, key=lambda miss: (miss.first, miss.number))
    for before, miss in zip([None, *ordered], ordered, strict=False):
        half = 0 if before is None else max(0, (before.last + miss.first + 1) // 2)
        chosen[min(half, miss.first)] = miss
    for miss in sorted(ordered, key=lambda one: (one.cut_length, -one.number)):
        chosen[miss.deepest] = miss
    frames = sorted(chosen)
    return frames, [chosen[frame] for frame in frames]


def eyes_of(assembly: Assembly, scene: Scene, misses: Sequence[Miss]) -> dict[int, Eye]:
    """The close-up of each miss, by its number, at its deepest frame."""
    obstacles = Obstacles(assembly, scene)
    return {
        miss.number: obstacles.close_up(
            miss.deepest, miss.point, towards_user(assembly, scene, miss.deepest, miss.point)
        )
        for miss in misses
    }


def log_eye(writer: RecordingWriter, path: str, frames: Sequence[int], eyes: Sequence[Eye]) -> None:
    """Send the camera that the close-up tracks."""
    rotations = np.array([look_rotation(eye) for eye in eyes]).reshape(-1, 3, 3)
    columns = rr.Transform3D.columns(
        translation=np.array([eye.position for eye in eyes], dtype=np.float32),
        quaternion=quaternions_xyzw(rotations).astype(np.float32),
    )
    writer.rows(path, frames, columns)
    lens = rr.Pinhole(
        fov_y=0.9, aspect_ratio=1.3, camera_xyz=rr.ViewCoordinates.RUB, image_plane_distance=0.001, line_width=0.0
    )
    writer.static(path, lens)
