"""Reads a session file: metadata, meshes and events at once, poses chunk by chunk when they are asked for.

Memory for ``Session.blocks`` is one chunk and one block, for a file of any length.
"""

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Generic, TypeVar

from google.protobuf.message import DecodeError

from sessions.errors import SessionError, SessionFileError, TornFileError
from sessions.mcap_format.annotations import read_contact, read_event, read_hand, read_intervals, read_track
from sessions.mcap_format.mcap_file import McapFile, McapFrames
from sessions.mcap_format.metadata import (
    BODIES_RECORD,
    DECLARED,
    SESSION_RECORD,
    mesh_file,
    metadata_of,
    migrated,
    names_of,
)  # fmt: skip
from sessions.mcap_format.schemas import (
    EVENTS,
    HANDS_PREFIX,
    INTERVALS,
    LIVE_CONTACTS,
    PROFILE_FAMILY,
    TF,
    TRACKS_PREFIX,
)  # fmt: skip
from sessions.mcap_format.writer import SCENE_FILE
from sessions.mesh_data import MeshData
from sessions.model.event import Interval
from sessions.model.scene import Scene
from sessions.model.session import Session

TF_SCHEMA = "foxglove.FrameTransforms"
MISSING = "missing"  # The metadata key that says what a truncated file lacks

Result = TypeVar("Result")
Value = TypeVar("Value")


def read_session(path: str | Path, *, torn: str = "refuse") -> Session:
    """Read a session file of profile ``vrlab/1``, or any MCAP with ``foxglove.FrameTransforms`` on ``/tf``.

    Meshes are checked against their hashes. Frames, hands, live contacts and faster tracks are decoded when asked for.
    A file without the profile has the metadata ``format: foreign`` and ``profile: none`` (or what it calls its own).

    ``path``: the file; ``torn``: what to do with a file that was cut short, for example by a crash of the recorder:
    ``refuse``, or ``keep`` every whole chunk; the metadata key ``missing`` then says what is not there.

    Raises ``SessionFileError``: the file is missing, empty, damaged, no MCAP, of an unknown version, or has no poses;
    ``TornFileError`` when it was cut short and ``torn`` is ``refuse``.
    """
    if torn not in ("refuse", "keep"):
        raise SessionError(f"torn is {torn!r}; use 'refuse' or 'keep'")
    file = McapFile(Path(path))
    if file.catalogue.tear is not None and torn == "refuse":
        raise TornFileError(
            f"{path} is cut short at byte {file.catalogue.tear} and has no index; save what is there with "
            "`replay recover`"
        )
    own = file.catalogue.profile.startswith(PROFILE_FAMILY)
    metadata = {"format": "foreign", "profile": file.catalogue.profile or "none", **DECLARED}
    hashes: dict[str, str] = {}
    if own:
        record = file.catalogue.metadata_record(SESSION_RECORD) or {}
        metadata, hashes = _named(file, lambda: metadata_of(migrated(record, file.catalogue.profile)))
    _check_pose_channels(file)
    if file.catalogue.tear is not None:
        metadata[MISSING] = _missing(file)
    listed = file.catalogue.metadata_record(BODIES_RECORD)
    return Session(
        McapFrames(file, _named(file, lambda: names_of(listed)) if own else _scanned_names(file)),
        {name: _mesh(file, name, expected) for name, expected in hashes.items()},
        _scene(file),
        events=_read(file, EVENTS, lambda found: tuple(read_event(payload, time_ns) for time_ns, payload in found)),
        intervals=_read(file, INTERVALS, lambda found: _intervals(file, found)),
        facts=metadata,
        origin=str(path),
        hands=LazyMapping(
            file.topics_below(HANDS_PREFIX), lambda key: _read(file, HANDS_PREFIX + key, _payloads(read_hand))
        ),
        live_contacts=LazySequence(
            lambda: _read(file, LIVE_CONTACTS, _payloads(lambda found: tuple(map(read_contact, found))))
        ),
        fast_tracks=LazyMapping(
            file.topics_below(TRACKS_PREFIX), lambda key: _read(file, TRACKS_PREFIX + key, _payloads(read_track))
        ),
    )


def _scanned_names(file: McapFile) -> tuple[str, ...]:
    """The bodies of a foreign file, which lists them nowhere: one pass over its poses."""
    decoder = file.decoder(None)
    for table in file.tables(TF):
        for _ in decoder.decode(table):
            pass
    return decoder.names


def _named(file: McapFile, load: Callable[[], Result]) -> Result:
    """What a function gives; its error begins with the file's name, once."""
    try:
        return load()
    except SessionError as error:
        path = file.catalogue.path
        raise SessionFileError(f"{path}: {str(error).removeprefix(f'{path}: ')}") from None


def _check_pose_channels(file: McapFile) -> None:
    ids = file.catalogue.ids(TF)
    for channel in (file.catalogue.channels[number] for number in ids):
        if (channel.encoding, channel.schema) != ("protobuf", TF_SCHEMA):
            raise file.error(
                f"/tf holds {channel.schema or 'messages without a schema'} as {channel.encoding or 'unknown bytes'}",
                f"write poses as {TF_SCHEMA} in protobuf",
            )
    if not ids and file.catalogue.tear is None:
        raise file.error("it has no poses", f"write {TF_SCHEMA} messages on /tf")


def _missing(file: McapFile) -> str:
    last = file.last_stamp()
    kept = "no frame is left" if last is None else f"the last frame kept is at {last} ns"
    return f"everything after byte {file.catalogue.tear}; {kept}"


def _mesh(file: McapFile, name: str, expected: str) -> MeshData:
    from sessions.meshes.mesh_files import mesh_from_bytes

    data = file.attachment(mesh_file(name))
    if data is None:
        raise file.error(f"the mesh of {name!r} is not in the file")
    if hashlib.sha256(data).hexdigest() != expected:
        raise file.error(f"the mesh of {name!r} is not the one that was recorded (its SHA-256 differs)")
    return _named(file, lambda: mesh_from_bytes(data, "glb"))


def _scene(file: McapFile) -> Scene:
    data = file.attachment(SCENE_FILE)
    if data is None:
        return Scene()
    from sessions.scene_files.scene_toml import parse_scene

    return _named(file, lambda: parse_scene(data.decode("utf-8", errors="replace"), SCENE_FILE))


def _read(file: McapFile, topic: str, read: Callable[[list[tuple[int, bytes]]], Result]) -> Result:
    """What a function makes of the (publish_ns, payload) of a topic."""
    try:
        return _named(file, lambda: read(list(file.payloads(topic))))
    except (DecodeError, ValueError, OverflowError):
        raise file.error(f"a message on {topic} is not what its schema says") from None


def _payloads(read: Callable[[Iterator[bytes]], Result]) -> Callable[[list[tuple[int, bytes]]], Result]:
    return lambda messages: read(payload for _, payload in messages)


def _intervals(file: McapFile, messages: list[tuple[int, bytes]]) -> tuple[Interval, ...]:
    last_ns = (file.last_stamp() or 0) if messages else 0
    return read_intervals((payload for _, payload in messages), last_ns)


class LazyMapping(Mapping[str, Value], Generic[Value]):
    """Parts of a session by name; ``load`` is called once per key, when its value is asked for."""

    def __init__(self, keys: Sequence[str], load: Callable[[str], Value]) -> None:
        self._keys, self._load = dict.fromkeys(keys), cache(load)

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


class LazySequence(Sequence[Value], Generic[Value]):
    """A sequence that ``load`` gives whole when its first item is asked for."""

    def __init__(self, load: Callable[[], Sequence[Value]]) -> None:
        self._load = cache(lambda: tuple(load()))

    def __getitem__(self, index: Any) -> Any:
        return self._load()[index]

    def __len__(self) -> int:
        return len(self._load())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and self._load() == tuple(other)

    def __hash__(self) -> int:
        return hash(self._load())
