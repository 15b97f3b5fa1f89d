"""One MCAP file opened for reading: its messages by topic, its attachments, and its frames block by block."""

import io
import struct
import zlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Footer
from numpy.typing import NDArray

from sessions.mcap_format.catalogue import Region, read_catalogue
from sessions.mcap_format.container import HEAD, MAGIC
from sessions.mcap_format.pose_decoding import FrameDecoder
from sessions.mcap_format.refusals import refused
from sessions.mcap_format.schemas import PROFILE_FAMILY, TF, TRACKING
from sessions.mcap_format.unpacking import MessageTable, read_region, together
from sessions.model.frames import Frames

FOOTER_BYTES = HEAD.size + 20
LEAST_POSE_BYTES = 24  # Of a message: a body's name, a stamp and the heads of fields; zeros are left out


def read_attachment(content: bytes) -> tuple[Attachment, bool] | None:
    """An attachment record, and whether a checksum proves it right (0 means: none); ``None`` when it is damaged."""
    stream = io.BytesIO(content)
    try:
        found = Attachment.read(ReadDataStream(stream))
    except (McapError, struct.error, ValueError, OverflowError):
        return None
    stated = int.from_bytes(content[-4:], "little")
    if stream.tell() != len(content) or (stated and zlib.crc32(content[:-4]) != stated):
        return None
    return found, bool(stated)


def read_footer(stream: BinaryIO) -> tuple[int, bytes, Footer] | None:
    """Where the footer record begins, its bytes, and what it says; ``None`` where the file does not end in one."""
    place = stream.seek(0, io.SEEK_END) - len(MAGIC) - FOOTER_BYTES
    if place < len(MAGIC):
        return None
    stream.seek(place)
    record = stream.read(FOOTER_BYTES)
    if HEAD.unpack_from(record) != (Opcode.FOOTER, 20):
        return None
    return place, record, Footer.read(ReadDataStream(io.BytesIO(record[HEAD.size :])))


class McapFile:
    """A file whose records have been listed; it is closed between calls."""

    def __init__(self, path: Path) -> None:
        self.path, self.catalogue = path, read_catalogue(path)
        if self.catalogue.tear is not None and self.catalogue.regions:
            # The message index of the last whole chunk may be cut short, so what it lists may not be all.
            self.catalogue.regions[-1].channels = None
        # The regions that speak of channels which no record outside chunks has declared are unpacked now.
        with self.path.open("rb") as stream:
            for region in self.catalogue.regions:
                known = self.catalogue.channels.keys()
                if not known or (region.channels is not None and region.channels - known):
                    read_region(stream, region, self.catalogue)

    @property
    def own(self) -> bool:
        """Whether it is of our profile, of any version."""
        return self.catalogue.profile.startswith(PROFILE_FAMILY)

    def regions(self, *topics: str) -> list[Region]:
        """The regions that may hold messages of these topics, in file order."""
        ids = set[int]().union(*(self.catalogue.ids(topic) for topic in topics))
        wanted = [region for region in self.catalogue.regions if region.channels is None or region.channels & ids]
        return wanted if ids else []

    def read(self, regions: Iterable[Region]) -> Iterator[MessageTable]:
        """The messages of each region, which is unpacked when its turn comes."""
        with self.path.open("rb") as stream:
            for region in regions:
                yield read_region(stream, region, self.catalogue)

    def tables(self, *topics: str) -> Iterator[MessageTable]:
        """The regions that may hold messages of these topics, in file order; no other is unpacked."""
        return together(self.read(self.regions(*topics)))

    def payloads(self, topic: str) -> Iterator[tuple[int, bytes]]:
        """(publish_ns, payload) of every message of a topic, in file order."""
        for table in self.tables(topic):
            for row in table.of_channels(self.catalogue.ids(topic)).tolist():
                yield int(table.publish_ns[row]), table.payload(row)

    def topics_below(self, prefix: str) -> list[str]:
        """What follows the prefix in the topics that start with it, each once."""
        topics = [channel.topic for channel in self.catalogue.channels.values() if channel.topic.startswith(prefix)]
        return [topic.removeprefix(prefix) for topic in dict.fromkeys(topics)]

    def last_stamp(self) -> int | None:
        """The latest frame time of the last region that holds frames."""
        for table in self.read(self.regions(TF)[::-1]):
            rows = table.of_channels(self.catalogue.ids(TF))
            if len(rows):
                return int(table.publish_ns[rows].max())
        return None

    def attachment(self, name: str) -> bytes | None:
        """The bytes of an attachment, checked against its checksum; ``None`` when there is none of that name."""
        if name not in self.catalogue.attachments:
            return None
        offset, length = self.catalogue.attachments[name]
        with self.path.open("rb") as stream:
            stream.seek(offset)
            found = read_attachment(stream.read(length))
        if found is None:
            raise refused(self.path, "damaged-attachment", f"the attachment {name!r} is damaged")
        return bytes(found[0].data)


@dataclass(frozen=True, eq=False)
class McapFrames:
    """Frames of a file, one column per name; each block is decoded when it is asked for.

    ``window``: only frames whose stamps lie in it, ends included, are decoded; they are in ``kept``.
    """

    file: McapFile
    names: tuple[str, ...]
    window: tuple[int, int] | None = None
    kept: Sequence[Region] | None = None

    @property
    def poses_at_most(self) -> int:
        """More frames times bodies than are in the file, told without reading any."""
        return sum(region.size for region in self._regions()) // LEAST_POSE_BYTES

    def stamps(self) -> NDArray[np.int64]:
        """The stamps of all frames, (T,), in file order; nothing is decoded."""
        return np.concatenate([np.zeros(0, np.int64), *(part for _, part in self._stamps())])

    def between(self, low_ns: int, high_ns: int) -> "McapFrames":
        """The frames whose stamps lie between two, both included; the regions of others are not read again."""
        kept: list[Region] = []
        before: Region | None = None
        for region, stamps in self._stamps():
            if ((stamps >= low_ns) & (stamps <= high_ns)).any():
                # A note on the first frame of a region may stand at the end of the one before.
                if before is not None and kept[-1:] != [before]:
                    kept.append(before)
                kept.append(region)
            before = region
        return replace(self, window=(low_ns, high_ns), kept=tuple(kept))

    def _regions(self) -> Sequence[Region]:
        return self.file.regions(TF, TRACKING) if self.kept is None else self.kept

    def _stamps(self) -> Iterator[tuple[Region, NDArray[np.int64]]]:
        decoder, regions = FrameDecoder(self.file.catalogue, self.names), self._regions()
        for region, table in zip(regions, self.file.read(regions), strict=True):
            yield region, table.publish_ns[decoder.frame_rows(table)]

    def blocks(self, frames: int) -> Iterator[Frames]:
        """All frames in file order, in blocks of this many (the last may be shorter)."""
        held: list[Frames] = []
        decoder = FrameDecoder(self.file.catalogue, self.names, self.window)
        tables = together(self.file.read(self._regions()))
        for part in (part for table in tables for part in decoder.decode(table)):
            held.append(part)
            while sum(map(len, held)) >= frames:
                whole = Frames.join(held) if len(held) > 1 else held[0]
                yield whole.part(0, frames)
                held = [whole.part(frames, len(whole))] if len(whole) > frames else []
        if held:
            yield Frames.join(held)
