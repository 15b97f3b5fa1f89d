"""Frames as a program gives them to a recorder: checked one by one, written many at once."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from operator import index, itemgetter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sessions.errors import SessionError
from sessions.model.session import Frames, Status

Poses = Mapping[str, tuple[Sequence[float] | NDArray[Any], Sequence[float] | NDArray[Any]]]


class RecordedFrame(NamedTuple):
    """One frame: a number, or a row of seven, for each of its bodies."""

    names: tuple[str, ...]
    stamp_ns: int
    log_ns: int
    sample_ns: list[int]
    status: list[Status]
    poses: NDArray[np.float64]


def frames_of(recorded: Sequence[RecordedFrame]) -> Iterator[Frames]:
    """The same frames as arrays, those of the same bodies that follow each other in one."""
    for names, alike in groupby(recorded, key=itemgetter(0)):
        _, *integers, status, poses = zip(*alike, strict=True)
        stamp, log, sample = (np.array(column, dtype=np.int64) for column in integers)
        pose = np.stack(poses)
        yield Frames(names, stamp, log, sample, pose[..., :3], pose[..., 3:], np.array(status, dtype=np.uint8))


def pose_values(poses: Poses) -> NDArray[np.float64]:
    """Seven numbers per body, (bodies, 7); a `SessionError` names the body whose pose is not seven numbers."""
    numbers: list[float] = []
    for name, pose in poses.items():
        try:
            position, quaternion = pose
            if len(position) != 3 or len(quaternion) != 4:
                raise ValueError
            numbers += [*map(float, position), *map(float, quaternion)]
        except (TypeError, ValueError):
            raise SessionError(
                f"the pose of {name!r} is {pose!r}; give a position (x, y, z) and a quaternion (x, y, z, w)"
            ) from None
    return np.array(numbers, dtype=np.float64).reshape(len(poses), 7)


def nanoseconds(value: int) -> int:
    """A stamp as a plain integer; a `SessionError` when it is no integer, negative, or beyond int64."""
    try:
        position = index(value)
    except TypeError:
        position = -1
    if not 0 <= position < 1 << 63:
        raise SessionError(f"stamp {value!r} is no time; give integer nanoseconds from 0, such as time.time_ns()")
    return position
