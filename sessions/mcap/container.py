"""The container of a session file: its records, and the catalogue of a file, for which no chunk is unpacked.

Records are read and written by the library `mcap`. What a file declares is not taken on trust: the library sees one
record at a time, and no byte behind it. A chunk stays as it is packed; `unpacking` opens it within bounds.

One walk over the records serves everybody: a reader refuses the first fault, the doctor names it, and `recover` goes
on behind it. It does not need the index at the end, so a file without one, or with messages outside chunks, is read
the same way. Sound files are not listed by the library's own readers, though ``StreamReader`` takes 0.87 of the time
(ten minutes of twelve bodies, 2026-11): it holds records to a limit and not the fields within them to their record, so
that a chunk which claims its neighbour's bytes hides that in silence, and a field that claims a gigabyte is read whole.
Its reader by index takes 0.08 and trusts the index: of 100 messages whose index leaves chunks out it gives 16.

Source: MCAP specification, https://mcap.dev/spec.
"""

import io
import struct
import zlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, NamedTuple

from mcap import records
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Header, McapRecord, MessageIndex, Metadata, Schema, Statistics
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from sessions.errors import SessionFileError
from sessions.file_kinds import HEAD_BYTES, file_kind
from sessions.mcap.refusals import refusal
from sessions.mcap.schemas import PROFILE_FAMILY, TF, channel_spec

MAGIC = b"\x89MCAP0\r\n"
LIBRARY = "vrlab-replay"
CHUNK_BYTES = 96 << 10
"""A damaged chunk is lost whole: of ten bodies at 90 Hz this much are two seconds."""

HEAD = struct.Struct("<BQ")  # Opcode and length of what follows, at the start of every record
MESSAGE_HEADER = struct.Struct("<BQHIQQ")  # Opcode, length of what follows, channel, sequence, log time, publish time
LENGTH_BEFORE_DATA = MESSAGE_HEADER.size - HEAD.size
"""Bytes of a message record that its length counts before the payload starts."""

MessageRecord = tuple[int, int, int, int, bytes]
"""Channel, sequence, log and publish time in nanoseconds, payload."""


class RecordSpan(NamedTuple):
    """The extent of a record in a file: its opcode, its first byte, and the byte after its last."""

    opcode: int
    start: int
    end: int


def record_spans(stream: BinaryIO) -> Iterator[RecordSpan]:
    """Every whole record up to the footer, or to the first one that reaches beyond the end of the file.

    While one is given the stream stands behind its head.
    """
    size, at = stream.seek(0, io.SEEK_END), len(MAGIC)
    while at + HEAD.size <= size:
        stream.seek(at)
        opcode, length = HEAD.unpack(stream.read(HEAD.size))
        span = RecordSpan(opcode, at, at + HEAD.size + length)
        if span.end > size:
            return
        yield span
        if opcode == Opcode.FOOTER:
            return
        at = span.end


def bytes_at(stream: BinaryIO, span: RecordSpan) -> bytes:
    """The bytes of a record."""
    stream.seek(span.start)
    return stream.read(span.end - span.start)


def parse_record(content: bytes) -> McapRecord | None:
    """The record in these bytes, head included; ``None``: it is damaged, or an attachment with a wrong checksum."""
    reader = StreamReader(io.BytesIO(content), skip_magic=True, emit_chunks=True, record_size_limit=len(content))
    try:
        record = next(reader.records, None)
    except (McapError, struct.error, ValueError, OverflowError):
        return None
    if isinstance(record, records.Attachment):
        stated = int.from_bytes(content[-4:], "little")  # 0: it has none
        if stated and zlib.crc32(content[HEAD.size : -4]) != stated:
            return None
    return record


def started_writer(stream: BinaryIO, profile: str, *, chunked: bool = True) -> Writer:
    """A writer whose header is written. Without chunks a file that is cut short reads as far as it was written."""
    writer = Writer(stream, chunk_size=CHUNK_BYTES, use_chunking=chunked, enable_data_crcs=True)
    writer.start(profile, LIBRARY)
    return writer


def add(writer: Writer, record: MessageRecord) -> None:
    """Append a message."""
    channel, sequence, log_ns, publish_ns, data = record
    writer.add_message(channel, log_ns, data, publish_ns, sequence)


def finish(writer: Writer) -> None:
    """Write the index and the footer."""
    writer.finish()  # type: ignore[no-untyped-call]


# A record is held whole while it is looked at: a longer one, such as a mesh of a gigabyte, is refused unread.
RECORD_LIMIT_BYTES = 1 << 30
# A chunk may declare this many bytes unpacked; the writers of other tools default to 0.75 to 4 MiB.
CHUNK_LIMIT_BYTES = 64 << 20
# Messages outside chunks are read in runs of about this many bytes.
RUN_BYTES = 1 << 20

# A file of n bytes may unpack to so much, hold so many messages, and so many samples (frames times bodies), so that
# reading costs at most 100 MB + 50 n. A minute of twelve bodies at rest unpacks to 24 n, with n / 25 messages and n / 4
# samples; no session comes near.
MOST_UNPACKED, UNPACKED_PER_BYTE = 32 << 20, 100
MOST_MESSAGES, BYTES_PER_MESSAGE = 100_000, 4
MOST_SAMPLES = 250_000
MOST_CHANNELS = 2048


class ChannelInfo(NamedTuple):
    """One channel of a file: its record, and that of its schema."""

    record: Channel
    schema: Schema | None

    @property
    def topic(self) -> str:
        """Its topic."""
        return str(self.record.topic)

    @property
    def schema_name(self) -> str:
        """The name of the schema of its messages."""
        return "" if self.schema is None else str(self.schema.name)

    @property
    def holds_poses(self) -> bool:
        """Whether its messages are of the schema that a reader understands on /tf."""
        return (self.record.message_encoding, self.schema_name) == ("protobuf", channel_spec(TF).schema)


@dataclass
class Region:
    """A stretch of the file that holds message records: a chunk, or a run of records outside chunks."""

    span: RecordSpan
    """Of the chunk's record, or from the first record of the run to the end of the last."""
    size: int
    """Bytes of its messages, unpacked."""
    channels: set[int] | None
    """Channels with messages here, or ``None`` when the file does not say."""
    first_ns: int = 0
    last_ns: int = 0
    """Log times that the chunk declares."""
    messages: int | None = None
    """How many it holds, once it was read."""
    indexed: int | None = None
    """How many its message index lists, where it has one."""

    @property
    def is_chunk(self) -> bool:
        """Whether it is a chunk."""
        return self.span.opcode == Opcode.CHUNK


class Fault(NamedTuple):
    """A record that cannot be used: its opcode, its first byte, why, and of an attachment its name."""

    opcode: int
    start: int
    error: SessionFileError
    name: str = ""


@dataclass
class Catalogue:
    """Everything in a file but the messages, and the room that a file of ``size`` bytes has for these."""

    path: Path
    size: int = 0
    strict: bool = True
    """Whether a damaged record is an error; else it is among the ``faults``."""
    unpacked: int = 0
    """Bytes of the regions read so far."""
    messages: int = 0
    """Messages in them."""
    profile: str = ""
    regions: list[Region] = field(default_factory=list)
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, ChannelInfo] = field(default_factory=dict)
    attachments: dict[str, RecordSpan] = field(default_factory=dict)
    metadata: list[tuple[str, dict[str, str]]] = field(default_factory=list)
    faults: list[Fault] = field(default_factory=list)
    tear: int | None = None
    """Byte at which the file is cut short, or ``None``."""
    data_end: RecordSpan | None = None
    """The record that ends the data; a file without one was never closed."""
    run: Region | None = None
    """The messages outside chunks that the next one joins."""
    counted: dict[int, int] | None = None
    """Channel -> messages, as the file's statistics have it."""
    listed: Counter[int] = field(default_factory=Counter)
    """Channel -> messages that an index lists, or that stand outside chunks."""

    @property
    def index_is_whole(self) -> bool:
        """Whether the indexes of chunks list as many messages of every channel as there are."""
        return self.counted == self.listed

    def declare(self, content: bytes) -> None:
        """Take in a schema or channel record, head included, wherever it was met.

        The first of an id counts, so that what a chunk repeats changes nothing for who unpacks it.
        """
        record = parse_record(content)
        if isinstance(record, Schema):
            self.schemas.setdefault(record.id, record)
        elif isinstance(record, Channel) and len(self.channels) < MOST_CHANNELS:
            if record.id not in self.channels or self.channels[record.id].schema is None:
                self.channels[record.id] = ChannelInfo(record, self.schemas.get(record.schema_id))
        elif isinstance(record, Channel):
            self.refuse(Opcode.CHANNEL, 0, "too-much", f"it has more than {MOST_CHANNELS} channels")
        elif content[0] in (Opcode.SCHEMA, Opcode.CHANNEL):
            kind = "Schema" if content[0] == Opcode.SCHEMA else "Channel"
            self.refuse(content[0], 0, "unreadable", f"a {kind} record is damaged")

    def refuse(self, opcode: int, start: int, code: str, what: str, name: str = "") -> None:
        """Refuse the file for a record, or note the fault and go on."""
        error = refusal(self.path, code, what)
        if self.strict:
            raise error
        self.faults.append(Fault(opcode, start, error, name))

    def ids(self, topic: str) -> set[int]:
        """Channels of a topic."""
        return {number for number, channel in self.channels.items() if channel.topic == topic}

    def metadata_record(self, name: str) -> dict[str, str] | None:
        """The last metadata record of a name."""
        return next((values for key, values in reversed(self.metadata) if key == name), None)

    def check_pose_channels(self) -> None:
        """Refuse a file whose poses are not what a reader understands, or that has none."""
        ids = self.ids(TF)
        for channel in map(self.channels.__getitem__, ids):
            if not channel.holds_poses:
                kind, encoding = channel.schema_name or "messages without a schema", channel.record.message_encoding
                raise refusal(self.path, "no-poses", f"/tf holds {kind} as {encoding or 'unknown bytes'}")
        if not ids and self.tear is None:
            raise refusal(self.path, "no-poses", "it has no poses")

    @property
    def is_import(self) -> bool:
        """Whether its messages are of another program and no session's, so that an importer reads them."""
        own = self.profile.startswith(PROFILE_FAMILY)
        return bool(self.channels) and not own and not any(self.channels[number].holds_poses for number in self.ids(TF))

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
        most = MOST_UNPACKED + UNPACKED_PER_BYTE * self.size
        if region.messages is None and self.unpacked + region.size > most:
            raise refusal(self.path, "too-much", f"its {self.size:,} bytes unpack to more than the {most:,} allowed")

    def note(self, region: Region, messages: int) -> None:
        """Count what a region holds, once."""
        if region.messages is None:
            region.messages = messages
            self.unpacked += region.size
            self.messages += messages

    def enter(self, stream: BinaryIO, span: RecordSpan) -> None:
        """Take in a record, behind whose head the stream stands."""
        is_message, length = span.opcode == Opcode.MESSAGE, span.end - span.start
        if not is_message:
            self.run = None
        if self._is_beyond(span, length, CHUNK_LIMIT_BYTES if is_message else RECORD_LIMIT_BYTES):
            return
        if is_message:
            self._message(span, int.from_bytes(stream.read(2), "little"))
        elif span.opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            self.declare(bytes_at(stream, span))
        elif span.opcode == Opcode.DATA_END:
            self.data_end = span
        elif span.opcode in ENTERED:
            content = bytes_at(stream, span)
            self._record(span, parse_record(content), content)

    def _record(self, span: RecordSpan, record: McapRecord | None, content: bytes) -> None:
        if isinstance(record, Header):
            self.profile = record.profile
        elif isinstance(record, Metadata):
            self.metadata.append((record.name, record.metadata))
        elif isinstance(record, Attachment):
            self.attachments[record.name] = span
        elif isinstance(record, Chunk):
            if not self._is_beyond(span, record.uncompressed_size, CHUNK_LIMIT_BYTES):
                times = record.message_start_time, record.message_end_time
                self.regions.append(Region(span, record.uncompressed_size, None, *times))
        elif isinstance(record, MessageIndex) and self.regions:
            region = self.regions[-1]
            region.indexed = (region.indexed or 0) + len(record.records)
            region.channels = region.channels or set()
            if record.records:
                region.channels.add(record.channel_id)
                self.listed[record.channel_id] += len(record.records)
        elif isinstance(record, Statistics):
            self.counted = record.channel_message_counts
        elif span.opcode == Opcode.ATTACHMENT:
            name = attachment_name(content)
            what = f"the attachment {name!r} is damaged" if name else f"the attachment at byte {span.start} is damaged"
            self.refuse(span.opcode, span.start, "damaged-attachment", what, name)
        elif span.opcode not in (Opcode.MESSAGE_INDEX, Opcode.STATISTICS):
            what = f"the {Opcode(span.opcode).name.lower()} at byte {span.start} is damaged"
            self.refuse(span.opcode, span.start, "unreadable", what)

    def _message(self, span: RecordSpan, channel: int) -> None:
        """Join records outside chunks into runs that are read at once."""
        if self.run is None or self.run.size > RUN_BYTES:
            self.run = Region(span, 0, set())
            self.regions.append(self.run)
        self.run.span = self.run.span._replace(end=span.end)
        self.run.size = span.end - self.run.span.start
        if self.run.channels is not None:
            self.run.channels.add(channel)
        self.listed[channel] += 1

    def _is_beyond(self, span: RecordSpan, size: int, limit: int) -> bool:
        if size > limit:
            kind = Opcode(span.opcode).name.lower() if span.opcode in set(Opcode) else "unknown"
            what = f"a {kind} record declares {size} bytes, more than the {limit} allowed"
            self.refuse(span.opcode, span.start, "unreadable", what)
        return size > limit


ENTERED = {
    Opcode.HEADER,
    Opcode.METADATA,
    Opcode.CHUNK,
    Opcode.MESSAGE_INDEX,
    Opcode.ATTACHMENT,
    Opcode.STATISTICS,
}
"""Records that a catalogue takes in; what the index repeats of others is not looked at."""


def attachment_name(content: bytes) -> str:
    """The name of an attachment record, as far as it can be read."""
    start = HEAD.size + 20
    length = int.from_bytes(content[start - 4 : start], "little")
    return content[start : start + length].decode(errors="replace") if length <= len(content) - start else ""


def read_catalogue(path: Path, stream: BinaryIO, *, strict: bool = True) -> Catalogue:
    """Lists a file from its magic to its footer or to where it is cut short (see ``tear``); memory is one record.

    SessionFileError where it is empty or no MCAP; where a record is damaged or too long, which only a strict reader
    refuses: else it is left out and among the ``faults``.
    """
    catalogue = Catalogue(path, stream.seek(0, io.SEEK_END), strict)
    stream.seek(0)
    head = stream.read(HEAD_BYTES)
    stream.seek(len(MAGIC))
    if not head.startswith(MAGIC):
        if not head:
            raise refusal(path, "not-mcap", "it is empty", "record it or copy it again")
        kind = file_kind(head)
        raise refusal(path, "not-mcap", f"it is {kind.noun}, not an MCAP file" if kind else "it is not an MCAP file")
    record = RecordSpan(0, 0, len(MAGIC))
    for record in record_spans(stream):
        catalogue.enter(stream, record)
    stream.seek(record.end)
    if record.opcode != Opcode.FOOTER:
        catalogue.tear = record.end
    elif stream.read(len(MAGIC)) != MAGIC:
        catalogue.tear = record.start
    return catalogue
