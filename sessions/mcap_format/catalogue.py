"""Where the parts of an MCAP file are; declared lengths are checked before anything is allocated.

The walk reads record heads and skips chunks: a few reads per chunk. It does not need the index at the end, so a file
without an index, or with messages outside chunks, is read the same way.
"""

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
from sessions.input_files import opened
from sessions.mcap_format.container import CHUNK_HEAD, HEAD, MAGIC
from sessions.mcap_format.refusals import refused
from sessions.mcap_format.schemas import TF, channel_spec

# Records that are held whole while a file is opened. Ours are below 1 KiB; 16 MiB is what the largest published
# schema sets stay far below.
SMALL_RECORD_BYTES = 16 << 20
# A chunk may declare this many bytes unpacked; the writers of other tools default to 0.75 to 4 MiB.
CHUNK_LIMIT_BYTES = 64 << 20
ATTACHMENT_LIMIT_BYTES = 1 << 30
# Messages outside chunks are read in runs of about this many bytes.
RUN_BYTES = 1 << 20

# A file of n bytes may unpack to so much, hold so many messages, and so many samples (frames times bodies), so that
# reading costs at most 100 MB + 50 n. A minute of twelve bodies at rest unpacks to 24 n, with n / 25 messages and n / 4
# samples; no session comes near.
MOST_UNPACKED, UNPACKED_PER_BYTE = 32 << 20, 100
MOST_MESSAGES, BYTES_PER_MESSAGE = 100_000, 4
MOST_SAMPLES = 250_000
MOST_CHANNELS = 2048
# A compression with a longer name is damage; the specification knows "zstd" and "lz4".
NAME_LIMIT_BYTES = 64


@dataclass(frozen=True)
class ChannelInfo:
    """One channel of a file: its topic and how its messages are written."""

    topic: str
    encoding: str
    schema: str

    @property
    def holds_poses(self) -> bool:
        """Whether its messages are of the schema that a reader understands on /tf."""
        return (self.encoding, self.schema) == ("protobuf", channel_spec(TF).schema)


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
    start: int = 0
    """First byte of the chunk record; 0 for a run of records outside chunks."""
    first_ns: int = 0
    last_ns: int = 0
    """Log times that the chunk declares."""
    messages: int | None = None
    """How many it holds, once it was read."""
    indexed: int | None = None
    """How many its message index lists, where it has one."""


def chunk_region(start: int, content: bytes) -> Region | None:
    """The region of the chunk record at byte ``start``, from the first bytes of its content; ``None``: damaged."""
    if len(content) < CHUNK_HEAD.size:
        return None
    first, last, size, crc, name_length = CHUNK_HEAD.unpack_from(content)
    after = CHUNK_HEAD.size + name_length
    if name_length >= NAME_LIMIT_BYTES or len(content) < after + 8:
        return None
    name = content[CHUNK_HEAD.size : after].decode("utf-8", errors="replace")
    length = int.from_bytes(content[after : after + 8], "little")
    return Region(start + HEAD.size + after + 8, length, name, size, crc, None, start, first, last)


@dataclass
class Catalogue:
    """Everything in a file but the messages, and the room that a file of ``size`` bytes has for these."""

    path: Path
    size: int = 0
    unpacked: int = 0
    """Bytes of the regions read so far."""
    messages: int = 0
    """Messages in them."""
    profile: str = ""
    regions: list[Region] = field(default_factory=list)
    schemas: dict[int, str] = field(default_factory=dict)
    channels: dict[int, ChannelInfo] = field(default_factory=dict)
    attachments: dict[str, tuple[int, int]] = field(default_factory=dict)
    """Name -> (first byte, length) of what follows the record's head."""
    metadata: list[tuple[str, dict[str, str]]] = field(default_factory=list)
    tear: int | None = None
    """Byte at which the file is cut short, or ``None``."""
    run: Region | None = None
    """The messages outside chunks that the next one joins."""

    def declare(self, opcode: int, content: bytes) -> None:
        """Take in a schema or channel record, wherever it was met."""
        if opcode == Opcode.SCHEMA:
            schema = self._parsed(Schema, content)
            self.schemas[schema.id] = schema.name
        elif opcode == Opcode.CHANNEL:
            if len(self.channels) >= MOST_CHANNELS:
                raise refused(self.path, "too-much", f"it has more than {MOST_CHANNELS} channels")
            channel = self._parsed(Channel, content)
            name = self.schemas.get(channel.schema_id, "")
            self.channels[channel.id] = ChannelInfo(channel.topic, channel.message_encoding, name)

    def ids(self, topic: str) -> set[int]:
        """Channels of a topic."""
        return {number for number, channel in self.channels.items() if channel.topic == topic}

    def metadata_record(self, name: str) -> dict[str, str] | None:
        """The last metadata record of a name."""
        return next((values for found, values in reversed(self.metadata) if found == name), None)

    def check_pose_channels(self) -> None:
        """Refuse a file whose poses are not what a reader understands, or that has none."""
        ids = self.ids(TF)
        for channel in map(self.channels.__getitem__, ids):
            if not channel.holds_poses:
                kind, encoding = channel.schema or "messages without a schema", channel.encoding or "unknown bytes"
                raise refused(self.path, "no-poses", f"/tf holds {kind} as {encoding}")
        if not ids and self.tear is None:
            raise refused(self.path, "no-poses", "it has no poses")

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
            raise refused(self.path, "unreadable", f"a {kind.__name__} record is damaged") from None

    @property
    def most_samples(self) -> int:
        """Frames times bodies that the file may hold."""
        return MOST_SAMPLES + self.size

    @property
    def messages_left(self) -> int:
        """Messages that the regions not yet read may hold."""
        return MOST_MESSAGES + self.size // BYTES_PER_MESSAGE - self.messages

    def check_unpacked(self, region: Region) -> None:
        """Refuse a region with which the file unpacks to more than a recording does."""
        if region.messages is None and self.unpacked + region.size > MOST_UNPACKED + UNPACKED_PER_BYTE * self.size:
            most = MOST_UNPACKED + UNPACKED_PER_BYTE * self.size
            raise refused(self.path, "too-much", f"its {self.size:,} bytes unpack to more than the {most:,} allowed")

    def note(self, region: Region, messages: int) -> None:
        """Count what a region holds, once."""
        if region.messages is None:
            region.messages = messages
            self.unpacked += region.size
            self.messages += messages

    def enter(self, stream: BinaryIO, opcode: int, at: int, length: int) -> None:
        """Take in the record at byte ``at``, of whose content, ``length`` bytes, the stream stands at the first one."""
        if opcode == Opcode.MESSAGE:
            self._message(at, length, int.from_bytes(stream.read(2), "little"))
            return
        self.run = None
        if opcode == Opcode.CHUNK:
            self._chunk(at, length, stream.read(min(length, CHUNK_HEAD.size + NAME_LIMIT_BYTES + 8)))
        elif opcode == Opcode.MESSAGE_INDEX and self.regions and length >= 6:
            channel, entries = struct.unpack("<HI", stream.read(6))
            region = self.regions[-1]
            region.indexed = (region.indexed or 0) + entries // 16
            region.channels = region.channels or set()
            if entries:
                region.channels.add(channel)
        elif opcode == Opcode.ATTACHMENT:
            self._attachment(stream, at + HEAD.size, length)
        elif opcode in DECLARING:
            self._bound(opcode, length, SMALL_RECORD_BYTES)
            self.take(opcode, stream.read(length))

    def _message(self, at: int, length: int, channel: int) -> None:
        """Join records outside chunks into runs that are read at once."""
        if self.run is None or self.run.length > RUN_BYTES:
            self.run = Region(at, 0, "", 0, 0, set())
            self.regions.append(self.run)
        self.run.length += HEAD.size + length
        self.run.size = self.run.length
        self._bound(Opcode.MESSAGE, self.run.size, CHUNK_LIMIT_BYTES)
        if self.run.channels is not None:
            self.run.channels.add(channel)

    def _chunk(self, at: int, length: int, head: bytes) -> None:
        region = chunk_region(at, head)
        if region is None or region.offset + region.length > at + HEAD.size + length:
            raise self._damaged("chunk", at + HEAD.size)
        self._bound(Opcode.CHUNK, region.size, CHUNK_LIMIT_BYTES)
        self.regions.append(region)

    def _attachment(self, stream: BinaryIO, start: int, length: int) -> None:
        self._bound(Opcode.ATTACHMENT, length, ATTACHMENT_LIMIT_BYTES)
        head = stream.read(min(length, 20))
        name_length = int.from_bytes(head[16:], "little")
        if len(head) < 20 or name_length > length:
            raise self._damaged("attachment", start)
        name = stream.read(name_length).decode("utf-8", errors="replace")
        self.attachments[name] = (start, length)

    def _bound(self, opcode: int, size: int, limit: int) -> None:
        if size > limit:
            what = f"a {Opcode(opcode).name.lower()} record declares {size} bytes, more than the {limit} allowed"
            raise refused(self.path, "unreadable", what)

    def _damaged(self, what: str, at: int) -> SessionFileError:
        return refused(self.path, "unreadable", f"the {what} at byte {at} is damaged")


DECLARING = {Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.METADATA}  # Small records that say what the file is


def read_catalogue(path: Path) -> Catalogue:
    """Walk a file from its magic to its footer, or to where it is cut short (see ``tear``).

    SessionFileError where it cannot be opened, is empty, is no MCAP, or a record in it is damaged.
    """
    with opened(path, "session file", SessionFileError) as stream:
        size = stream.seek(0, io.SEEK_END)
        check_magic(path, stream)
        stream.seek(0)
        if stream.read(len(MAGIC)) != MAGIC:
            raise refused(path, "unreadable", "its first bytes are damaged")
        found, at = Catalogue(path, size), len(MAGIC)
        while True:
            stream.seek(at)
            head = stream.read(HEAD.size)
            opcode, length = HEAD.unpack(head) if len(head) == HEAD.size else (0, size)
            after = at + HEAD.size + length
            if after > size or opcode == Opcode.FOOTER:
                whole = after <= size and stream.seek(after) and stream.read(len(MAGIC)) == MAGIC
                found.tear = None if whole else at
                return found
            found.enter(stream, opcode, at, length)
            at = after


def check_magic(path: Path, stream: BinaryIO) -> None:
    """Refuse what is no MCAP file; half of the mark in front, or the mark at the end, tell a damaged one."""
    size = stream.seek(0, io.SEEK_END)
    stream.seek(0)
    begin = stream.read(len(MAGIC))
    stream.seek(max(0, size - len(MAGIC)))
    alike = sum(a == b for a, b in zip(begin, MAGIC, strict=False))
    if 2 * alike < len(MAGIC) and stream.read(len(MAGIC)) != MAGIC:
        raise refused(path, "not-mcap", "it is not an MCAP file" if size else "it is empty")
