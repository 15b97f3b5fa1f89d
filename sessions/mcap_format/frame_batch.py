"""Frames that were recorded and not yet written: arrays with room for a fixed number, filled row by row."""

from collections.abc import Mapping, Sequence
from operator import index
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sessions.errors import SessionError
from sessions.model.frames import Frames, Status

Poses = Mapping[str, tuple[Sequence[float] | NDArray[Any], Sequence[float] | NDArray[Any]]]


class FrameBatch:
    """Room for ``room`` frames of the bodies ``names``, one per column."""

    def __init__(self, names: tuple[str, ...], room: int) -> None:
        self.names, self.room, self.count = names, room, 0
        self._column = {name: column for column, name in enumerate(names)}
        self._columns: dict[tuple[str, ...], NDArray[np.intp]] = {}
        shape = (room, len(names))
        self._stamp, self._log = (np.zeros(room, dtype=np.int64) for _ in range(2))
        self._sample = np.zeros(shape, dtype=np.int64)
        self._values = np.full((*shape, 7), np.nan)
        self._status = np.zeros(shape, dtype=np.uint8)

    @property
    def full(self) -> bool:
        """Whether no frame fits any more."""
        return self.count == self.room

    def knows(self, names: tuple[str, ...]) -> bool:
        """Whether every body has a column."""
        if names not in self._columns:
            if not all(name in self._column for name in names):
                return False
            self._columns[names] = np.array([self._column[name] for name in names], dtype=np.intp)
        return True

    def add(
        self,
        names: tuple[str, ...],
        values: NDArray[np.float64],
        stamp_ns: int,
        log_ns: int,
        status: Mapping[str, Status] | None = None,
        sample_ns: Mapping[str, int] | None = None,
    ) -> None:
        """Append one frame; values are (bodies, 7), and some bodies have a status or a device stamp of their own."""
        row, columns = self.count, self._columns[names]
        self._values[row, columns] = values
        self._status[row, columns] = Status.VALID
        self._sample[row, columns] = stamp_ns
        self._stamp[row], self._log[row] = stamp_ns, log_ns
        for name, worth in (status or {}).items():
            self._status[row, self._column[name]] = worth
        for name, time_ns in (sample_ns or {}).items():
            self._sample[row, self._column[name]] = time_ns
        self.count += 1

    def frames(self) -> Frames:
        """What was added."""
        n = self.count
        return Frames(
            self.names, self._stamp[:n], self._log[:n], self._sample[:n], self._values[:n, :, :3],
            self._values[:n, :, 3:], self._status[:n],
        )  # fmt: skip


def pose_values(poses: Poses) -> NDArray[np.float64]:
    """Seven numbers per body, (bodies, 7); a `SessionError` names the body whose pose is not seven numbers."""
    flat: list[float] = []
    try:
        for position, quaternion in poses.values():
            if len(position) != 3 or len(quaternion) != 4:
                raise ValueError
            flat.extend(position)
            flat.extend(quaternion)
        return np.array(flat, dtype=np.float64).reshape(len(poses), 7)
    except (TypeError, ValueError):
        name = next((name for name, pose in poses.items() if not _is_pose(pose)), "")
        raise SessionError(
            f"the pose of {name!r} is {poses.get(name)!r}; give a position (x, y, z) and a quaternion (x, y, z, w)"
        ) from None


def _is_pose(pose: Any) -> bool:
    try:
        return [np.array(part, dtype=np.float64).shape for part in pose] == [(3,), (4,)]
    except (TypeError, ValueError):
        return False


def nanoseconds(value: int) -> int:
    """A stamp as a plain integer; a `SessionError` when it is no integer, negative, or beyond int64."""
    try:
        found = index(value)
    except TypeError:
        found = -1
    if not 0 <= found < 1 << 63:
        raise SessionError(f"stamp {value!r} is no time; give integer nanoseconds from 0, such as time.time_ns()")
    return found
