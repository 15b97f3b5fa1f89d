"""Whole MCAP message records in a row, and where a chunk may end between them."""

import struct
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

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
    is ``len(data)``; ``group_counts`` (g,): number of records up to the end of each group.
    """

    data: bytes
    starts: NDArray[np.int64]
    channel: NDArray[np.int64]
    log_ns: NDArray[np.int64]
    group_ends: NDArray[np.int64]
    group_counts: NDArray[np.int64]

    def split(self, groups: int) -> "tuple[RecordBlock, RecordBlock]":
        """The first groups, and the rest."""
        if groups >= len(self.group_ends):
            return self, RecordBlock.of([])
        cut, count = int(self.group_ends[groups - 1]), int(self.group_counts[groups - 1])
        head = RecordBlock(
            self.data[:cut], self.starts[:count], self.channel[:count], self.log_ns[:count],
            self.group_ends[:groups], self.group_counts[:groups],
        )  # fmt: skip
        rest = RecordBlock(
            self.data[cut:], self.starts[count:] - cut, self.channel[count:], self.log_ns[count:],
            self.group_ends[groups:] - cut, self.group_counts[groups:] - count,
        )  # fmt: skip
        return head, rest

    @classmethod
    def join(cls, blocks: "list[RecordBlock]") -> "RecordBlock":
        """Blocks after each other."""
        if len(blocks) == 1:
            return blocks[0]
        bytes_before = np.cumsum([0, *(len(block.data) for block in blocks)])
        count_before = np.cumsum([0, *(len(block.starts) for block in blocks)])
        return cls(
            b"".join(block.data for block in blocks),
            np.concatenate([block.starts + at for block, at in zip(blocks, bytes_before, strict=False)]),
            np.concatenate([block.channel for block in blocks]),
            np.concatenate([block.log_ns for block in blocks]),
            np.concatenate([block.group_ends + at for block, at in zip(blocks, bytes_before, strict=False)]),
            np.concatenate([block.group_counts + at for block, at in zip(blocks, count_before, strict=False)]),
        )

    @classmethod
    def of(cls, messages: Iterable[tuple[int, int, int, int, bytes]]) -> "RecordBlock":
        """One group per message (channel, sequence, log_ns, publish_ns, payload)."""
        records, channels, logs = [], [], []
        for channel, sequence, log_ns, publish_ns, payload in messages:
            length = LENGTH_BEFORE_DATA + len(payload)
            records.append(MESSAGE_HEADER.pack(Opcode.MESSAGE, length, channel, sequence, log_ns, publish_ns) + payload)
            channels.append(channel)
            logs.append(log_ns)
        ends = np.cumsum([len(record) for record in records], dtype=np.int64)
        starts = np.concatenate([np.zeros(1, np.int64), ends])[: len(records)]
        counts = np.arange(1, len(records) + 1, dtype=np.int64)
        return cls(b"".join(records), starts, np.array(channels, np.int64), np.array(logs, np.int64), ends, counts)
