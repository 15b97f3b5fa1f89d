"""The messages of one chunk, as far as they can be believed.

A chunk whose checksum agrees is whole. One that the file's end cut is read as far as it goes: what was written was
right. One whose checksum is wrong is not read at all, because nobody can say which of its bytes changed.
"""

from __future__ import annotations

import io
import struct
from typing import BinaryIO, Final

import lz4.frame
import numpy as np
import zstandard
from google.protobuf.message import DecodeError
from mcap.opcode import Opcode

from sessions.errors import SessionFileError
from sessions.mcap_format.catalogue import Catalogue, Region
from sessions.mcap_format.pose_decoding import MESSAGE_BYTES
from sessions.mcap_format.record_block import LENGTH_BEFORE_DATA
from sessions.mcap_format.schemas import TF, TRACKING, channel_spec
from sessions.mcap_format.unpacking import ZSTD_WINDOW_BYTES, MessageTable, listed, read_region

_HEAD: Final = struct.Struct("<BQ")
CHECKED: Final = (TF, TRACKING)


def read_chunk(stream: BinaryIO, region: Region, catalogue: Catalogue, *, torn: bool) -> MessageTable | None:
    """The messages of a chunk; ``None`` when it cannot be believed.

    Parameters
    ----------
    region : where its data lies; of a torn one, what there is of it.
    catalogue : learns the channels that the chunk declares.
    torn : the file ends inside the chunk.
    """
    if not torn:
        try:
            table = read_region(stream, region, catalogue)
        except SessionFileError:
            return None
        return table if region.crc else believable(table, catalogue)
    stream.seek(region.offset)
    data = whole_records(unpacked_start(stream.read(region.length), region))
    part = Region(region.offset, len(data), "", len(data), 0, None)
    try:
        return believable(listed(data, part, catalogue), catalogue)
    except SessionFileError:
        return None


def unpacked_start(packed: bytes, region: Region) -> bytes:
    """What can be unpacked of data that ends too early."""
    try:
        if region.compression == "zstd":
            unpacker = zstandard.ZstdDecompressor(max_window_size=ZSTD_WINDOW_BYTES)
            return bytes(unpacker.stream_reader(io.BytesIO(packed)).read(region.size))
        if region.compression == "lz4":
            return bytes(lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=region.size))
    except (zstandard.ZstdError, RuntimeError):
        return b""
    return packed[: region.size]


def whole_records(data: bytes) -> bytes:
    """The records at the start of data that are there in full."""
    at = 0
    while at + _HEAD.size <= len(data):
        opcode, length = _HEAD.unpack_from(data, at)
        end = at + _HEAD.size + length
        if end > len(data) or (opcode == Opcode.MESSAGE and length < LENGTH_BEFORE_DATA):
            break
        at = end
    return data[:at]


def believable(table: MessageTable, catalogue: Catalogue) -> MessageTable:
    """Messages without a checksum: poses and validity that are not what their schema says are left out."""
    keep = np.ones(len(table.channel), dtype=np.bool_)
    for topic in CHECKED:
        kind = channel_spec(topic).message
        for row in table.of_channels(catalogue.ids(topic)).tolist():
            keep[row] = _parses(kind, table.payload(row))
    return table if keep.all() else part_of(table, np.flatnonzero(keep))


def part_of(table: MessageTable, rows: np.ndarray[tuple[int], np.dtype[np.int64]]) -> MessageTable:
    """Some of the messages."""
    return MessageTable(
        table.data, table.start[rows], table.end[rows], table.channel[rows], table.sequence[rows],
        table.log_ns[rows], table.publish_ns[rows],
    )  # fmt: skip


def _parses(kind: type, payload: bytes) -> bool:
    if len(payload) > MESSAGE_BYTES:
        return False
    try:
        kind.FromString(payload)  # type: ignore[attr-defined]
    except DecodeError:
        return False
    return True
