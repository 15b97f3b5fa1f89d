"""The file behind a recorder: each call leaves one more whole chunk in it, and its name appears when it is finished."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from sessions.errors import SessionFileError
from sessions.frames import Frames
from sessions.mcap_format.annotations import Message
from sessions.mcap_format.container import ContainerWriter
from sessions.mcap_format.facts import BODIES_RECORD, bodies_record
from sessions.mcap_format.pose_encoding import FrameEncoder
from sessions.mcap_format.record_block import RecordBlock
from sessions.mcap_format.schemas import PROFILE, TF, TRACKING
from sessions.mcap_format.writer import CHUNK_BYTES, put_drawing, put_head
from sessions.mesh_data import MeshData
from sessions.scene import Scene

PARTIAL = ".partial"


class RecordingFile:
    """A session file that grows chunk by chunk under the name ``<name>.partial``.

    Parameters
    ----------
    path : its name when it is finished.
    overwrite : replace a file of that name, or a partial one.

    Raises
    ------
    SessionFileError
        There is such a file already, or the place cannot be written.
    """

    def __init__(
        self, path: Path, scene: Scene, meshes: Mapping[str, MeshData], facts: dict[str, str], *, overwrite: bool
    ) -> None:
        self.path, self.partial = path, path.with_name(path.name + PARTIAL)
        self._scene, self._meshes = scene, dict(meshes)
        self._names: tuple[str, ...] = ()
        self._started = False
        if path.exists() and not overwrite:
            raise SessionFileError(f"{path} is there already; give another name, or overwrite=True to replace it")
        try:
            self._stream = self.partial.open("wb" if overwrite else "xb")
        except FileExistsError:
            raise SessionFileError(
                f"{self.partial} holds a recording that was cut short; save it with `replay recover`, or give "
                "overwrite=True to replace it"
            ) from None
        except OSError as error:
            raise SessionFileError(
                f"{path} cannot be recorded ({error.strerror or error}); check the folder and who may write there"
            ) from None
        try:
            self._begin(facts)
        except BaseException:
            self.abandon()
            raise

    def _begin(self, facts: dict[str, str]) -> None:
        self._writer = ContainerWriter(self._stream, PROFILE, CHUNK_BYTES)
        put_head(self._writer, self._scene, self._meshes, facts)
        self._writer.metadata(BODIES_RECORD, bodies_record(()))
        self._encoder = FrameEncoder(self._writer.channel(TF), self._writer.channel(TRACKING))
        self._stream.flush()

    def write(self, frames: Frames, messages: list[tuple[int, Message]]) -> None:
        """Write frames and (log_ns, message) pairs as one chunk or more, whole and out of this process's hands."""
        if not len(frames) and not messages:
            return
        if not self._started:
            first = [int(log) for log in frames.log_ns[:1]] + [log for log, _ in messages[:1]]
            put_drawing(self._writer, self._scene, self._meshes, min(first))
            self._started = True
        if frames.names != self._names and len(frames):
            self._names = frames.names
            self._writer.metadata(BODIES_RECORD, bodies_record(self._names))
        records = [
            (self._writer.channel(topic), 0, log_ns, time_ns, payload) for log_ns, (topic, time_ns, payload) in messages
        ]
        self._writer.messages(RecordBlock.of(records))
        self._writer.messages(self._encoder.encode(frames))
        self._writer.close_chunk()
        self._stream.flush()

    def finish(self) -> None:
        """Write the index and give the file its name."""
        if not self._started:
            put_drawing(self._writer, self._scene, self._meshes, 0)
        self._writer.finish()
        os.fsync(self._stream.fileno())
        self._stream.close()
        self.partial.replace(self.path)

    def close(self) -> None:
        """Let go of the file as it is; what is in it stays."""
        self._stream.close()

    def abandon(self) -> None:
        """Remove a file in which nothing was recorded."""
        self._stream.close()
        self.partial.unlink(missing_ok=True)
