"""What lies where in an MCAP file, found by walking its records; nothing a file declares is allocated unchecked.

The walk reads record heads and skips chunks, so it costs a few reads per chunk and does not need the index at the
end; a file without one, or with messages outside chunks, is read the same way.
"""

from __future__ import annotations

import io
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Header, Metadata, Schema

from sessions.errors import SessionFileError
from sessions.mcap_format.container import MAGIC

# Records that are held whole while a file is opened. Ours are below 1 KiB; 16 MiB is what the largest published
# schema sets stay far below.
SMALL_RECORD_BYTES = 16 << 20
# A chunk may declare this many bytes unpacked; the writers of other tools default to 0.75 to 4 MiB.
CHUNK_LIMIT_BYTES = 64 << 20
ATTACHMENT_LIMIT_BYTES = 1 << 30
# Messages outside chunks are read in runs of about this many bytes.
RUN_BYTES = 1 << 20


@dataclass(frozen=True)
class ChannelInfo:
    """One channel of a file: its topic and how its messages are written."""

    topic: str
    encoding: str
    schema: str


@dataclass
class Region:
    """A stretch of the file that holds message records: the data of a chunk, or a run of records outside chunks."""

    offset: int
    length: int
    compression: str
    size: int
    crc: int
    channels: set[int] | None
    """Channels with messages here, or ``None`` when the file does not say."""


@dataclass(frozen=True)
class AttachmentPlace:
    """Where an attachment's bytes lie."""

    offset: int
    length: int


@dataclass
class Catalogue:
    """Everything in a file but the messages."""

    path: Path
    profile: str = ""
    regions: list[Region] = field(default_factory=list)
    schemas: dict[int, str] = field(default_factory=dict)
    channels: dict[int, ChannelInfo] = field(default_factory=dict)
    attachments: dict[str, AttachmentPlace] = field(default_factory=dict)
    metadata: list[tuple[str, dict[str, str]]] = field(default_factory=list)
    tear: int | None = None
    """Byte at which the file is cut short, or ``None``."""

    def declare(self, opcode: int, content: bytes) -> None:
        """Take in a schema or channel record, wherever it was met."""
        if opcode == Opcode.SCHEMA:
            schema = self._parsed(Schema, content)
            self.schemas[schema.id] = schema.name
        elif opcode == Opcode.CHANNEL:
            channel = self._parsed(Channel, content)
            name = self.schemas.get(channel.schema_id, "")
            self.channels[channel.id] = ChannelInfo(channel.topic, channel.message_encoding, name)

    def ids(self, topic: str) -> set[int]:
        """Channels of a topic."""
        return {number for number, channel in self.channels.items() if channel.topic == topic}

    def metadata_record(self, name: str) -> dict[str, str] | None:
        """The last metadata record of a name."""
        return next((values for found, values in reversed(self.metadata) if found == name), None)

    def take(self, opcode: int, content: bytes) -> None:
        """Take in a small record of the data or summary section."""
        if opcode == Opcode.HEADER:
            self.profile = self._parsed(Header, content).profile
        elif opcode == Opcode.METADATA:
            record = self._parsed(Metadata, content)
            self.metadata.append((record.name, record.metadata))
        else:
            self.declare(opcode, content)

    def _parsed(self, kind: Any, content: bytes) -> Any:
        try:
            return kind.read(ReadDataStream(io.BytesIO(content)))
        except (McapError, struct.error, UnicodeDecodeError, OverflowError):
            raise SessionFileError(
                f"{self.path}: a {kind.__name__} record is damaged; run `replay doctor` on the file"
            ) from None


_SMALL = {Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.METADATA}
_HEAD = struct.Struct("<BQ")
_CHUNK_HEAD = struct.Struct("<QQQII")


def read_catalogue(path: Path) -> Catalogue:
    """Walk a file from its magic to its footer, or to where it is torn (``tear`` says where).

    Raises
    ------
    SessionFileError
        The file cannot be opened, is empty, is no MCAP, or a record in it is damaged.
    """
    try:
        with path.open("rb") as stream:
            size = stream.seek(0, io.SEEK_END)
            stream.seek(0)
            magic = stream.read(len(MAGIC))
            if not magic:
                raise SessionFileError(f"{path} is empty; record or import the session again")
            if magic != MAGIC:
                raise SessionFileError(f"{path} is not an MCAP file; bring other formats in with `replay import`")
            return _Walk(path, stream, size).run()
    except OSError as error:
        raise SessionFileError(
            f"session file {path} cannot be read ({error.strerror or error}); check the path and who may read it"
        ) from None


class _Walk:
    def __init__(self, path: Path, stream: BinaryIO, size: int) -> None:
        self._stream, self._size = stream, size
        self._found = Catalogue(path)
        self._run: Region | None = None

    def run(self) -> Catalogue:
        at = len(MAGIC)
        while True:
            self._stream.seek(at)
            head = self._stream.read(_HEAD.size)
            opcode, length = _HEAD.unpack(head) if len(head) == _HEAD.size else (0, self._size)
            if at + _HEAD.size + length > self._size:
                self._found.tear = at
                return self._found
            if opcode == Opcode.FOOTER:
                whole = self._stream.seek(at + _HEAD.size + length) and self._stream.read(len(MAGIC)) == MAGIC
                self._found.tear = None if whole else at
                return self._found
            self._record(opcode, at, length)
            at += _HEAD.size + length

    def _record(self, opcode: int, at: int, length: int) -> None:
        start = at + _HEAD.size
        if opcode == Opcode.MESSAGE:
            self._message(at, length)
            return
        self._run = None
        if opcode == Opcode.CHUNK:
            self._found.regions.append(self._chunk(start, length))
        elif opcode == Opcode.MESSAGE_INDEX and self._found.regions and length >= 6:
            channel, entries = struct.unpack("<HI", self._stream.read(6))
            region = self._found.regions[-1]
            region.channels = region.channels or set()
            if entries:
                region.channels.add(channel)
        elif opcode == Opcode.ATTACHMENT:
            self._attachment(start, length)
        elif opcode in _SMALL:
            self._bound(opcode, length, SMALL_RECORD_BYTES)
            self._found.take(opcode, self._stream.read(length))

    def _message(self, at: int, length: int) -> None:
        """Join records outside chunks into runs that are read at once."""
        channel = int.from_bytes(self._stream.read(2), "little")
        run = self._run
        if run is None or run.length > RUN_BYTES:
            self._run = run = Region(at, 0, "", 0, 0, set())
            self._found.regions.append(run)
        run.length += _HEAD.size + length
        run.size = run.length
        self._bound(Opcode.MESSAGE, run.size, CHUNK_LIMIT_BYTES)
        if run.channels is not None:
            run.channels.add(channel)

    def _chunk(self, start: int, length: int) -> Region:
        head = self._stream.read(min(length, _CHUNK_HEAD.size))
        if len(head) < _CHUNK_HEAD.size:
            raise self._damaged("chunk", start)
        _, _, size, crc, name_length = _CHUNK_HEAD.unpack(head)
        rest = self._stream.read(min(length - len(head), name_length + 8)) if name_length < 64 else b""
        if len(rest) < name_length + 8:
            raise self._damaged("chunk", start)
        compression = rest[:name_length].decode("utf-8", errors="replace")
        data_length = int.from_bytes(rest[name_length:], "little")
        offset = start + len(head) + len(rest)
        if offset + data_length > start + length:
            raise self._damaged("chunk", start)
        self._bound(Opcode.CHUNK, size, CHUNK_LIMIT_BYTES)
        return Region(offset, data_length, compression, size, crc, None)

    def _attachment(self, start: int, length: int) -> None:
        self._bound(Opcode.ATTACHMENT, length, ATTACHMENT_LIMIT_BYTES)
        head = self._stream.read(min(length, 20))
        if len(head) < 20:
            raise self._damaged("attachment", start)
        name_length = int.from_bytes(head[16:], "little")
        if name_length > length:
            raise self._damaged("attachment", start)
        name = self._stream.read(name_length).decode("utf-8", errors="replace")
        self._found.attachments[name] = AttachmentPlace(start, length)

    def _bound(self, opcode: int, size: int, limit: int) -> None:
        if size > limit:
            raise SessionFileError(
                f"{self._found.path}: a {Opcode(opcode).name.lower()} record declares {size} bytes, more than the "
                f"{limit} this program allows; run `replay doctor` on the file"
            )

    def _damaged(self, what: str, at: int) -> SessionFileError:
        return SessionFileError(
            f"{self._found.path}: the {what} at byte {at} is damaged; save the rest with `replay recover`"
        )
