"""Poses of meshes in chosen frames of a recording, as a replay places them, without kernels."""

from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from sessions import Session
from sessions.geometry.rotations import rotated_vectors
from sessions.model.scene import Pose
from sessions.model.session import Frames, Status

USABLE_STATUSES: Final = (Status.VALID, Status.HELD, Status.INTERPOLATED)

Array = NDArray[np.float64]
Rows = NDArray[np.intp]


class SampledPoses(Protocol):
    """Poses of N bodies in k chosen frames.

    Attributes
    ----------
    names : of the bodies, one per column.
    positions : (k, N, 3).
    is_usable : (k, N), whether there is a pose.
    """

    names: tuple[str, ...]
    positions: Array
    is_usable: NDArray[np.bool_]

    def rotations(self, column: int, rows: Rows) -> Array:
        """Returns the rotations of a body in some of the chosen frames, (n, 3, 3)."""


class RecordedPoses:
    """Poses as recorded, where each mesh stands where its track says; see ``SampledPoses``."""

    def __init__(self, frames: Frames, rows: Rows) -> None:
        self.names = tuple(frames.names)
        self.positions = frames.position[rows]
        self.is_usable = np.isin(frames.status[rows], USABLE_STATUSES)
        self._quaternions = frames.quaternion_xyzw[rows]

    def rotations(self, column: int, rows: Rows) -> Array:
        """Returns the rotations of a body in some of the chosen frames, (n, 3, 3)."""
        return rotated_vectors(self._quaternions[rows, column][:, None], np.eye(3)).transpose(0, 2, 1)


class PlacedPoses:
    """Poses by the parents, offsets and fixed bodies of a scene, gaps filled; see ``SampledPoses``."""

    def __init__(self, session: Session, rows: Rows) -> None:
        from replay.prepare.assembly import PoseOrigin
        from replay.prepare.interpolation import FilledFrames, fill_frames
        from replay.prepare.kinematics import Kinematics, Placed

        fixed_names = [
            body.id for body in session.scene.bodies if body.fixed is not None and body.id not in session.names
        ]
        self.names = tuple(name for name in [*session.names, *fixed_names] if name in session.meshes)
        # Gaps are filled from all frames; only the chosen ones are placed, however long the recording is.
        columns = zip(*(vars(frames).values() for frames in fill_frames([session.frames])), strict=True)
        filled_frames = FilledFrames(*(np.concatenate(column)[rows] for column in columns))
        placed = Placed.empty(len(filled_frames), len(self.names))
        Kinematics(session.scene, session.names, self.names).place(filled_frames, placed)
        self.positions = placed.translation
        self.is_usable = placed.origin != PoseOrigin.NONE
        self._rotations = placed.rotation

    def rotations(self, column: int, rows: Rows) -> Array:
        """Returns the rotations of a body in some of the chosen frames, (n, 3, 3)."""
        return self._rotations[rows, column]


def sampled_poses(session: Session, rows: Rows) -> SampledPoses:
    """Returns the poses of all meshes in some frames. Raises ``AssemblyError``: parents that have no pose."""
    is_complete = not (session.frames.status == Status.ABSENT).any()
    if is_plain(session) and is_complete:
        return RecordedPoses(session.frames, rows)
    return PlacedPoses(session, rows)


def is_plain(session: Session) -> bool:
    """Returns whether every body stands where its track says."""
    return all(body.fixed is None and not body.parent and body.offset == Pose() for body in session.scene.bodies)
