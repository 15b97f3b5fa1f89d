"""One cheap pass over a session before any detector runs: its clock, which bodies move, which samples are no poses."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.errors import InvalidPoseError
from cdcore.numerics import BoolArray, IntArray
from replay import words
from replay.words import number as number_text
from replay.words import plural
from sessions import Frames, Session
from sessions.doctor.pose_pass import PosePass, run_pose_pass
from sessions.doctor.pose_spans import Jumps, teleports
from sessions.doctor.timing import out_of_order
from sessions.doctor.track_watch import Mark
from sessions.model.constants import BLOCK_FRAMES
from sessions.model.session import SessionSegment

NO_ROTATION_MARKS: Final = Mark.NOT_FINITE | Mark.ZERO_QUATERNION | Mark.NON_UNIT
"""Marks of a sample that claims to be a pose and is none."""


def in_order(blocks: Iterable[Frames]) -> Iterator[Frames]:
    """The frames of blocks in file order whose stamp lies after every stamp before, over all blocks."""
    latest_stamp = np.iinfo(np.int64).min
    for block in blocks:
        running_maximum = np.maximum.accumulate(np.concatenate([[latest_stamp], block.stamp_ns]))
        is_later = block.stamp_ns > running_maximum[:-1]
        yield block if is_later.all() else block.take(is_later)
        latest_stamp = running_maximum[-1]


@dataclass(frozen=True, eq=False)
class SessionScan:
    """The figures of one pass over the frames.

    Parameters
    ----------
    first_ns : second 0, the stamp of the recording's first frame.
    stamp_ns : (T,) int64 of the frames kept, strictly increasing.
    repeated, backwards : frames left out because their stamp repeats the latest one, or lies before it.
    moves : (N,) bool, whether any two usable samples of a body differ.
    has_pose : (N,) bool, whether any sample of a body is a pose.
    jumps : what the doctor calls a teleport.
    """

    first_ns: int
    stamp_ns: IntArray
    repeated: int
    backwards: int
    moves: BoolArray
    has_pose: BoolArray
    jumps: Jumps

    @property
    def duration(self) -> float:
        """Seconds from the recording's first frame to the last one kept."""
        return float(self.stamp_ns[-1] - self.first_ns) / 1e9 if len(self.stamp_ns) else 0.0

    def notes(self) -> tuple[str, ...]:
        """Sentences about what will be done to the frames and poses."""
        counts = {"repeats the one before": self.repeated, "lies before one already read": self.backwards}
        return tuple(
            f"{plural(count, 'frame')} left out: the stamp {defect_clause}"
            for defect_clause, count in counts.items()
            if count
        )


def scan_session(session: Session) -> SessionScan:
    """Pass over the frames once; memory is one block, and 16 bytes per sample.

    Raises ``InvalidPoseError`` for a sample that claims to be a pose but is not finite or has no unit quaternion; it
    names frame, time and body.
    """
    stamps = [np.zeros(0, np.int64)]

    def noted() -> Iterator[Frames]:
        for block in session.blocks(BLOCK_FRAMES):
            stamps.append(block.stamp_ns)
            yield block

    poses = run_pose_pass(in_order(noted()), session.scene.space_radius)
    is_no_rotation = poses.has(NO_ROTATION_MARKS)
    if is_no_rotation.any():
        row, body = (int(k) for k in np.argwhere(is_no_rotation)[0])
        raise InvalidPoseError(_defect_text(session, int(poses.stamp_ns[row]), body))
    backwards, repeated = out_of_order(np.concatenate(stamps))
    return scan_of(poses, session.segment, int(repeated.sum()), int(backwards.sum()))


def scan_of(poses: PosePass, window: SessionSegment | None, repeated: int = 0, backwards: int = 0) -> SessionScan:
    """The figures of a pass over frames whose stamps increase and whose samples are poses or lost."""
    stamps = poses.stamp_ns
    first_ns = int(stamps[0]) if len(stamps) else 0
    # A sample out of the room is not compared with others; what has one is not at rest.
    is_unchanged = poses.has(Mark.SAME_POSITION) & poses.has(Mark.SAME_ROTATION)
    moves = np.any((np.isfinite(poses.steps) & ~is_unchanged) | poses.has(Mark.OUT_OF_SPACE), axis=0)
    return SessionScan(
        first_ns=first_ns if window is None else window.first_ns,
        stamp_ns=stamps,
        repeated=repeated,
        backwards=backwards,
        moves=np.asarray(moves),
        has_pose=np.any(poses.has(Mark.PRESENT) & ~poses.has(Mark.LOST | Mark.NOT_FINITE), axis=0),
        jumps=teleports(poses),
    )


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
