"""One walk through a damaged file: what it declares, which messages can be trusted, what is lost. It writes nothing.

A chunk whose checksum agrees is whole. One whose checksum is wrong is not read at all, because nobody can say which of
its bytes changed. What follows a record that is not whole is lost: nothing is guessed among bytes without records.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from google.protobuf.message import DecodeError
from mcap.opcode import Opcode

from sessions.errors import SessionFileError
from sessions.mcap_format.catalogue import Catalogue, Region, read_catalogue
from sessions.mcap_format.pose_decoding import MESSAGE_BYTES, FrameDecoder
from sessions.mcap_format.reader import is_part, read_part
from sessions.mcap_format.refusals import brief
from sessions.mcap_format.schemas import TF, TRACKING, channel_spec
from sessions.mcap_format.unpacking import MessageTable, read_region
from sessions.recovery.lost import LostChunk

POSES = (TF, TRACKING)  # Topics whose messages are checked


@dataclass
class FileScan:
    """What a damaged file holds."""

    declared: Catalogue  # schemas, channels, metadata, and all stretches of messages
    # with messages; whether messages without sense may stand among those of poses
    parts: list[tuple[Region, bool]] = field(default_factory=list)
    left_out: int = 0  # messages that are not what their schema says
    lost: list[LostChunk] = field(default_factory=list)
    names: tuple[str, ...] = ()
    frames: int = 0
    first_ns: int = 0
    last_ns: int = 0
    _channels: tuple[set[int], set[int]] | None = None
    _decoder: FrameDecoder | None = None

    @property
    def closed(self) -> bool:
        """Whether its writer came to the end of the data."""
        return self.declared.closed

    @property
    def bytes_skipped(self) -> int:
        """Bytes behind the last whole record."""
        return 0 if self.declared.tear is None else self.declared.size - self.declared.tear

    def tables(self, stream: BinaryIO) -> Iterator[MessageTable]:
        """The messages that are kept, region by region."""
        for region, mixed in self.parts:
            table = readable(read_region(stream, region, self.declared), self.declared)
            yield trusted(table, self.declared) if mixed else table

    def keep(self, stream: BinaryIO, region: Region) -> None:
        """Keep a stretch of messages that can be read; any other is noted as lost."""
        try:
            table = read_region(stream, region, self.declared)
        except SessionFileError as error:
            self._lose(region, error)
            return
        sound = readable(table, self.declared)
        # Without a checksum any message may be none.
        mixed = not region.checked
        kept = trusted(sound, self.declared) if mixed else sound
        refusal = self._count(kept)
        if refusal and refusal.code == "bad-message" and not mixed:
            mixed, kept = True, trusted(sound, self.declared)
            refusal = refusal if self._count(kept) else None
        if refusal:
            self._lose(region, refusal)
        else:
            self.parts.append((region, mixed))
            self.left_out += len(table.channel) - len(kept.channel)

    def _lose(self, region: Region, error: SessionFileError) -> None:
        why = "damaged" if "is damaged" in str(error) else f"unreadable ({brief(error)})"
        self.lost.append(LostChunk(region.place.start, region.first_ns, region.last_ns, region.indexed, why))

    def _count(self, table: MessageTable) -> SessionFileError | None:
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
    """Walk a file record by record, to its end or to the first one that is not whole; memory is one record."""
    found = FileScan(read_catalogue(path, stream, strict=False))
    for fault in found.declared.faults:
        if fault.opcode in (Opcode.CHUNK, Opcode.MESSAGE):
            why = "damaged" if "is damaged" in str(fault.error) else brief(fault.error)
            found.lost.append(LostChunk(fault.start, 0, 0, None, why))
    for region in found.declared.regions:
        found.keep(stream, region)
    return found


def trusted(table: MessageTable, catalogue: Catalogue) -> MessageTable:
    """Messages but poses and validity that are not what their schema says."""
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
