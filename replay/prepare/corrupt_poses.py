"""Refuses a recorded sample that claims to be a pose and is none: not finite, or without a unit quaternion.

Arrays of poses are refused by ``cdcore.poses.corrupt_poses``, which knows no session.
"""

from typing import Final

import numpy as np

from cdcore.errors import InvalidPoseError
from replay import words
from replay.words import number as number_text
from sessions import Session
from sessions.doctor.pose_pass import PosePass
from sessions.doctor.track_watch import Mark
from sessions.model.constants import BLOCK_FRAMES

CORRUPT_POSE_MARKS: Final = Mark.NOT_FINITE | Mark.ZERO_QUATERNION | Mark.NON_UNIT
"""Marks of a sample that claims to be a pose and is none."""


def refuse_corrupt_poses(session: Session, poses: PosePass) -> None:
    """Raise ``InvalidPoseError`` for the first corrupt pose of a session: it names frame, time and body.

    ``poses``: the pass over its frames.
    """
    is_corrupt = poses.has(CORRUPT_POSE_MARKS)
    if is_corrupt.any():
        row, body = (int(k) for k in np.argwhere(is_corrupt)[0])
        raise InvalidPoseError(_defect_text(session, int(poses.stamp_ns[row]), body))


def _defect_text(session: Session, stamp_ns: int, body: int) -> str:
    """Text on the defect of a body's sample in the first frame of this stamp."""
    stamps = session.stamps()
    frame_number = int(np.flatnonzero(stamps == stamp_ns)[0])
    first_ns = int(stamps[0]) if session.segment is None else session.segment.first_ns
    block = next(block for block in session.blocks(BLOCK_FRAMES) if stamp_ns in block.stamp_ns)
    row = int(np.flatnonzero(block.stamp_ns == stamp_ns)[0])
    time = (stamp_ns - first_ns) / 1e9
    position, quaternion = block.position[row, body], block.quaternion_xyzw[row, body]
    defect_text = f"position {position.tolist()} is not finite"
    if np.isfinite(position).all():
        with np.errstate(over="ignore", invalid="ignore"):
            norm = float(np.sqrt((quaternion * quaternion).sum()))
        norm_text = number_text(norm, 6) if np.isfinite(norm) else f"{norm}"
        defect_text = f"quaternion {quaternion.tolist()} has norm {norm_text}, not 1"
    frame_number = frame_number if session.segment is None else int(session.segment.numbers[frame_number])
    location_text = f"frame {frame_number} ({words.decimal(time, 6)} s), body {block.names[body]}: "
    return f"{location_text}{defect_text}; flag the sample as lost, repair it, or choose a --policy"
