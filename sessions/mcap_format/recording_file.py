"""The file behind a recorder: what each call writes can be read at once; its name appears when it is finished."""

import os
from collections.abc import Mapping, Sequence
from itertools import groupby
from operator import index
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sessions.errors import SessionError, SessionFileError
from sessions.mcap_format.annotations import Message
from sessions.mcap_format.container import rewrite
from sessions.mcap_format.writer import SessionWriter
from sessions.mesh_data import MeshData
from sessions.model.frames import Frames, Status
from sessions.model.scene import Scene
from sessions.whole_files import abandoned, locks, whole_file

PARTIAL = ".partial"

Poses = Mapping[str, tuple[Sequence[float] | NDArray[Any], Sequence[float] | NDArray[Any]]]


class RecordingFile:
    """A session file that grows message by message under the name ``<name>.partial``; see `Recorder`."""

    def __init__(
        self, path: Path, scene: Scene, meshes: Mapping[str, MeshData], metadata: Mapping[str, str], *, overwrite: bool
    ) -> None:
        self.path, self.partial = path, path.with_name(path.name + PARTIAL)
        self._names: tuple[str, ...] = ()
        self._overwrite = overwrite
        if path.exists() and not overwrite:
            raise SessionFileError(f"{path} is there already; give another name, or overwrite=True to replace it")
        try:
            if overwrite and abandoned(self.partial):
                self.partial.unlink()
            self._stream = self.partial.open("xb")
            locks(self._stream)
        except FileExistsError:
            raise SessionFileError(
                f"{self.partial} holds a recording that goes on or was cut short; save it with `replay recover`, or, "
                "once nobody writes it, give overwrite=True to replace it"
            ) from None
        except OSError as error:
            raise SessionFileError(
                f"{path} cannot be recorded ({error.strerror or error}); check the folder and who may write there"
            ) from None
        try:
            self._writer = SessionWriter(self._stream, scene, meshes, metadata, self._names, chunked=False)
            self._stream.flush()
        except BaseException:
            self._stream.close()
            self.partial.unlink(missing_ok=True)
            raise

    def write(self, frames: Frames, messages: list[tuple[int, Message]]) -> None:
        """Write frames and (log_ns, message) pairs, and hand them to the operating system."""
        if not len(frames) and not messages:
            return
        self._writer.start(min([*frames.log_ns[:1].tolist(), *(log for log, _ in messages[:1])]))
        if frames.names != self._names and len(frames):
            self._names = frames.names
            self._writer.bodies(self._names)
        self._writer.logged(messages)
        self._writer.frames(frames)
        self._stream.flush()

    def finish(self) -> None:
        """Write the whole again in compressed chunks with an index, under its name."""
        self._writer.start(0)
        self._writer.finish()
        self._stream.flush()
        with (
            whole_file(self.path, OSError, overwrite=self._overwrite) as target,
            self.partial.open("rb") as source,
        ):
            rewrite(source, target)
            target.flush()
            os.fsync(target.fileno())
        self._stream.close()
        self.partial.unlink()

    def close(self) -> None:
        """Let go of the file as it is; what is in it stays."""
        self._stream.close()


class RecordedFrame(NamedTuple):
    """A frame of some bodies: their seven numbers (bodies, 7), and what some have for a status or a device stamp."""

    names: tuple[str, ...]
    values: NDArray[np.float64]
    stamp_ns: int
    log_ns: int
    status: Mapping[str, Status]
    sample_ns: Mapping[str, int]


def frames_of(names: tuple[str, ...], recorded: Sequence[RecordedFrame]) -> Frames:
    """The frames as arrays; ``names`` are all bodies, one per column."""
    place = {name: column for column, name in enumerate(names)}
    shape = (len(recorded), len(names))
    sample, status = np.zeros(shape, dtype=np.int64), np.zeros(shape, dtype=np.uint8)
    values = np.full((*shape, 7), np.nan)
    stamp = np.array([one.stamp_ns for one in recorded], dtype=np.int64)
    first = 0
    for bodies, group in groupby(recorded, key=lambda one: one.names):
        alike = [*group]
        rows, columns = slice(first, first + len(alike)), [place[name] for name in bodies]
        values[rows, columns] = [one.values for one in alike]
        status[rows, columns] = Status.VALID
        sample[rows, columns] = stamp[rows, None]
        first += len(alike)
    for row, one in enumerate(recorded):
        for name, worth in one.status.items():
            status[row, place[name]] = worth
        for name, time_ns in one.sample_ns.items():
            sample[row, place[name]] = time_ns
    log = np.array([one.log_ns for one in recorded], dtype=np.int64)
    return Frames(names, stamp, log, sample, values[..., :3], values[..., 3:], status)


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
        found = index(value)
    except TypeError:
        found = -1
    if not 0 <= found < 1 << 63:
        raise SessionError(f"stamp {value!r} is no time; give integer nanoseconds from 0, such as time.time_ns()")
    return found
