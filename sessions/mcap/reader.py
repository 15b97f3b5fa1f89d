"""Reads a session file: metadata, meshes and events at once, poses chunk by chunk when they are asked for.

Memory for ``Session.blocks`` is one chunk and one block, for a file of any length.
"""

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from functools import cache, partial
from os import PathLike
from pathlib import Path
from typing import Any, Generic, TypeVar

from google.protobuf.message import DecodeError
from mcap.records import Attachment

from sessions.errors import MeshFileError, SceneError, SessionError, SessionFileError, TornFileError, WrongInputError
from sessions.input_files import open_input, read_text
from sessions.mcap import annotations, metadata, schemas
from sessions.mcap.container import Region, bytes_at, parse_record, read_catalogue
from sessions.mcap.frame_codec import FrameDecoder
from sessions.mcap.refusals import refusal
from sessions.mcap.schemas import PROFILE_FAMILY, TF, TRACKING
from sessions.mcap.unpacking import MessageTable, read_region, together
from sessions.mcap.writer import SCENE_FILE
from sessions.mesh_data import MeshData
from sessions.model.constants import SCENE_FACT
from sessions.model.scene import Scene
from sessions.model.session import Frames, Session

LEAST_POSE_BYTES = 24  # Of a message: a body's name, a stamp and the heads of fields; zeros are left out


class McapFile:
    """A file whose records have been listed; it is closed between calls.

    ``refused``: what was wrong with parts of a file that is not read strictly, and the body that each was of.
    """

    def __init__(self, path: Path, *, strict: bool = True) -> None:
        self.path = path
        self.refused: list[tuple[SessionFileError, str]] = []
        with open_input(path, "session file", SessionFileError) as stream:
            self.catalogue = read_catalogue(path, stream, strict=strict)
        # The regions that speak of channels which no record outside chunks has declared are unpacked now.
        with self.path.open("rb") as stream:
            for region in self.catalogue.regions:
                known = self.catalogue.channels.keys()
                if not known or (region.channels is not None and region.channels - known):
                    with nullcontext() if strict else suppress(SessionFileError):
                        read_region(stream, region, self.catalogue)

    @property
    def own(self) -> bool:
        """Whether it is of our profile, of any version."""
        return self.catalogue.profile.startswith(PROFILE_FAMILY)

    def attempt(self, load: Callable[[], Any], otherwise: Any, body: str = "") -> Any:
        """Load a part; a strict reader refuses the file for it, any other notes why and takes ``otherwise``."""
        try:
            return load()
        except SessionFileError as error:
            if self.catalogue.strict:
                raise
            # Damaged attachments are among the faults of the catalogue already.
            if error.code != "damaged-attachment":
                self.refused.append((error, body))
            return otherwise

    def regions(self, *topics: str) -> list[Region]:
        """The regions that may hold messages of these topics, in file order."""
        ids = set[int]().union(*(self.catalogue.ids(topic) for topic in topics))
        # An index that leaves messages out would lose them: only a whole one says where nothing is.
        chunks = [
            region
            for region in self.catalogue.regions
            if region.channels is None or region.channels & ids or not self.catalogue.index_is_whole
        ]
        return chunks if ids else []

    def read(self, regions: Iterable[Region]) -> Iterator[MessageTable]:
        """The messages of each region, which is unpacked when its turn comes."""
        with self.path.open("rb") as stream:
            for region in regions:
                yield read_region(stream, region, self.catalogue)

    def tables(self, *topics: str) -> Iterator[MessageTable]:
        """The regions that may hold messages of these topics, in file order; no other is unpacked."""
        return together(self.read(self.regions(*topics)))

    def payloads(self, topic: str) -> Iterator[tuple[int, bytes]]:
        """(publish_ns, payload) of every message of a topic, in file order."""
        for table in self.tables(topic):
            for row in table.of_channels(self.catalogue.ids(topic)).tolist():
                yield int(table.publish_ns[row]), table.payload(row)

    def topics_below(self, prefix: str) -> list[str]:
        """The topics that start with a prefix, without it, each once."""
        topics = [channel.topic for channel in self.catalogue.channels.values() if channel.topic.startswith(prefix)]
        return [topic.removeprefix(prefix) for topic in dict.fromkeys(topics)]

    def last_stamp(self) -> int | None:
        """The latest frame time of the last region that holds frames."""
        for table in self.read(self.regions(TF)[::-1]):
            rows = table.of_channels(self.catalogue.ids(TF))
            if len(rows):
                return int(table.publish_ns[rows].max())
        return None

    def attachment(self, name: str) -> bytes | None:
        """The bytes of an attachment, ``None`` when there is none of that name; an error: it is damaged."""
        damaged = [fault.error for fault in self.catalogue.faults if name and fault.name == name]
        if damaged:
            raise damaged[0]
        if name not in self.catalogue.attachments:
            return None
        with self.path.open("rb") as stream:
            record = parse_record(bytes_at(stream, self.catalogue.attachments[name]))
        assert isinstance(record, Attachment)
        return bytes(record.data)


@dataclass(frozen=True, eq=False)
class McapFrames:
    """Frames of a file, one column per name; each block is decoded when it is asked for."""

    file: McapFile
    names: tuple[str, ...]

    @property
    def poses_at_most(self) -> int:
        """More frames times bodies than are in the file, told without reading any."""
        return sum(region.size for region in self.file.regions(TF, TRACKING)) // LEAST_POSE_BYTES

    def blocks(self, frames: int) -> Iterator[Frames]:
        """All frames in file order, in blocks of this many (the last may be shorter)."""
        pending: list[Frames] = []
        decoder = FrameDecoder(self.file.catalogue, self.names)
        for block in (block for table in self.file.tables(TF, TRACKING) for block in decoder.decode(table)):
            pending.append(block)
            while sum(map(len, pending)) >= frames:
                whole = Frames.join(pending) if len(pending) > 1 else pending[0]
                yield whole.segment(0, frames)
                pending = [whole.segment(frames, len(whole))] if len(whole) > frames else []
        if pending:
            yield Frames.join(pending)


Value = TypeVar("Value")


def _require_path(given: object) -> None:
    if not isinstance(given, str | PathLike):
        kind = type(given).__name__
        raise WrongInputError(f"read_session takes the path of a file, not {kind}; arrays: Session.from_arrays(...)")


def read_session(path: str | Path, *, scene: str | Path | None = None) -> Session:
    """Read a session file of profile ``vrlab/1``, or any MCAP with ``foxglove.FrameTransforms`` on ``/tf``.

    Meshes are checked against their hashes. Frames and streams are decoded when asked for.
    A file without the profile has the metadata ``format: foreign`` and ``profile: none`` (or what it calls its own).

    ``path``: the file; ``scene``: a scene file that stands in place of the session's own, which is not looked at, or
    that adds to it (`with_scene`).

    Raises ``SessionFileError``: the file is missing, empty, damaged, no MCAP, of an unknown version, or has no poses;
    ``TornFileError`` when it was cut short, for example by a crash of the recorder: `recover` saves what is there.
    """
    _require_path(path)
    file = McapFile(Path(path))
    if file.catalogue.tear is not None:
        if file.catalogue.is_import:
            what = f"it is cut short at byte {file.catalogue.tear} and no session"
            raise refusal(path, "no-poses", what)
        raise TornFileError(
            f"{path} is cut short at byte {file.catalogue.tear} and has no index; save what is there with "
            "`replay recover`"
        )
    check_version(file)
    file.catalogue.check_pose_channels()
    names = listed_names(file) if file.own else _scanned_names(file)
    if scene is None:
        return session_of(file, names)
    from sessions.scene_files.scene_meshes import with_scene
    from sessions.scene_files.scene_toml import declares_bodies

    replaces = declares_bodies(read_text(scene, "scene", SceneError), Path(scene).name)
    session = session_of(file, names, Scene() if replaces else None)

    return with_scene(session, scene)


def session_of(file: McapFile, names: tuple[str, ...], scene: Scene | None = None) -> Session:
    """The session in a file, of these bodies; a part that is refused is left out, unless the file is read strictly."""
    facts, hashes = session_facts(file)
    meshes: dict[str, MeshData | None] = {}
    for name, stated in hashes.items():
        meshes[name] = file.attempt(partial(attached_mesh, file, name, stated), None, name)
    streams: dict[str, Any] = {
        name: LazyMapping(file.topics_below(prefix), partial(_stream, file, prefix))
        for prefix, name in schemas.STREAMS.items()
    }
    return Session(
        McapFrames(file, names),
        {name: mesh for name, mesh in meshes.items() if mesh is not None},
        file.attempt(partial(attached_scene, file), Scene()) if scene is None else scene,
        events=_items(file, schemas.EVENTS),
        intervals=_items(file, schemas.INTERVALS),
        facts=facts,
        origin=str(file.path),
        live_contacts=_items(file, schemas.LIVE_CONTACTS),
        colliders=file.attempt(partial(attached_colliders, file), {}),
        **streams,
    )


def _stream(file: McapFile, prefix: str, key: str) -> Any:
    return file.attempt(partial(topic_content, file, prefix + key), None)


def load_streams(session: Session) -> None:
    """Load everything of a session but its frames."""
    for name in schemas.STREAMS.values():
        dict(getattr(session, name))


def check_version(file: McapFile) -> None:
    """Refuse a file of our profile that is of another version."""
    if file.own:
        metadata.check_version(file.catalogue.profile, file.path)


def session_facts(file: McapFile) -> tuple[dict[str, str], dict[str, str]]:
    """The facts of a session, and mesh name -> SHA-256."""
    if not file.own:
        return {"format": "foreign", "profile": file.catalogue.profile or "none", **metadata.DECLARED}, {}
    facts, hashes = metadata.metadata_of(file.catalogue.metadata_record(metadata.SESSION_RECORD) or {})
    facts.pop(SCENE_FACT, None)  # of the program that wrote it
    return facts, hashes


def listed_names(file: McapFile) -> tuple[str, ...]:
    """The bodies that a file of the profile lists."""
    return metadata.names_of(file.catalogue.metadata_record(metadata.BODIES_RECORD), file.path)


def _scanned_names(file: McapFile) -> tuple[str, ...]:
    """The bodies of a foreign file, which lists them nowhere: one pass over its poses."""
    decoder = FrameDecoder(file.catalogue, None)
    for table in file.tables(schemas.TF):
        for _ in decoder.decode(table):
            pass
    return decoder.names


def attached_mesh(file: McapFile, name: str, expected: str) -> MeshData:
    """The mesh of a body; ``expected`` is its SHA-256."""
    data = file.attachment(metadata.mesh_file(name))
    if data is None:
        raise refusal(file.path, "mesh-unreadable", f"the mesh of {name!r} is not in the file")
    if (digest := hashlib.sha256(data).hexdigest()) != expected:
        what = f"the mesh of {name!r} is not the one that was recorded (SHA-256 {digest[:12]!r}, not {expected[:12]!r})"
        raise refusal(file.path, "mesh-hash", what)
    return _mesh(file, data)


def _mesh(file: McapFile, data: bytes) -> MeshData:
    from sessions.meshes.mesh_files import mesh_from_bytes

    try:
        return mesh_from_bytes(data, "glb")
    except MeshFileError as error:
        raise _refusal_of_file(file, error.code, error) from None


def attached_colliders(file: McapFile) -> dict[str, tuple[MeshData, ...]]:
    """Body -> its colliders, in the order of their numbers."""
    colliders: dict[str, dict[int, MeshData]] = {}
    for attachment in file.catalogue.attachments:
        key = metadata.collider_name(attachment)
        if key is not None:
            colliders.setdefault(key[0], {})[key[1]] = _mesh(file, file.attachment(attachment) or b"")
    return {name: tuple(solids[number] for number in sorted(solids)) for name, solids in colliders.items()}


def attached_scene(file: McapFile) -> Scene:
    """The scene in a file, an empty one where it has none."""
    data = file.attachment(SCENE_FILE)
    if data is None:
        return Scene()
    from sessions.scene_files.scene_toml import parse_scene

    try:
        return parse_scene(data.decode("utf-8", errors="replace"), SCENE_FILE)
    except SessionError as error:
        raise _refusal_of_file(file, "bad-scene", error) from None


def _refusal_of_file(file: McapFile, code: str, error: SessionError) -> SessionFileError:
    """Turns an error in a part of a file into a refusal of the file."""
    failure = SessionFileError(f"{file.path}: {error}")
    failure.code = code
    return failure


Messages = list[tuple[int, bytes]]
"""(publish_ns, payload) of a topic, in file order."""


def _samples(prefix: str, messages: Messages, _last_ns: int) -> Any:
    return annotations.read_stream(prefix, (payload for _, payload in messages))


_TOPIC_READERS: dict[str, Callable[[Messages, int], Any]] = {
    schemas.EVENTS: lambda messages, _: tuple(
        annotations.read_event(payload, time_ns) for time_ns, payload in messages
    ),
    schemas.INTERVALS: lambda messages, last_ns: annotations.read_intervals(
        (payload for _, payload in messages), last_ns
    ),
    schemas.LIVE_CONTACTS: lambda messages, _: tuple(annotations.read_contact(payload) for _, payload in messages),
    **{prefix: partial(_samples, prefix) for prefix in schemas.STREAMS},
}
"""Topic, or prefix of topics, beside those of the poses -> what a session makes of its messages."""


def is_session_topic(topic: str) -> bool:
    """Whether a session holds the messages of a topic, other than poses."""
    return schemas.topic_key(topic) in _TOPIC_READERS


def read_topic(where: Path, topic: str, messages: Messages, last_ns: int = 0) -> Any:
    """Decodes the messages of a topic; ``last_ns`` closes intervals without an end."""
    try:
        return _TOPIC_READERS[schemas.topic_key(topic)](messages, last_ns)
    except (DecodeError, ValueError, OverflowError, SessionError):
        raise refusal(where, "bad-message", f"a message on {topic} is not what its schema says") from None


def _items(file: McapFile, topic: str) -> Any:
    """Events, intervals or live contacts of a file; none where it has no channel for them."""
    if not file.catalogue.ids(topic):
        return ()
    return file.attempt(partial(topic_content, file, topic), ())


def topic_content(file: McapFile, topic: str) -> Any:
    """Reads and decodes the messages of a topic."""
    messages = list(file.payloads(topic))
    last_ns = (file.last_stamp() or 0) if messages and topic == schemas.INTERVALS else 0
    return read_topic(file.path, topic, messages, last_ns)


class LazyMapping(Mapping[str, Value], Generic[Value]):
    """Parts of a session by name; ``load`` is called once per key, when its value is asked for."""

    def __init__(self, keys: Sequence[str], load: Callable[[str], Value]) -> None:
        self._keys, self._load = dict.fromkeys(keys), cache(load)

    def __reduce__(self) -> Any:
        return LazyMapping, (tuple(self._keys), self._load.__wrapped__)

    def __getitem__(self, key: str) -> Value:
        if key not in self._keys:
            raise KeyError(key)
        return self._load(key)

    def __contains__(self, key: object) -> bool:  # the mixin's own would load the value
        return key in self._keys

    def __iter__(self) -> Iterator[str]:
        return iter(self._keys)

    def __len__(self) -> int:
        return len(self._keys)
