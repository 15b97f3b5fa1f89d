"""Writes a session to its file: the same session gives the same bytes, and no file is left half written."""

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

from sessions.errors import SceneError, SessionFileError
from sessions.mcap import annotations as messages
from sessions.mcap.annotations import Message
from sessions.mcap.container import add, finish, started_writer
from sessions.mcap.frame_codec import FrameEncoder, check_stamp
from sessions.mcap.metadata import (
    BODIES_RECORD,
    SESSION_RECORD,
    bodies_record,
    collider_file,
    mesh_file,
    session_record,
)
from sessions.mcap.scene_update import scene_update
from sessions.mcap.schemas import PROFILE, SCENE, STREAMS, TF, TRACKING, channel_spec
from sessions.mesh_data import MeshData
from sessions.meshes.glb import mesh_to_glb
from sessions.model.scene import Scene
from sessions.model.session import Frames, Session
from sessions.whole_files import whole_file

SCENE_FILE = "scene.toml"
FRAMES_PER_BLOCK = 2048


def write_session(session: Session, path: str | Path, *, overwrite: bool = True) -> None:
    """Write a session as an MCAP file of profile ``vrlab/1``, larger than memory if need be.

    The file is written under a temporary name in the same folder and renamed when it is whole; a file of that name is
    replaced unless ``overwrite`` is false. First come attachments and metadata, then the drawing for Foxglove, then
    events, hands and other sparse messages, then the poses. So a reader that wants the events hardly unpacks poses.

    Raises ``SessionFileError``: the session cannot be held by a file (a negative stamp), or the place cannot be
    written.
    """
    with whole_file(Path(path), SessionFileError, overwrite=overwrite) as stream:
        writer = SessionWriter(stream, session.scene, session.meshes, session.facts, session.names)
        for name, solids in session.colliders.items():
            for number, mesh in enumerate(solids):
                writer.attachment(collider_file(name, number), "model/gltf-binary", mesh_to_glb(mesh, name))
        sparse = [(message[1], message) for message in _sparse(session)]
        for topic in dict.fromkeys(topic for _, (topic, _, _) in sparse):
            writer.channel(topic)
        for frames in session.blocks(FRAMES_PER_BLOCK):
            if len(frames):
                writer.start(int(frames.log_ns[0]), sparse)
            writer.frames(frames)
        writer.start(0, sparse)
        writer.finish()


def _sparse(session: Session) -> Iterator[Message]:
    yield from map(messages.event_message, session.events)
    yield from map(messages.interval_message, session.intervals)
    yield from map(messages.contact_message, session.live_contacts)
    for prefix, name in STREAMS.items():
        for key, stream in getattr(session, name).items():
            yield from messages.stream_messages(prefix, key, stream)


class SessionWriter:
    """A session file being written: head first, then ``start``, then messages and frames.

    ``chunked``: in compressed chunks with an index; else as they come, so that what is written can be read at once.
    """

    def __init__(
        self,
        stream: BinaryIO,
        scene: Scene,
        meshes: Mapping[str, MeshData],
        metadata: Mapping[str, str],
        names: tuple[str, ...],
        *,
        chunked: bool = True,
    ) -> None:
        self._writer = started_writer(stream, PROFILE, chunked=chunked)
        self._channels: dict[str, int] = {}
        self._scene, self._meshes, self._started = scene, dict(meshes), False
        files = {name: mesh_to_glb(mesh, name) for name, mesh in self._meshes.items()}
        for name, data in files.items():
            self.attachment(mesh_file(name), "model/gltf-binary", data)
        if scene != Scene():
            self.attachment(SCENE_FILE, "application/toml", scene_text(scene).encode())
        hashes = {name: hashlib.sha256(data).hexdigest() for name, data in files.items()}
        self._writer.add_metadata(SESSION_RECORD, session_record(metadata, hashes))
        self.bodies(names)
        self._encoder = FrameEncoder(self.channel(TF), self.channel(TRACKING))

    def bodies(self, names: tuple[str, ...]) -> None:
        """List the tracked bodies; the last list counts."""
        self._writer.add_metadata(BODIES_RECORD, bodies_record(names))

    def attachment(self, name: str, media_type: str, data: bytes) -> None:
        """Write an attachment."""
        self._writer.add_attachment(0, 0, name, media_type, data)

    def channel(self, topic: str) -> int:
        """The id of a topic of the profile; its schema and channel records are written the first time."""
        if topic not in self._channels:
            spec = channel_spec(topic)
            schema = self._writer.register_schema(spec.schema, "protobuf", spec.descriptor_set)
            self._channels[topic] = self._writer.register_channel(topic, "protobuf", schema)
        return self._channels[topic]

    def start(self, time_ns: int, messages: Iterable[tuple[int, Message]] = ()) -> None:
        """The drawing for Foxglove, then the messages; a second call does nothing."""
        if self._started:
            return
        self._started = True
        check_stamp("a frame is", time_ns)
        if self._meshes:
            self.logged([(time_ns, (SCENE, time_ns, scene_update(self._meshes, self._scene, time_ns)))])
        self.logged(messages)

    def logged(self, messages: Iterable[tuple[int, Message]]) -> None:
        """Messages with their log times."""
        for log_ns, (topic, time_ns, data) in messages:
            add(self._writer, (self.channel(topic), 0, log_ns, time_ns, data))

    def frames(self, frames: Frames) -> None:
        """The next frames."""
        for record in self._encoder.encode(frames):
            add(self._writer, record)

    def finish(self) -> None:
        """Write the index and the footer."""
        finish(self._writer)


def scene_text(scene: Scene) -> str:
    """The TOML that a file carries: the author's text where it still describes the scene, else made from the scene."""
    from sessions.scene_files.scene_toml import parse_scene, scene_to_toml

    for text in (scene.text, scene_to_toml(scene)):
        try:
            if replace(parse_scene(text), text="") == replace(scene, text=""):
                return text
        except SceneError:
            continue
    raise SessionFileError("the scene cannot be said in TOML, so no file can carry it; read it with read_scene")
