"""The messages of one chunk, as far as they can be trusted.

A chunk whose checksum agrees is whole. A truncated chunk is read as far as it goes: what was written was right. A
chunk whose checksum is wrong is not read at all, because nobody can say which of its bytes changed.
"""

import io
from typing import Any, BinaryIO, Final

import lz4.frame
import numpy as np
import zstandard
from google.protobuf.message import DecodeError

from sessions.errors import SessionFileError
from sessions.mcap_format.catalogue import Catalogue, Region
from sessions.mcap_format.pose_decoding import MESSAGE_BYTES
from sessions.mcap_format.reader import is_part, read_part
from sessions.mcap_format.refusals import brief
from sessions.mcap_format.schemas import TF, TRACKING, channel_spec
from sessions.mcap_format.unpacking import ZSTD_WINDOW_BYTES, MessageTable, listed, read_region

CHECKED: Final = (TF, TRACKING)


def read_chunk(stream: BinaryIO, region: Region, catalogue: Catalogue, *, truncated: bool) -> MessageTable | str:
    """The messages of a chunk, or why it cannot be trusted; its channels go to the catalogue.

    Parameters
    ----------
    region : where its data lies; of a truncated chunk, what there is of it.
    truncated : the file ends inside the chunk.
    """
    try:
        if truncated:
            stream.seek(region.offset)
            data = unpacked_start(stream.read(region.length), region)
            return trusted(listed(data, region, catalogue, truncated=True), catalogue)
        table = read_region(stream, region, catalogue)
    except SessionFileError as error:
        return "damaged" if "is damaged" in str(error) else f"unreadable ({brief(error)})"
    return table if region.crc else trusted(table, catalogue)


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


def trusted(table: MessageTable, catalogue: Catalogue) -> MessageTable:
    """Messages without a checksum; poses and validity that are not what their schema says are left out."""
    keep = np.ones(len(table.channel), dtype=np.bool_)
    for topic in CHECKED:
        for row in table.of_channels(catalogue.ids(topic)).tolist():
            keep[row] = parsed(topic, table.payload(row)) is not None
    return table if keep.all() else table.part(np.flatnonzero(keep))


def readable(table: MessageTable, catalogue: Catalogue) -> MessageTable:
    """Messages but those, other than poses, that a reader of sessions refuses."""
    keep = np.ones(len(table.channel), dtype=np.bool_)
    for number in set(table.channel.tolist()) & catalogue.channels.keys():
        topic = catalogue.channels[number].topic
        for row in table.of_channels({number}).tolist() if is_part(topic) else ():
            try:
                read_part(catalogue.path, topic, [(int(table.publish_ns[row]), table.payload(row))])
            except SessionFileError:
                keep[row] = False
    return table if keep.all() else table.part(np.flatnonzero(keep))


def parsed(topic: str, payload: bytes) -> Any:
    """A message of a topic of the profile, ``None`` when it is none or too long to be one."""
    try:
        return channel_spec(topic).message.FromString(payload) if len(payload) <= MESSAGE_BYTES else None
    except DecodeError:
        return None
