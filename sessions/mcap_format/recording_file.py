"""The file behind a recorder: each call leaves one more whole chunk in it, and its name appears when it is finished."""

import os
from collections.abc import Mapping
from pathlib import Path

from sessions.errors import SessionFileError
from sessions.mcap_format.annotations import Message
from sessions.mcap_format.writer import SessionWriter
from sessions.mesh_data import MeshData
from sessions.model.frames import Frames
from sessions.model.scene import Scene
from sessions.whole_files import abandoned, locks, place

PARTIAL = ".partial"


class RecordingFile:
    """A session file that grows chunk by chunk under the name ``<name>.partial``; see `Recorder`."""

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
            self._writer = SessionWriter(self._stream, scene, meshes, metadata, self._names)
            self._stream.flush()
        except BaseException:
            self.abandon()
            raise

    def write(self, frames: Frames, messages: list[tuple[int, Message]]) -> None:
        """Write frames and (log_ns, message) pairs as whole chunks, and hand them to the operating system."""
        if not len(frames) and not messages:
            return
        self._writer.start(min([*frames.log_ns[:1].tolist(), *(log for log, _ in messages[:1])]))
        if frames.names != self._names and len(frames):
            self._names = frames.names
            self._writer.bodies(self._names)
        self._writer.logged(messages)
        self._writer.frames(frames)
        self._writer.close_chunk()
        self._stream.flush()

    def finish(self) -> None:
        """Write the index and give the file its name."""
        self._writer.start(0)
        self._writer.finish()
        os.fsync(self._stream.fileno())
        self._stream.close()
        place(self.partial, self.path, overwrite=self._overwrite)

    def close(self) -> None:
        """Let go of the file as it is; what is in it stays."""
        self._stream.close()

    def abandon(self) -> None:
        """Remove a file in which nothing was recorded."""
        self._stream.close()
        self.partial.unlink(missing_ok=True)
