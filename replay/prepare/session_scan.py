"""One cheap pass over a session before any detector runs: its clock, which bodies move, which samples are no poses."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdcore.errors import InvalidPoseError
from cdcore.numerics import QUATERNION_REJECT, BoolArray, FloatArray, IntArray
from replay.base.constants import BLOCK_FRAMES
from replay.prepare.interpolation import is_usable
from sessions import Frames, Session
from sessions.model.session import SessionPart


@dataclass(frozen=True, eq=False)
class OrderedFrames:
    """The frames of one block that are used.

    Parameters
    ----------
    frames : frames whose stamp lies after every stamp before, over all blocks.
    numbers : their numbers in the file, from 0.
    repeated, backwards : how many were left out because their stamp equals the latest one, or lies before it.
    """

    frames: Frames
    numbers: NDArray[np.int64]
    repeated: int
    backwards: int


def in_order(blocks: Iterable[Frames]) -> Iterator[OrderedFrames]:
    """Go through blocks in file order and keep the frames whose stamp increases."""
    latest, first = np.iinfo(np.int64).min, 0
    for block in blocks:
        peak = np.maximum.accumulate(np.concatenate([[latest], block.stamp_ns]))
        keep = block.stamp_ns > peak[:-1]
        same = int((block.stamp_ns == peak[:-1]).sum())
        frames = block if keep.all() else block.take(keep)
        yield OrderedFrames(frames, np.flatnonzero(keep) + first, same, len(block) - len(frames) - same)
        latest, first = int(peak[-1]), first + len(block)


NORM_NOTE: Final = 1e-6
"""A quaternion whose norm is further off 1 is worth a note; float32 reaches 1e-7."""


@dataclass(frozen=True, eq=False)
class SessionScan:
    """The figures of one pass over the frames.

    Parameters
    ----------
    names : N tracked bodies.
    first_ns : second 0, the stamp of the recording's first frame.
    stamp_ns : (T,) int64 of the frames kept, strictly increasing.
    repeated, backwards : frames left out because their stamp repeats the latest one, or lies before it.
    moves : (N,) bool, whether any two usable samples of a body differ.
    median_step_ns : median step between frames kept; 0 with fewer than two.
    off_norm : usable samples whose quaternion's norm is further than 1e-6 off 1; ``worst_norm`` is the furthest.
    """

    names: tuple[str, ...]
    first_ns: int
    stamp_ns: IntArray
    repeated: int
    backwards: int
    moves: BoolArray
    median_step_ns: int
    off_norm: int
    worst_norm: float

    @property
    def duration(self) -> float:
        """Seconds from the recording's first frame to the last one kept."""
        return float(self.stamp_ns[-1] - self.first_ns) / 1e9 if len(self.stamp_ns) else 0.0

    def notes(self) -> tuple[str, ...]:
        """Sentences about what will be done to the frames and poses."""
        notes = []
        if self.repeated:
            notes.append(f"{_frames(self.repeated)} left out: the stamp repeats the one before")
        if self.backwards:
            notes.append(f"{_frames(self.backwards)} left out: the stamp lies before one already read")
        if self.off_norm:
            notes.append(f"{self.off_norm} quaternions renormalised; the furthest had norm {self.worst_norm:.6f}")
        return tuple(notes)


def scan(session: Session) -> SessionScan:
    """Pass over the frames once; memory is one block, and one stamp per frame.

    Raises ``InvalidPoseError`` for a sample that claims to be a pose but is not finite or has no unit quaternion; it
    names frame, time and body.
    """
    stamps, repeated, backwards, off_norm, worst_norm = [np.zeros(0, dtype=np.int64)], 0, 0, 0, 1.0
    first, moves = np.full((len(session.names), 7), np.nan), np.zeros(len(session.names), dtype=np.bool_)
    zero = None if session.part is None else session.part.first_ns
    for block in in_order(session.blocks(BLOCK_FRAMES)):
        repeated, backwards, frames = repeated + block.repeated, backwards + block.backwards, block.frames
        if not len(frames):
            continue
        stamps.append(frames.stamp_ns)
        usable = is_usable(frames.status)
        zero = int(frames.stamp_ns[0]) if zero is None else zero
        norm = _norms_of_poses(block, usable, zero, session.part)
        off_norm += int((np.abs(norm - 1.0) > NORM_NOTE).sum())
        further = norm[np.abs(norm - 1.0) > abs(worst_norm - 1.0)]
        if len(further):
            worst_norm = float(further[np.abs(further - 1.0).argmax()])
        pose = np.concatenate([frames.position, frames.quaternion_xyzw], axis=-1)
        columns = np.flatnonzero(np.isnan(first[:, 0]) & usable.any(axis=0))
        first[columns] = pose[usable.argmax(axis=0)[columns], columns]
        moves |= ((pose != first).any(axis=-1) & usable).any(axis=0)
    kept = np.concatenate(stamps)
    step = int(np.median(np.diff(kept))) if len(kept) > 1 else 0
    return SessionScan(session.names, zero or 0, kept, repeated, backwards, moves, step, off_norm, worst_norm)


def _norms_of_poses(block: OrderedFrames, usable: BoolArray, zero: int, part: SessionPart | None) -> FloatArray:
    """Norms of the quaternions (T, N), 1 where a sample is not used; ``zero`` is the stamp of second 0."""
    frames = block.frames
    with np.errstate(over="ignore", invalid="ignore"):
        norm = np.sqrt((frames.quaternion_xyzw * frames.quaternion_xyzw).sum(axis=-1))
    finite = np.isfinite(frames.position).all(axis=-1)
    bad = usable & ~(finite & (np.abs(norm - 1.0) <= QUATERNION_REJECT))
    if bad.any():
        frame, body = (int(k) for k in np.argwhere(bad)[0])
        what = f"position {frames.position[frame, body].tolist()} is not finite"
        if np.isfinite(frames.position[frame, body]).all():
            quaternion = frames.quaternion_xyzw[frame, body].tolist()
            what = f"quaternion {quaternion} has norm {float(norm[frame, body]):.6g}, not 1"
        time = float(frames.stamp_ns[frame] - zero) / 1e9
        number = int(block.numbers[frame])
        number = number if part is None else int(part.numbers[number])
        where = f"frame {number} ({time:.6f} s), body {frames.names[body]}: "
        raise InvalidPoseError(f"{where}{what}; flag the sample as lost, repair it, or choose a --policy")
    return np.where(usable, norm, 1.0)


def _frames(count: int) -> str:
    return f"{count} frame" if count == 1 else f"{count} frames"
