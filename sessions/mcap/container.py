"""The container of a session file: its records, read and written by the library `mcap`.

What a file declares is not taken on trust: the library sees one record at a time, and no byte behind it. A chunk stays
as it is packed; `unpacking` opens it within bounds.
Source: MCAP specification, https://mcap.dev/spec.
"""

import io
import struct
import zlib
from collections.abc import Iterator
from typing import BinaryIO, NamedTuple

from mcap import records
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import McapRecord
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

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


def parsed(content: bytes) -> McapRecord | None:
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
