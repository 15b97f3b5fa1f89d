"""One cheap pass over a session before any detector runs: its clock, and which bodies move. Refuses corrupt poses."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from cdcore.numerics import BoolArray, IntArray
from replay.prepare.corrupt_poses import refuse_corrupt_poses
from replay.words import plural
from sessions import Frames, Session
from sessions.doctor.pose_pass import PosePass, run_pose_pass
from sessions.doctor.pose_spans import Jumps, teleports
from sessions.doctor.timing import out_of_order
from sessions.doctor.track_watch import Mark
from sessions.model.constants import BLOCK_FRAMES
from sessions.model.session import SessionSegment


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

    Raises ``InvalidPoseError``: see `refuse_corrupt_poses`.
    """
    stamps = [np.zeros(0, np.int64)]

    def noted() -> Iterator[Frames]:
        for block in session.blocks(BLOCK_FRAMES):
            stamps.append(block.stamp_ns)
            yield block

    poses = run_pose_pass(in_order(noted()), session.scene.space_radius)
    refuse_corrupt_poses(session, poses)
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
