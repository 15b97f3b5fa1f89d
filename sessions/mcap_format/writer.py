"""Writes a session to its file: the same session gives the same bytes, and a file that is there is whole."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

from sessions.errors import SceneError, SessionFileError
from sessions.glb import mesh_to_glb
from sessions.mcap_format.annotations import (
    Message,
    contact_message,
    event_message,
    hand_messages,
    interval_message,
    track_messages,
)
from sessions.mcap_format.container import ContainerWriter
from sessions.mcap_format.facts import BODIES_RECORD, SESSION_RECORD, bodies_record, session_record
from sessions.mcap_format.pose_encoding import FrameEncoder
from sessions.mcap_format.record_block import RecordBlock
from sessions.mcap_format.scene_update import scene_update
from sessions.mcap_format.schemas import PROFILE, SCENE, TF, TRACKING
from sessions.mesh_data import MeshData
from sessions.scene import Scene
from sessions.session import Session

SCENE_FILE, MESH_FOLDER, MESH_TYPE = "scene.toml", "meshes/", ".glb"
CHUNK_BYTES = 1 << 20
# A damaged chunk is lost whole, so none holds more than two seconds of poses. A minute of 10 bodies then takes 1.02
# times the bytes of chunks of 1 MiB, and is written and read in the same time.
CHUNK_NS = 2_000_000_000
FRAMES_PER_BLOCK = 2048


def write_session(session: Session, path: str | Path) -> None:
    """Write a session as an MCAP file of profile ``vrlab/1``, larger than memory if need be.

    The file is written under a temporary name beside its place and renamed when it is whole; a file of that name is
    replaced. Attachments and metadata come first, then the drawing for Foxglove, then events, hands and what else is
    sparse in chunks of their own, then the poses: a reader that wants the events does not unpack the poses.

    Raises
    ------
    SessionFileError
        The session cannot be held by a file (a negative stamp), or the place cannot be written.
    """
    with replaced(Path(path)) as stream:
        writer = ContainerWriter(stream, PROFILE, CHUNK_BYTES, CHUNK_NS)
        put_head(writer, session.scene, dict(session.meshes), dict(session.facts))
        writer.metadata(BODIES_RECORD, bodies_record(session.names))
        encoder = FrameEncoder(writer.channel(TF), writer.channel(TRACKING))
        sparse = list(_sparse(session))
        channels = {topic: writer.channel(topic) for topic in dict.fromkeys(topic for topic, _, _ in sparse)}
        started = False
        for frames in session.blocks(FRAMES_PER_BLOCK):
            if not started and len(frames):
                put_drawing(writer, session.scene, dict(session.meshes), int(frames.log_ns[0]))
                put_messages(writer, channels, sparse)
                started = True
            writer.messages(encoder.encode(frames))
        if not started:
            put_drawing(writer, session.scene, dict(session.meshes), 0)
            put_messages(writer, channels, sparse)
        writer.finish()


def _sparse(session: Session) -> Iterator[Message]:
    for event in session.events:
        yield event_message(event)
    for interval in session.intervals:
        yield interval_message(interval)
    for contact in session.live_contacts:
        yield contact_message(contact)
    for key, hand in session.hands.items():
        yield from hand_messages(key, hand)
    for name, track in session.fast_tracks.items():
        yield from track_messages(name, track)


def put_head(writer: ContainerWriter, scene: Scene, meshes: dict[str, MeshData], facts: dict[str, str]) -> None:
    """Attachments, and the facts with the hash of each mesh."""
    files = {name: mesh_to_glb(mesh, name) for name, mesh in meshes.items()}
    for name, data in files.items():
        writer.attachment(f"{MESH_FOLDER}{name}{MESH_TYPE}", "model/gltf-binary", data)
    if scene != Scene():
        writer.attachment(SCENE_FILE, "application/toml", scene_text(scene).encode())
    hashes = {name: hashlib.sha256(data).hexdigest() for name, data in files.items()}
    writer.metadata(SESSION_RECORD, session_record(facts, hashes))


def scene_text(scene: Scene) -> str:
    """The TOML that a file carries: what the author wrote where that still says the same, else made from the scene.

    Raises
    ------
    SessionFileError
        No text says what the scene does.
    """
    from sessions.scene_toml import parse_scene, scene_to_toml

    for text in (scene.text, scene_to_toml(scene)):
        try:
            if replace(parse_scene(text), text="") == replace(scene, text=""):
                return text
        except SceneError:
            continue
    raise SessionFileError("the scene cannot be said in TOML, so no file can carry it; read it with read_scene")


def put_drawing(writer: ContainerWriter, scene: Scene, meshes: dict[str, MeshData], time_ns: int) -> None:
    """The drawing for Foxglove in a chunk of its own; nothing when there is no mesh."""
    if meshes:
        payload = scene_update(meshes, scene, time_ns)
        writer.messages(RecordBlock.of([(writer.channel(SCENE), 0, time_ns, time_ns, payload)]))
        writer.close_chunk()


def put_messages(writer: ContainerWriter, channels: dict[str, int], messages: list[Message]) -> None:
    """Sparse messages in chunks of their own."""
    writer.messages(RecordBlock.of((channels[topic], 0, time, time, payload) for topic, time, payload in messages))
    writer.close_chunk()


@contextmanager
def replaced(path: Path) -> Iterator[BinaryIO]:
    """A stream whose content stands at ``path`` when the block ends well, and nowhere when it does not."""
    temporary = path.with_name(f"{path.name}.writing")
    try:
        with temporary.open("wb") as stream:
            yield stream
        temporary.replace(path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise SessionFileError(
            f"session file {path} cannot be written ({error.strerror or error}); check the folder, the space left and "
            "who may write there"
        ) from None
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
