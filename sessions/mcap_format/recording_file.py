"""The file behind a recorder: what each call writes can be read at once; its name appears when it is finished."""

import os
from collections.abc import Mapping, Sequence
from itertools import groupby
from operator import index
from pathlib import Path
from typing import Any

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

    def write(self, frames: Sequence[Frames], messages: Sequence[tuple[int, Message]]) -> None:
        """Write frames, which may be of different bodies, and (log_ns, message) pairs."""
        if not frames and not messages:
            return
        self._writer.start(min([*(int(part.log_ns[0]) for part in frames[:1]), *(log for log, _ in messages[:1])]))
        names = tuple(dict.fromkeys([*self._names, *(name for part in frames for name in part.names)]))
        if names != self._names:
            self._names = names
            self._writer.bodies(names)
        self._writer.logged(messages)
        for part in frames:
            self._writer.frames(part)
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


def frame_of(
    poses: Poses, stamp_ns: int, log_ns: int, status: Mapping[str, Status], samples: Mapping[str, int]
) -> Frames:
    """One frame; bodies without a status are valid, those without a device stamp have the frame's."""
    values = pose_values(poses)
    worth = [status.get(name, Status.VALID) for name in poses]
    times = [samples.get(name, stamp_ns) for name in poses]
    return Frames(
        tuple(poses),
        np.array([stamp_ns], dtype=np.int64),
        np.array([log_ns], dtype=np.int64),
        np.array([times], dtype=np.int64),
        values[None, :, :3],
        values[None, :, 3:],
        np.array([worth], dtype=np.uint8),
    )


def joined(frames: Sequence[Frames]) -> list[Frames]:
    """The same frames, those of the same bodies that follow each other in one."""
    return [Frames.join([*alike]) for _, alike in groupby(frames, key=lambda one: one.names)]


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
