"""One scan of a damaged file: what it declares, which records are whole, and what is lost. It writes nothing."""

import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Schema

from sessions.errors import SessionFileError
from sessions.mcap_format import catalogue
from sessions.mcap_format.catalogue import DECLARING, Catalogue, ChannelInfo, Region
from sessions.mcap_format.container import MAGIC
from sessions.mcap_format.pose_decoding import FrameDecoder
from sessions.mcap_format.refusals import brief
from sessions.mcap_format.schemas import TF, TRACKING, channel_spec
from sessions.mcap_format.unpacking import MessageTable
from sessions.recovery.chunk_reading import parsed, read_chunk, readable, trusted
from sessions.recovery.lost import LostChunk
from sessions.recovery.record_scan import Piece, RecordScan

GUESSED = (TF, TRACKING)  # Topics that are known by what their messages look like, where no channel record is left

INDEX_LIMIT_BYTES = 64 << 20  # A longer index is not trusted over the records it repeats


class Declared(Catalogue):
    """A catalogue that keeps schemas and channels as written, and counts records that cannot be read."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.raw: dict[type, dict[int, Any]] = {Schema: {}, Channel: {}}
        self.unread = 0

    def take(self, opcode: int, content: bytes) -> None:
        """Take in a small record; the last of an id counts."""
        try:
            super().take(opcode, content)
        except SessionFileError:
            self.unread += 1

    def declare(self, opcode: int, content: bytes) -> None:
        """Take in a schema or channel record; the last of an id counts."""
        try:
            super().declare(opcode, content)
        except SessionFileError:
            self.unread += 1

    def _parsed(self, kind: Any, content: bytes) -> Any:
        record = super()._parsed(kind, content)
        if kind in self.raw:
            self.raw[kind][record.id] = record
        return record


@dataclass
class FileScan:
    """What a damaged file holds."""

    declared: Declared  # schemas, channels, metadata
    attachments: dict[str, Attachment] = field(default_factory=dict)  # those that are whole, by name
    checked: set[str] = field(default_factory=set)  # those whose checksum says so
    lost_attachments: list[str] = field(default_factory=list)
    # with messages; whether the file ends inside; whether messages without sense stand among those of poses
    parts: list[tuple[Region, bool, bool]] = field(default_factory=list)
    left_out: int = 0  # messages that are not what their schema says
    lost: list[LostChunk] = field(default_factory=list)
    bytes_skipped: int = 0
    closed: bool = False  # the record that ends the data is there
    names: tuple[str, ...] = ()
    frames: int = 0
    first_ns: int = 0
    last_ns: int = 0

    def tables(self, stream: BinaryIO) -> Iterator[MessageTable]:
        """The messages that are kept, region by region."""
        for region, truncated, mixed in self.parts:
            table = read_chunk(stream, region, self.declared, truncated=truncated)
            if not isinstance(table, str):
                table = readable(table, self.declared)
                yield trusted(table, self.declared) if mixed else table


def scan_file(path: Path, stream: BinaryIO) -> FileScan:
    """Look through a whole file; memory is one chunk and the whole attachments."""
    found = FileScan(Declared(path))
    scan = RecordScan(stream)
    index_start = _index_start(stream)
    chunks: list[tuple[Piece, list[int]]] = []
    first: list[tuple[int, bytes]] = []
    later: list[tuple[int, bytes]] = []
    run: Region | None = None
    for piece in scan.pieces():
        run = _run(piece, run, found)
        found.closed |= piece.opcode == Opcode.DATA_END
        if piece.opcode == Opcode.CHUNK:
            chunks.append((piece, []))
        elif piece.opcode == Opcode.MESSAGE_INDEX and chunks:
            chunks[-1][1].append((piece.end - piece.content - 6) // 16)
        elif piece.opcode == Opcode.ATTACHMENT:
            _attachment(scan.bytes_of(piece), found)
        elif piece.opcode in DECLARING:
            indexed = index_start is not None and piece.start >= index_start
            (later if indexed else first).append((piece.opcode, scan.bytes_of(piece)))
        elif piece.opcode == 0:
            found.bytes_skipped += piece.end - piece.start
    # The copies in a checked index come last, because the last of an id counts.
    for opcode, content in [*first, *later]:
        found.declared.take(opcode, content)
    _read_chunks(stream, found, chunks)
    return found


def _run(piece: Piece, run: Region | None, found: FileScan) -> Region | None:
    """Messages outside chunks are joined to runs that are read at once."""
    if piece.opcode != Opcode.MESSAGE:
        return None
    if run is None or run.length > catalogue.RUN_BYTES:
        run = Region(piece.start, 0, "", 0, 0, None)
        found.parts.append((run, False, False))
    run.length += piece.end - piece.start
    run.size = run.length
    return run


def _attachment(content: bytes, found: FileScan) -> None:
    read = catalogue.read_attachment(content)
    if read is None:
        size = int.from_bytes(content[16:20], "little")
        found.lost_attachments.append(content[20 : 20 + min(size, 80)].decode("utf-8", errors="replace"))
        return
    attachment, checked = read
    found.attachments[attachment.name] = attachment
    if checked:
        found.checked.add(attachment.name)


def _read_chunks(stream: BinaryIO, found: FileScan, chunks: list[tuple[Piece, list[int]]]) -> None:
    """Decide in file order which chunks and runs can be read; the others are noted as lost."""
    regions: list[tuple[Region, bool, int | None]] = [
        (piece.region, piece.truncated, sum(counts) if counts else None) for piece, counts in chunks if piece.region
    ]
    runs = [(run, False, None) for run, *_ in found.parts]
    found.parts = []
    poses = _Poses(found)
    for region, truncated, count in sorted([*regions, *runs], key=lambda one: one[0].offset):
        table = read_chunk(stream, region, found.declared, truncated=truncated)
        why = table if isinstance(table, str) else ""
        if not isinstance(table, str):
            guess_channels(table, found.declared)
            kept = readable(table, found.declared)
            why = poses.read(kept)
            if mixed := bool(why):
                kept = trusted(kept, found.declared)
                why = poses.read(kept) and why
            if not why:
                found.parts.append((region, truncated, mixed))
                found.left_out += len(table.channel) - len(kept.channel)
        if why or truncated:
            why = "cut short" if truncated else why
            lost = LostChunk(region.offset, region.first_ns, region.last_ns, None if truncated else count, why)
            found.lost.append(lost)


class _Poses:
    """Reads the poses of region after region and counts what a reader will find."""

    def __init__(self, found: FileScan) -> None:
        self._found = found
        self._channels: tuple[set[int], set[int]] | None = None
        self._decoder: FrameDecoder

    def read(self, table: MessageTable) -> str:
        """Count the frames of a table; why a reader cannot read them, or ``""``."""
        found, ids = self._found, self._found.declared.ids
        channels = (ids(TF), ids(TRACKING))
        if channels != self._channels:
            self._channels, self._decoder = channels, FrameDecoder(str(found.declared.path), *channels, None)
        stamps: list[int] = []
        count = 0
        decoder = self._decoder.fork()
        try:
            for frames in decoder.decode(table):
                count += len(frames)
                if len(frames):
                    stamps += [int(frames.stamp_ns.min()), int(frames.stamp_ns.max())]
        except SessionFileError as error:
            return f"unreadable ({brief(error)})"
        self._decoder = decoder
        if stamps:
            found.first_ns = min([*stamps, found.first_ns] if found.frames else stamps)
            found.last_ns = max([*stamps, found.last_ns])
        found.frames += count
        found.names = tuple(dict.fromkeys([*found.names, *self._decoder.names]))
        return ""


def guess_channels(table: MessageTable, declared: Declared) -> None:
    """Name channels whose messages can only be poses or their validity, where no record does or a damaged one."""
    known = {number for number, one in declared.channels.items() if one.topic != TF or one.holds_poses}
    for channel in sorted(set(table.channel.tolist()) - known):
        row = int(table.of_channels({channel})[0])
        for topic in GUESSED:
            if not declared.ids(topic) - {channel} and _looks_like(topic, table.payload(row)):
                spec, number = channel_spec(topic), 60_000 + channel
                declared.raw[Schema][number] = Schema(number, spec.descriptor_set, "protobuf", spec.schema)
                declared.raw[Channel][channel] = Channel(channel, topic, "protobuf", {}, number)
                declared.channels[channel] = ChannelInfo(topic, "protobuf", spec.schema)
                break


def _looks_like(topic: str, payload: bytes) -> bool:
    message = parsed(topic, payload)
    if message is None:
        return False
    if topic == TF:
        poses = message.transforms
        return bool(poses) and all(one.child_frame_id and one.HasField("rotation") for one in poses)
    return bool(message.bodies) and all(one.name for one in message.bodies)


def _index_start(stream: BinaryIO) -> int | None:
    """Where the index begins, if the file has one and it agrees with its checksum."""
    footer = catalogue.read_footer(stream)
    if footer is None:
        return None
    foot, record, says = footer
    start = says.summary_start
    if not says.summary_crc or not len(MAGIC) <= start <= foot or foot - start > INDEX_LIMIT_BYTES:
        return None
    stream.seek(start)
    agrees = zlib.crc32(record[:-4], zlib.crc32(stream.read(foot - start))) == says.summary_crc
    return start if agrees else None
