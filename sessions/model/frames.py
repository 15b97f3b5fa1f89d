"""The poses of a session as arrays: one row per frame, one column per body, and the status of each sample."""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray


class Status(IntEnum):
    """Quality of a body's sample in a frame (stored as uint8)."""

    ABSENT = 0
    """The frame holds no sample of this body."""
    VALID = 1
    """Measured."""
    LOST = 2
    """Flagged as lost by the tracker or the source; the raw numbers are kept and never used."""
    HELD = 3
    """The source repeated an earlier pose and said so."""
    INTERPOLATED = 4
    """The source computed the pose from its neighbours and said so."""


@dataclass(frozen=True, eq=False)
class Frames:
    """T consecutive frames of N bodies, exactly as recorded.

    A frame is one ``/tf`` message with its stamp. Each body's sample in it carries its own device time.

    Parameters
    ----------
    names : N body names.
    stamp_ns : (T,) int64, the frame's time (``publish_time``).
    log_ns : (T,) int64, the recorder's clock (``log_time``).
    sample_ns : (T, N) int64, device time of each sample; 0 where absent.
    position : (T, N, 3) float64, metres; NaN where absent.
    quaternion_xyzw : (T, N, 4) float64 as recorded, not renormalised; NaN where absent.
    status : (T, N) uint8, values of ``Status``.
    """

    names: tuple[str, ...]
    stamp_ns: NDArray[np.int64]
    log_ns: NDArray[np.int64]
    sample_ns: NDArray[np.int64]
    position: NDArray[np.float64]
    quaternion_xyzw: NDArray[np.float64]
    status: NDArray[np.uint8]

    def __post_init__(self) -> None:
        for item in fields(self)[1:]:
            getattr(self, item.name).setflags(write=False)

    def __len__(self) -> int:
        return len(self.stamp_ns)

    def part(self, start: int, stop: int) -> "Frames":
        """Frames ``start <= t < stop`` as views."""
        arrays = [getattr(self, item.name)[start:stop] for item in fields(self)[1:]]
        return Frames(self.names, *arrays)

    def take(self, rows: NDArray[np.bool_] | NDArray[np.int64]) -> "Frames":
        """The frames of a mask (T,), or of these numbers, as copies."""
        arrays = [getattr(self, item.name)[rows] for item in fields(self)[1:]]
        return Frames(self.names, *arrays)

    def blocks(self, frames: int) -> "Iterator[Frames]":
        """These frames in consecutive blocks of at most this many."""
        for start in range(0, len(self), frames):
            yield self.part(start, start + frames)

    @classmethod
    def join(cls, blocks: "list[Frames]") -> "Frames":
        """Blocks after each other; all have the same bodies."""
        arrays = [np.concatenate([getattr(block, item.name) for block in blocks]) for item in fields(cls)[1:]]
        return cls(blocks[0].names, *arrays)

    @classmethod
    def empty(cls, names: tuple[str, ...]) -> "Frames":
        """No frame of these bodies."""
        none = np.zeros(0, dtype=np.int64)
        return cls(names, none, none.copy(), *absent_samples(0, len(names)))


def absent_samples(
    frames: int, bodies: int
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64], NDArray[np.uint8]]:
    """``sample_ns``, ``position``, ``quaternion_xyzw`` and ``status`` of frames in which every body is absent."""
    shape = (frames, bodies)
    position, quaternion = np.full((*shape, 3), np.nan), np.full((*shape, 4), np.nan)
    return np.zeros(shape, np.int64), position, quaternion, np.zeros(shape, np.uint8)
