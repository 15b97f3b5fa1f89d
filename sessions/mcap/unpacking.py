"""The message records of one region of a file, unpacked and listed within bounds that the file cannot raise.

Source: MCAP specification, https://mcap.dev/spec (chunk, message); zstandard and lz4 frames state a size of their own
that must not exceed the chunk's.
"""

import zlib
from array import array
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import BinaryIO

import lz4.frame
import numpy as np
import zstandard
from mcap.opcode import Opcode
from mcap.records import Chunk
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from sessions.errors import SessionFileError
from sessions.mcap.container import HEAD, LENGTH_BEFORE_DATA, MESSAGE_HEADER, Catalogue, Region, bytes_at, parse_record
from sessions.mcap.refusals import refusal

_MESSAGE = np.dtype(
    [("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("log", "<u8"), ("publish", "<u8")]
)
# A window of 2 GiB would let a small chunk claim it; no writer of session data uses more than a few MiB.
ZSTD_WINDOW_BYTES = 128 << 20


@dataclass(frozen=True, eq=False)
class MessageTable:
    """The m messages of one region in file order; all columns are (m,) int64.

    ``data`` are the region's bytes; ``data[start[i]:end[i]]`` is the payload of message i.
    """

    data: bytes
    start: NDArray[np.int64]
    end: NDArray[np.int64]
    channel: NDArray[np.int64]
    sequence: NDArray[np.int64]
    log_ns: NDArray[np.int64]
    publish_ns: NDArray[np.int64]

    def of_channels(self, ids: set[int]) -> NDArray[np.int64]:
        """Numbers of the messages on these channels."""
        return np.flatnonzero(np.isin(self.channel, list(ids)))

    def payload(self, row: int) -> bytes:
        """One message's payload."""
        return self.data[self.start[row] : self.end[row]]

    def take(self, rows: NDArray[np.int64]) -> "MessageTable":
        """Some of the messages."""
        return MessageTable(self.data, *(getattr(self, name)[rows] for name in _COLUMNS))


_COLUMNS = ("start", "end", "channel", "sequence", "log_ns", "publish_ns")
JOINED_BYTES = 1 << 20
"""Small regions are listed together up to this size: a step through a table costs the same for a second as for ten."""


def together(tables: Iterable[MessageTable]) -> Iterator[MessageTable]:
    """The same messages in the same order, in tables of about ``JOINED_BYTES``."""
    pending: list[MessageTable] = []
    for table in tables:
        pending.append(table)
        if sum(len(item.data) for item in pending) >= JOINED_BYTES:
            yield _joined_messages(pending)
            pending = []
    if pending:
        yield _joined_messages(pending)


def _joined_messages(tables: list[MessageTable]) -> MessageTable:
    if len(tables) == 1:
        return tables[0]
    columns = {name: np.concatenate([getattr(table, name) for table in tables]) for name in _COLUMNS}
    before = np.cumsum([0, *(len(table.data) for table in tables[:-1])])
    shift = np.repeat(before, [len(table.start) for table in tables])
    columns["start"] += shift
    columns["end"] += shift
    return MessageTable(b"".join(table.data for table in tables), **columns)


def read_region(stream: BinaryIO, region: Region, catalogue: Catalogue) -> MessageTable:
    """Unpack a region, check it, and list its messages; an error says how it is damaged."""
    catalogue.check_unpacked(region)
    data = bytes_at(stream, region.span)
    if region.is_chunk:
        chunk = parse_record(data)
        assert isinstance(chunk, Chunk)
        try:
            data = unpack_chunk(chunk.data, chunk.compression, chunk.uncompressed_size)
        except (zstandard.ZstdError, RuntimeError, ValueError) as error:
            raise _damage_error(catalogue, region, str(error)) from None
        if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
            raise _damage_error(catalogue, region, "its checksum is wrong")
    return messages_of_region(data, region, catalogue)


def unpack_chunk(packed: bytes, compression: str, size: int) -> bytes:
    """The ``size`` bytes that a chunk declares: the one place where data of a file is unpacked.

    Never takes the memory of more than that. Raises ``zstandard.ZstdError``, ``RuntimeError`` or ``ValueError``: it
    holds another number of bytes, or is damaged.
    """
    if compression not in _UNPACK:
        raise ValueError(f"its compression {compression!r} is unknown; known: zstd, lz4, none")
    data = _UNPACK[compression](packed, size)
    if len(data) != size:
        raise ValueError(f"it declares {size} bytes and holds {len(data)}")
    return data


def _zstd(packed: bytes, size: int) -> bytes:
    declared = zstandard.frame_content_size(packed)
    if declared > size:
        raise ValueError(f"it declares {size} bytes and its content {declared}")
    if size == 0:
        return b""
    unpacker = zstandard.ZstdDecompressor(max_window_size=ZSTD_WINDOW_BYTES)
    return bytes(unpacker.decompress(packed, max_output_size=size))


_UNPACK: dict[str, Callable[[bytes, int], bytes]] = {
    "zstd": _zstd,
    # One byte more than declared, so that a chunk which holds more is noticed without being unpacked.
    "lz4": lambda packed, size: bytes(lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=size + 1)),
    "": lambda packed, _size: packed,
}


def _damage_error(catalogue: Catalogue, region: Region, why: str) -> SessionFileError:
    return refusal(catalogue.path, "damaged-chunk", f"the chunk at byte {region.span.start} is damaged ({why})")


def messages_of_region(data: bytes, region: Region, catalogue: Catalogue) -> MessageTable:
    """The messages in a region's unpacked bytes; schemas and channels among them go to the catalogue.

    A record that is longer than the rest is an error.
    """
    starts, at, size = array("q"), 0, len(data)
    most = region.messages if region.messages is not None else catalogue.messages_left
    head, head_size, message = HEAD.unpack_from, HEAD.size, int(Opcode.MESSAGE)
    while at + head_size <= size:
        opcode, length = head(data, at)
        end = at + head_size + length
        if end > size or (opcode == message and length < LENGTH_BEFORE_DATA):
            break
        if opcode == message:
            if len(starts) >= most:
                what = f"its {catalogue.size:,} bytes hold more than {catalogue.messages + most:,} messages"
                raise refusal(catalogue.path, "too-much", what)
            starts.append(at)
        else:
            catalogue.declare(data[at:end])
        at = end
    if at != size:
        raise _damage_error(catalogue, region, f"the record {at} bytes into it has an impossible length")
    catalogue.note(region, len(starts))
    begin = np.array(starts, dtype=np.int64)
    table = rows_at(np.frombuffer(data, dtype=np.uint8), begin, MESSAGE_HEADER.size).view(_MESSAGE)[:, 0]
    log, publish = table["log"].astype(np.int64), table["publish"].astype(np.int64)
    if len(log) and min(log.min(), publish.min()) < 0:
        raise _damage_error(catalogue, region, "a stamp in it is beyond the year 2262")
    start, end = begin + MESSAGE_HEADER.size, begin + head_size + table["length"].astype(np.int64)
    channel, sequence = table["channel"].astype(np.int64), table["sequence"].astype(np.int64)
    return MessageTable(data, start, end, channel, sequence, log, publish)


def rows_at(buffer: NDArray[np.uint8], starts: NDArray[np.int64], length: int) -> NDArray[np.uint8]:
    """A copy (n, length) of the bytes that begin at each start."""
    if not len(starts):
        return np.zeros((len(starts), length), dtype=np.uint8)
    window = as_strided(buffer, (len(buffer) - length + 1, length), (1, 1), writeable=False)
    return window[starts]
