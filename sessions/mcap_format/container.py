"""The bytes that record heads of an MCAP file are made of, and the library's writer with this project's settings.

Source: MCAP specification, https://mcap.dev/spec.
"""

import struct
from typing import BinaryIO

from mcap import records
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

MAGIC = b"\x89MCAP0\r\n"
LIBRARY = "vrlab-replay"
CHUNK_BYTES = 96 << 10
"""A damaged chunk is lost whole: of ten bodies at 90 Hz this much are two seconds."""

HEAD = struct.Struct("<BQ")  # Opcode and length of what follows, at the start of every record
CHUNK_HEAD = struct.Struct("<QQQII")
"""Start time, end time, unpacked size, checksum, and the length of the compression's name."""
MESSAGE_HEADER = struct.Struct("<BQHIQQ")  # Opcode, length of what follows, channel, sequence, log time, publish time
LENGTH_BEFORE_DATA = MESSAGE_HEADER.size - HEAD.size
"""Bytes of a message record that its length counts before the payload starts."""

MessageRecord = tuple[int, int, int, int, bytes]
"""Channel, sequence, log and publish time in nanoseconds, payload."""


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


def rewrite(source: BinaryIO, target: BinaryIO) -> None:
    """Write a file of our own, finished and without chunks, again in chunks."""
    writer: Writer | None = None
    for record in StreamReader(source).records:
        if isinstance(record, records.DataEnd):
            break
        if isinstance(record, records.Header):
            writer = started_writer(target, record.profile)
        assert writer is not None
        if isinstance(record, records.Schema):
            writer.register_schema(record.name, record.encoding, record.data)
        elif isinstance(record, records.Channel):
            writer.register_channel(record.topic, record.message_encoding, record.schema_id, record.metadata)
        elif isinstance(record, records.Attachment):
            times = record.create_time, record.log_time
            writer.add_attachment(*times, record.name, record.media_type, record.data)
        elif isinstance(record, records.Metadata):
            writer.add_metadata(record.name, record.metadata)
        elif isinstance(record, records.Message):
            times = record.log_time, record.publish_time
            add(writer, (record.channel_id, record.sequence, *times, record.data))
    assert writer is not None
    finish(writer)
