"""Writes an MCAP container from records that are already bytes: same calls, same bytes, every CRC in place.

The `mcap` library's writer takes one message per call (about 12 us each); this one takes a block of whole message
records at once, and decides alone when a chunk closes, so that a recorder can bound what a crash costs.

Source: MCAP specification, https://mcap.dev/spec.
"""

import struct
import zlib
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, BinaryIO

import numpy as np
import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from numpy.typing import NDArray

from sessions.mcap_format.schemas import channel_spec

MAGIC = b"\x89MCAP0\r\n"
LIBRARY = "vrlab-replay"
# Level 1: on 65 MB of noisy poses level 3 takes 1.3 times as long and saves 1 % (python-zstandard 0.25).
ZSTD_LEVEL = 1

HEAD = struct.Struct("<BQ")  # Opcode and length of what follows, at the start of every record
CHUNK_HEAD = struct.Struct("<QQQII")
"""Start time, end time, unpacked size, checksum, and the length of the compression's name."""
MESSAGE_HEADER = struct.Struct("<BQHIQQ")  # Opcode, length of what follows, channel, sequence, log time, publish time
LENGTH_BEFORE_DATA = MESSAGE_HEADER.size - HEAD.size
"""Bytes of a message record that its length counts before the payload starts."""


@dataclass(frozen=True, eq=False)
class RecordBlock:
    """m message records in g groups; a group (a frame with its validity) always lies in one chunk.

    ``starts`` (m,): where each record begins in ``data``; ``group_ends`` (g,): byte offsets after each group, the last
    is ``len(data)``.
    """

    data: bytes
    starts: NDArray[np.int64]
    channel: NDArray[np.int64]
    log_ns: NDArray[np.int64]
    group_ends: NDArray[np.int64]

    def split(self, groups: int) -> "tuple[RecordBlock, RecordBlock]":
        """The first groups, and the rest."""
        if groups >= len(self.group_ends):
            return self, RecordBlock.of([])
        cut = int(self.group_ends[groups - 1])
        count = int(np.searchsorted(self.starts, cut))
        head = (self.data[:cut], self.starts[:count], self.channel[:count], self.log_ns[:count])
        rest = (self.data[cut:], self.starts[count:] - cut, self.channel[count:], self.log_ns[count:])
        return RecordBlock(*head, self.group_ends[:groups]), RecordBlock(*rest, self.group_ends[groups:] - cut)

    @classmethod
    def join(cls, blocks: "list[RecordBlock]") -> "RecordBlock":
        """Blocks after each other."""
        if len(blocks) == 1:
            return blocks[0]
        bytes_before = np.cumsum([0, *(len(block.data) for block in blocks)])
        return cls(
            b"".join(block.data for block in blocks),
            np.concatenate([block.starts + at for block, at in zip(blocks, bytes_before, strict=False)]),
            np.concatenate([block.channel for block in blocks]),
            np.concatenate([block.log_ns for block in blocks]),
            np.concatenate([block.group_ends + at for block, at in zip(blocks, bytes_before, strict=False)]),
        )

    @classmethod
    def of(cls, messages: Iterable[tuple[int, int, int, int, bytes]], *, grouped: bool = False) -> "RecordBlock":
        """Of messages (channel, sequence, log_ns, publish_ns, payload), each a group.

        ``grouped``: those of one sequence, which follow each other, are one.
        """
        records, channels, sequences, logs = [], [], [], []
        for channel, sequence, log_ns, publish_ns, payload in messages:
            length = LENGTH_BEFORE_DATA + len(payload)
            records.append(MESSAGE_HEADER.pack(Opcode.MESSAGE, length, channel, sequence, log_ns, publish_ns) + payload)
            channels.append(channel)
            sequences.append(sequence)
            logs.append(log_ns)
        ends = np.cumsum([len(record) for record in records], dtype=np.int64)
        starts = np.concatenate([np.zeros(1, np.int64), ends])[: len(records)]
        group_ends = ends[np.diff(sequences, append=-1) != 0] if grouped else ends
        return cls(b"".join(records), starts, np.array(channels, np.int64), np.array(logs, np.int64), group_ends)


class ContainerWriter:
    """An MCAP file being written to a binary stream from its position 0 on, which this object never closes.

    A chunk closes with the first group boundary at or beyond ``chunk_bytes`` uncompressed bytes, and before a group
    logged ``chunk_ns`` after its first message; ``None``: by size alone. ``profile`` is that of the header.
    """

    def __init__(self, stream: BinaryIO, profile: str, chunk_bytes: int = 1 << 20, chunk_ns: int | None = None) -> None:
        self._stream, self._chunk_bytes, self._chunk_ns = stream, chunk_bytes, chunk_ns
        self._position, self._crc = 0, 0
        self._schemas: dict[str, records.Schema] = {}
        self._channels: dict[str, records.Channel] = {}
        self._chunks: list[records.ChunkIndex] = []
        self._attachments: list[records.AttachmentIndex] = []
        self._metadata: list[records.MetadataIndex] = []
        self._counts: Counter[int] = Counter()
        self._span: tuple[int, int] | None = None
        self._open: list[RecordBlock] = []
        self._compressor = zstandard.ZstdCompressor(level=ZSTD_LEVEL)
        self._put(MAGIC)
        self._record(records.Header(profile, LIBRARY))

    @property
    def open_bytes(self) -> int:
        """Uncompressed size of the chunk that is not yet written."""
        return sum(len(block.data) for block in self._open)

    def attachment(self, name: str, media_type: str, data: bytes, time_ns: int = 0) -> None:
        """Write one attachment; it lies outside chunks and is never compressed."""
        start = self._position
        length = self._record(records.Attachment(time_ns, time_ns, name, media_type, data))
        self._attachments.append(records.AttachmentIndex(start, length, time_ns, time_ns, len(data), name, media_type))

    def metadata(self, name: str, values: dict[str, str]) -> None:
        """Write one metadata record."""
        start = self._position
        self._metadata.append(records.MetadataIndex(start, self._record(records.Metadata(name, values)), name))

    def channel(self, topic: str) -> int:
        """The id of a topic of the profile; its schema and channel records are written the first time.

        They lie before the chunks, not inside one, so that a damaged chunk takes only its own messages with it.
        """
        if topic not in self._channels:
            spec = channel_spec(topic)
            schema = records.Schema(id=0, name=spec.schema, encoding="protobuf", data=spec.descriptor_set)
            number = self._add_schema(spec.schema, schema)
            self._add_channel(topic, records.Channel(0, topic, "protobuf", {}, number))
        return self._channels[topic].id

    def adopt(self, channel: records.Channel, schema: records.Schema | None) -> int:
        """The id of a channel of another file, which is written as it was but for its numbers."""
        key = f"{channel.topic}\0{channel.id}"
        if key not in self._channels:
            number = 0 if schema is None else self._add_schema(f"{schema.name}\0{schema.id}", schema)
            self._add_channel(key, replace(channel, schema_id=number))
        return self._channels[key].id

    def _add_schema(self, key: str, schema: records.Schema) -> int:
        if key not in self._schemas:
            self._schemas[key] = replace(schema, id=len(self._schemas) + 1)
            self._record(self._schemas[key])
        return self._schemas[key].id

    def _add_channel(self, key: str, channel: records.Channel) -> None:
        self._channels[key] = replace(channel, id=len(self._channels) + 1)
        self._record(self._channels[key])

    def messages(self, block: RecordBlock) -> None:
        """Append message records. A chunk closes when it reaches its size; how the blocks were cut does not matter."""
        while len(block.group_ends):
            room = self._chunk_bytes - self.open_bytes
            groups = int(np.searchsorted(block.group_ends, room, side="left")) + 1
            in_time = self._groups_in_time(block)
            if min(groups, in_time):
                head, block = block.split(min(groups, in_time))
                self._open.append(head)
            if self.open_bytes >= self._chunk_bytes or (groups > in_time and len(block.group_ends)):
                self.close_chunk()

    def _groups_in_time(self, block: RecordBlock) -> int:
        """How many groups at the start of a block may join the open chunk by their time."""
        if self._chunk_ns is None:
            return len(block.group_ends)
        begun = int(self._open[0].log_ns[0]) if self._open else int(block.log_ns[0])
        first = np.searchsorted(block.starts, np.concatenate([[0], block.group_ends[:-1]]))
        late = np.flatnonzero(np.abs(block.log_ns[first] - begun) >= self._chunk_ns)
        return int(late[0]) if len(late) else len(block.group_ends)

    def close_chunk(self) -> None:
        """Write the open records as one chunk with its message index; without open records write nothing."""
        if not self._open:
            return
        block = RecordBlock.join(self._open)
        self._open = []
        first, last = int(block.log_ns.min()), int(block.log_ns.max())
        data = self._compressor.compress(block.data)
        chunk = records.Chunk("zstd", data, last, first, zlib.crc32(block.data), len(block.data))
        start = self._position
        length = self._record(chunk)
        offsets, index_start = self._message_indexes(block), self._position
        index = b"".join(offsets.values())
        places = index_start + np.cumsum([0, *(len(part) for part in offsets.values())])
        self._put(index)
        self._chunks.append(
            records.ChunkIndex(
                chunk_length=length,
                chunk_start_offset=start,
                compression=chunk.compression,
                compressed_size=len(data),
                message_end_time=last,
                message_index_length=len(index),
                message_index_offsets=dict(zip(offsets, places[:-1].tolist(), strict=True)),
                message_start_time=first,
                uncompressed_size=len(block.data),
            )
        )
        self._span = (first, last) if self._span is None else (min(first, self._span[0]), max(last, self._span[1]))

    def _message_indexes(self, block: RecordBlock) -> dict[int, bytes]:
        """Channel id -> its MessageIndex record."""
        found = {}
        for channel in np.unique(block.channel).tolist():
            mine = np.flatnonzero(block.channel == channel)
            entries = np.stack([block.log_ns[mine], block.starts[mine]], axis=1).astype("<u8").tobytes()
            head = struct.pack("<BQHI", Opcode.MESSAGE_INDEX, 6 + len(entries), channel, len(entries))
            found[channel] = head + entries
            self._counts[channel] += len(mine)
        return found

    def finish(self) -> None:
        """Close the open chunk and write the index, the statistics and the footer."""
        self.close_chunk()
        self._record(records.DataEnd(self._crc))
        start, first, last = self._position, *(self._span or (0, 0))
        statistics = records.Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            message_end_time=last,
            message_start_time=first,
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )
        groups: list[tuple[Opcode, list[records.McapRecord]]] = [
            (Opcode.SCHEMA, list(self._schemas.values())),
            (Opcode.CHANNEL, list(self._channels.values())),
            (Opcode.STATISTICS, [statistics]),
            (Opcode.CHUNK_INDEX, list(self._chunks)),
            (Opcode.ATTACHMENT_INDEX, list(self._attachments)),
            (Opcode.METADATA_INDEX, list(self._metadata)),
        ]
        summary, offsets = b"", b""
        for opcode, listed in groups:
            part = _bytes(*listed)
            if part:
                offsets += _bytes(records.SummaryOffset(opcode, start + len(summary), len(part)))
            summary += part
        footer = records.Footer(start, start + len(summary), 0)
        footer.summary_crc = zlib.crc32(summary + offsets + _bytes(footer)[:-4])
        self._put(summary + offsets + _bytes(footer) + MAGIC)
        self._stream.flush()

    def _record(self, record: records.McapRecord) -> int:
        return self._put(_bytes(record))

    def _put(self, data: bytes) -> int:
        self._stream.write(data)
        self._crc = zlib.crc32(data, self._crc)
        self._position += len(data)
        return len(data)


def _bytes(*written: records.McapRecord) -> bytes:
    builder: Any = RecordBuilder()
    for record in written:
        record.write(builder)
    return bytes(builder.end())
