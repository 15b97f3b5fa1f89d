"""One walk through a damaged file: what it declares, which messages can be trusted, what is lost. It writes nothing.

A chunk whose checksum agrees is whole. One whose checksum is wrong is not read at all, because nobody can say which of
its bytes changed. What follows a record that is not whole is lost: nothing is guessed among bytes without records.
"""

import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from google.protobuf.message import DecodeError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Schema

from sessions.errors import SessionFileError
from sessions.mcap_format.catalogue import DECLARING, SMALL_RECORD_BYTES, Catalogue, Region
from sessions.mcap_format.container import HEAD, MAGIC
from sessions.mcap_format.mcap_file import read_attachment, read_footer
from sessions.mcap_format.pose_decoding import MESSAGE_BYTES, FrameDecoder
from sessions.mcap_format.reader import is_part, read_part
from sessions.mcap_format.refusals import brief
from sessions.mcap_format.schemas import TF, TRACKING, channel_spec
from sessions.mcap_format.unpacking import MessageTable, read_region
from sessions.recovery.lost import LostChunk

POSES = (TF, TRACKING)  # Topics whose messages are checked

COPIED_ATTACHMENT_BYTES = 128 << 20  # A mesh larger than this is not copied: it would have 4 million faces
INDEX_LIMIT_BYTES = 64 << 20  # A longer index is not trusted over the records it repeats


class Declared(Catalogue):
    """A catalogue that keeps schemas and channels as written, and counts records that cannot be read."""

    def __init__(self, path: Path, size: int) -> None:
        super().__init__(path, size)
        self.raw: dict[type, dict[int, Any]] = {Schema: {}, Channel: {}}
        self.unread = 0

    def take(self, opcode: int, content: bytes) -> None:
        """Take in a small record; the last of an id counts."""
        self._try(super().take, opcode, content)

    def declare(self, opcode: int, content: bytes) -> None:
        """Take in a schema or channel record; the last of an id counts."""
        self._try(super().declare, opcode, content)

    def _try(self, take: Callable[[int, bytes], None], opcode: int, content: bytes) -> None:
        try:
            take(opcode, content)
        except SessionFileError:
            self.unread += 1

    def _parsed(self, kind: Any, content: bytes) -> Any:
        record = super()._parsed(kind, content)
        if kind in self.raw:
            self.raw[kind][record.id] = record
        return record

    def bound(self, opcode: int, length: int) -> None:
        """Refuse a record that is too long to be held."""
        if opcode == Opcode.ATTACHMENT:
            self._bound(opcode, length, COPIED_ATTACHMENT_BYTES)
        elif opcode in DECLARING:
            self._bound(opcode, length, SMALL_RECORD_BYTES)


@dataclass
class FileScan:
    """What a damaged file holds."""

    declared: Declared  # schemas, channels, metadata, and all stretches of messages
    attachments: dict[str, Attachment] = field(default_factory=dict)  # those that are whole, by name
    checked: set[str] = field(default_factory=set)  # those whose checksum says so
    lost_attachments: list[str] = field(default_factory=list)
    # with messages; whether messages without sense stand among those of poses
    parts: list[tuple[Region, bool]] = field(default_factory=list)
    left_out: int = 0  # messages that are not what their schema says
    lost: list[LostChunk] = field(default_factory=list)
    bytes_skipped: int = 0
    closed: bool = False  # the record that ends the data is there
    names: tuple[str, ...] = ()
    frames: int = 0
    first_ns: int = 0
    last_ns: int = 0
    _channels: tuple[set[int], set[int]] | None = None
    _decoder: FrameDecoder | None = None

    def tables(self, stream: BinaryIO) -> Iterator[MessageTable]:
        """The messages that are kept, region by region."""
        for region, mixed in self.parts:
            table = read_chunk(stream, region, self.declared)
            if not isinstance(table, str):
                table = readable(table, self.declared)
                yield trusted(table, self.declared) if mixed else table

    def count(self, table: MessageTable) -> SessionFileError | None:
        """Count the frames of the next table; why a reader cannot read them, or ``None``."""
        channels = (self.declared.ids(TF), self.declared.ids(TRACKING))
        if self._decoder is None or channels != self._channels:
            self._channels, self._decoder = channels, FrameDecoder(self.declared, None)
        decoder = self._decoder.fork()
        try:
            stamps = [stamp for frames in decoder.decode(table) for stamp in frames.stamp_ns.tolist()]
        except SessionFileError as error:
            return error
        self._decoder = decoder
        if stamps:
            self.first_ns = min([*stamps, self.first_ns] if self.frames else stamps)
            self.last_ns = max([*stamps, self.last_ns])
        self.frames += len(stamps)
        self.names = tuple(dict.fromkeys([*self.names, *decoder.names]))
        return None


def scan_file(path: Path, stream: BinaryIO) -> FileScan:
    """Walk a file record by record, to its end or to the first one that is not whole; memory is one chunk and the whole
    attachments."""
    size = stream.seek(0, 2)
    declared = Declared(path, size)
    found, index_start = FileScan(declared), _index_start(stream)
    declaring: list[tuple[bool, int, bytes]] = []
    at = len(MAGIC)
    while True:
        stream.seek(at)
        head = stream.read(HEAD.size)
        opcode, length = HEAD.unpack(head) if len(head) == HEAD.size else (0, size)
        after = at + HEAD.size + length
        if opcode == Opcode.FOOTER and after <= size:
            break
        if after > size:
            found.bytes_skipped = size - at
            break
        found.closed |= opcode == Opcode.DATA_END
        try:
            declared.bound(opcode, length)
            if opcode == Opcode.ATTACHMENT:
                _attachment(stream.read(length), found)
            elif opcode in DECLARING:
                declaring.append((at >= index_start, opcode, stream.read(length)))
            else:
                declared.enter(stream, opcode, at, length)
        except SessionFileError as error:
            found.lost.append(LostChunk(at, 0, 0, None, "damaged" if "damaged" in str(error) else brief(error)))
        at = after
    # The copies in a checked index come last, because the last of an id counts.
    for _, opcode, content in sorted(declaring, key=lambda one: one[0]):
        declared.take(opcode, content)
    for region in declared.regions:
        _read_region(stream, found, region)
    return found


def _attachment(content: bytes, found: FileScan) -> None:
    read = read_attachment(content)
    if read is None:
        size = int.from_bytes(content[16:20], "little")
        found.lost_attachments.append(content[20 : 20 + min(size, 80)].decode("utf-8", errors="replace"))
        return
    attachment, checked = read
    found.attachments[attachment.name] = attachment
    if checked:
        found.checked.add(attachment.name)


def _read_region(stream: BinaryIO, found: FileScan, region: Region) -> None:
    """Keep a stretch of messages that can be read; any other is noted as lost."""
    table = read_chunk(stream, region, found.declared)
    why = table if isinstance(table, str) else ""
    if not isinstance(table, str):
        kept = readable(table, found.declared)
        error = found.count(kept)
        if mixed := error is not None and error.code == "bad-message":
            kept = trusted(kept, found.declared)
            error = found.count(kept) and error
        if error:
            why = f"unreadable ({brief(error)})"
        else:
            found.parts.append((region, mixed))
            found.left_out += len(table.channel) - len(kept.channel)
    if why:
        found.lost.append(LostChunk(region.offset, region.first_ns, region.last_ns, region.indexed, why))


def read_chunk(stream: BinaryIO, region: Region, catalogue: Catalogue) -> MessageTable | str:
    """The messages of a chunk, or why it cannot be trusted; its channels go to the catalogue."""
    try:
        table = read_region(stream, region, catalogue)
    except SessionFileError as error:
        return "damaged" if "is damaged" in str(error) else f"unreadable ({brief(error)})"
    return table if region.crc else trusted(table, catalogue)


def trusted(table: MessageTable, catalogue: Catalogue) -> MessageTable:
    """Messages without a checksum; poses and validity that are not what their schema says are left out."""
    rows = ((topic, row) for topic in POSES for row in table.of_channels(catalogue.ids(topic)).tolist())
    return _without(table, [row for topic, row in rows if parsed(topic, table.payload(row)) is None])


def readable(table: MessageTable, catalogue: Catalogue) -> MessageTable:
    """Messages but those, other than poses, that a reader of sessions refuses."""
    wrong = []
    for number in set(table.channel.tolist()) & catalogue.channels.keys():
        topic = catalogue.channels[number].topic
        for row in table.of_channels({number}).tolist() if is_part(topic) else ():
            try:
                read_part(catalogue.path, topic, [(int(table.publish_ns[row]), table.payload(row))])
            except SessionFileError:
                wrong.append(row)
    return _without(table, wrong)


def _without(table: MessageTable, rows: list[int]) -> MessageTable:
    return table.part(np.delete(np.arange(len(table.channel)), rows)) if rows else table


def parsed(topic: str, payload: bytes) -> Any:
    """A message of a topic of the profile, ``None`` when it is none or too long to be one."""
    try:
        return channel_spec(topic).message.FromString(payload) if len(payload) <= MESSAGE_BYTES else None
    except DecodeError:
        return None


def _index_start(stream: BinaryIO) -> int:
    """Where the index begins, if the file has one and it agrees with its checksum; else where the file ends."""
    size, footer = stream.seek(0, 2), read_footer(stream)
    if footer is None:
        return size
    foot, record, says = footer
    start = says.summary_start
    if not says.summary_crc or not len(MAGIC) <= start <= foot or foot - start > INDEX_LIMIT_BYTES:
        return size
    stream.seek(start)
    agrees = zlib.crc32(record[:-4], zlib.crc32(stream.read(foot - start))) == says.summary_crc
    return start if agrees else size
