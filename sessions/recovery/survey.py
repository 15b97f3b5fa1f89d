"""One pass over a damaged file: what it declares, what is whole in it, and what is lost; nothing is written yet."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

from google.protobuf.message import DecodeError
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Schema

from sessions.errors import SessionFileError
from sessions.mcap_format.catalogue import RUN_BYTES, Catalogue, ChannelInfo, Region
from sessions.mcap_format.container import MAGIC
from sessions.mcap_format.pose_decoding import FrameDecoder
from sessions.mcap_format.schemas import TF, TRACKING, channel_spec
from sessions.mcap_format.unpacking import MessageTable
from sessions.recovery.chunk_reading import read_chunk
from sessions.recovery.lost import LostChunk
from sessions.recovery.record_scan import HEAD, Piece, RecordScan

DECLARING = (Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.METADATA)

GUESSED = (TF, TRACKING)
"""Topics that are known by what their messages look like, where no channel record is left."""


class Declared(Catalogue):
    """A catalogue that keeps schemas and channels as they were written, and bears with those that make no sense."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.raw_schemas: dict[int, Schema] = {}
        self.raw_channels: dict[int, Channel] = {}
        self.unread = 0

    def declare(self, opcode: int, content: bytes) -> None:
        """Take in a schema or channel record; the last of an id counts."""
        try:
            super().declare(opcode, content)
        except SessionFileError:
            self.unread += 1
            return
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(ReadDataStream(io.BytesIO(content)))
            self.raw_schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(ReadDataStream(io.BytesIO(content)))
            self.raw_channels[channel.id] = channel

    def take(self, opcode: int, content: bytes) -> None:
        """Take in a small record; one that makes no sense is counted."""
        try:
            super().take(opcode, content)
        except SessionFileError:
            self.unread += 1


@dataclass
class Survey:
    """What a damaged file holds.

    Parameters
    ----------
    declared : schemas, channels, metadata.
    attachments : name -> those that are whole; ``checked`` are those whose checksum says so.
    parts : regions with messages, and whether the file ends inside.
    """

    declared: Declared
    attachments: dict[str, Attachment] = field(default_factory=dict)
    checked: set[str] = field(default_factory=set)
    lost_attachments: list[str] = field(default_factory=list)
    parts: list[tuple[Region, bool]] = field(default_factory=list)
    lost: list[LostChunk] = field(default_factory=list)
    bytes_skipped: int = 0
    names: tuple[str, ...] = ()
    frames: int = 0
    first_ns: int = 0
    last_ns: int = 0

    def tables(self, stream: BinaryIO) -> Iterator[MessageTable]:
        """The messages that are kept, region by region."""
        for region, torn in self.parts:
            table = read_chunk(stream, region, self.declared, torn=torn)
            if table is not None:
                yield table


def survey(path: Path, stream: BinaryIO) -> Survey:
    """Look through a whole file; memory is one chunk and the whole attachments."""
    found = Survey(Declared(path))
    scan = RecordScan(stream)
    trusted = _index_start(stream)
    chunks: list[tuple[Piece, list[int]]] = []
    first: list[tuple[int, bytes]] = []
    later: list[tuple[int, bytes]] = []
    run: Region | None = None
    for piece in scan.pieces():
        run = _loose(piece, run, found)
        if piece.opcode == Opcode.CHUNK:
            chunks.append((piece, []))
        elif piece.opcode == Opcode.MESSAGE_INDEX and chunks:
            chunks[-1][1].append((piece.end - piece.content - 6) // 16)
        elif piece.opcode == Opcode.ATTACHMENT:
            _attachment(scan.bytes_of(piece), found)
        elif piece.opcode in DECLARING:
            indexed = trusted is not None and piece.start >= trusted
            (later if indexed else first).append((piece.opcode, scan.bytes_of(piece)))
        elif piece.opcode == 0:
            found.bytes_skipped += piece.end - piece.start
    # The copies in a checked index come last, because the last of an id counts.
    for opcode, content in [*first, *later]:
        found.declared.take(opcode, content)
    _read_chunks(stream, found, chunks)
    return found


def _loose(piece: Piece, run: Region | None, found: Survey) -> Region | None:
    """Messages outside chunks are joined to runs that are read at once."""
    if piece.opcode != Opcode.MESSAGE:
        return None
    if run is None or run.length > RUN_BYTES:
        run = Region(piece.start, 0, "", 0, 0, None)
        found.parts.append((run, False))
    run.length += piece.end - piece.start
    run.size = run.length
    return run


def _attachment(content: bytes, found: Survey) -> None:
    try:
        attachment: Any = Attachment.read(ReadDataStream(io.BytesIO(content)))
        stated = int.from_bytes(content[-4:], "little")
        if stated and zlib.crc32(content[:-4]) != stated:
            raise ValueError("its checksum is wrong")
    except (McapError, struct.error, ValueError, OverflowError):
        size = int.from_bytes(content[16:20], "little")
        found.lost_attachments.append(content[20 : 20 + min(size, 80)].decode("utf-8", errors="replace"))
        return
    found.attachments[attachment.name] = attachment
    if stated:
        found.checked.add(attachment.name)


def _read_chunks(stream: BinaryIO, found: Survey, chunks: list[tuple[Piece, list[int]]]) -> None:
    """Which chunks can be believed, which bodies and frames are in them; what cannot is written down as lost."""
    places = [(piece.region.offset, piece, counts) for piece, counts in chunks if piece.region is not None]
    loose = [(region.offset, None, [0]) for region, _ in found.parts]
    runs = {region.offset: region for region, _ in found.parts}
    found.parts = []
    poses = _Poses(found)
    for offset, piece, counts in sorted([*places, *loose], key=lambda one: one[0]):
        region = runs[offset] if piece is None or piece.region is None else piece.region
        torn = piece is not None and piece.torn
        table = read_chunk(stream, region, found.declared, torn=torn)
        if table is not None:
            guess_channels(table, found.declared)
            if not poses.read(table):
                table = None
        if table is not None:
            found.parts.append((region, torn))
        if table is None or torn:
            why = "cut short" if torn else "damaged"
            first, last = (piece.first_ns, piece.last_ns) if piece is not None else (0, 0)
            count = sum(counts) if counts and piece is not None else None
            found.lost.append(LostChunk(offset, first, last, None if torn else count, why))


class _Poses:
    """Reads the poses of region after region and counts what a reader will find."""

    def __init__(self, found: Survey) -> None:
        self._found = found
        self._channels: tuple[set[int], set[int]] | None = None
        self._decoder: FrameDecoder

    def read(self, table: MessageTable) -> bool:
        """Count the frames of a table; whether a reader can read them."""
        found, ids = self._found, self._found.declared.ids
        channels = (ids(TF), ids(TRACKING))
        if channels != self._channels:
            self._channels, self._decoder = channels, FrameDecoder(str(found.declared.path), *channels, None)
        stamps: list[int] = []
        count = 0
        try:
            for frames in self._decoder.decode(table):
                count += len(frames)
                if len(frames):
                    stamps += [int(frames.stamp_ns.min()), int(frames.stamp_ns.max())]
        except SessionFileError:
            return False
        if stamps:
            found.first_ns = min([*stamps, found.first_ns] if found.frames else stamps)
            found.last_ns = max([*stamps, found.last_ns])
        found.frames += count
        found.names = tuple(dict.fromkeys([*found.names, *self._decoder.names]))
        return True


def guess_channels(table: MessageTable, declared: Declared) -> None:
    """Name undeclared channels whose messages can only be poses or their validity."""
    for channel in sorted(set(table.channel.tolist()) - declared.channels.keys()):
        row = int(table.of_channels({channel})[0])
        for topic in GUESSED:
            if not declared.ids(topic) and _looks_like(topic, table.payload(row)):
                spec = channel_spec(topic)
                schema = Schema(id=60_000 + channel, name=spec.schema, encoding="protobuf", data=spec.descriptor_set)
                made = Channel(id=channel, schema_id=schema.id, topic=topic, message_encoding="protobuf", metadata={})
                declared.raw_schemas[schema.id], declared.raw_channels[channel] = schema, made
                declared.channels[channel] = ChannelInfo(topic, "protobuf", spec.schema)
                break


def _looks_like(topic: str, payload: bytes) -> bool:
    try:
        message = channel_spec(topic).message.FromString(payload)
    except DecodeError:
        return False
    if topic == TF:
        return bool(message.transforms) and all(
            one.child_frame_id and one.HasField("rotation") for one in message.transforms
        )
    return bool(message.bodies) and all(one.name for one in message.bodies)


def _index_start(stream: BinaryIO) -> int | None:
    """Where the index begins, if the file has one and it agrees with its checksum."""
    end = stream.seek(0, 2)
    foot = end - len(MAGIC) - HEAD.size - 20
    if foot < len(MAGIC):
        return None
    stream.seek(foot)
    content = stream.read(HEAD.size + 20)
    opcode, length, start, _, crc = struct.unpack("<BQQQI", content)
    if (opcode, length) != (Opcode.FOOTER, 20) or not crc or not len(MAGIC) <= start <= foot or foot - start > 64 << 20:
        return None
    stream.seek(start)
    agrees = zlib.crc32(content[:-4], zlib.crc32(stream.read(foot - start))) == crc
    return start if agrees else None
