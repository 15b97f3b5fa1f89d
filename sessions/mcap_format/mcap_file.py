"""One MCAP file opened for reading: its messages by topic, its attachments, and its frames block by block."""

import io
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Footer

from sessions.mcap_format.catalogue import read_catalogue
from sessions.mcap_format.container import HEAD, MAGIC
from sessions.mcap_format.pose_decoding import FrameDecoder
from sessions.mcap_format.refusals import refused
from sessions.mcap_format.schemas import PROFILE_FAMILY, TF, TRACKING
from sessions.mcap_format.unpacking import MessageTable, read_region, together
from sessions.model.frames import Frames

FOOTER_BYTES = HEAD.size + 20


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

    def tables(self, *topics: str, backwards: bool = False) -> Iterator[MessageTable]:
        """The regions that may hold messages of these topics, in file order; no other is unpacked."""
        ids = set[int]().union(*(self.catalogue.ids(topic) for topic in topics))
        regions = self.catalogue.regions[::-1] if backwards else self.catalogue.regions
        wanted = [region for region in regions if region.channels is None or region.channels & ids]
        if not ids or not wanted:
            return
        with self.path.open("rb") as stream:
            read = (read_region(stream, region, self.catalogue) for region in wanted)
            yield from read if backwards else together(read)

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
        for table in self.tables(TF, backwards=True):
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
    """Frames of a file, one column per name; each block is decoded when it is asked for."""

    file: McapFile
    names: tuple[str, ...]

    def blocks(self, frames: int) -> Iterator[Frames]:
        """All frames in file order, in blocks of this many (the last may be shorter)."""
        held: list[Frames] = []
        decoder = FrameDecoder(self.file.catalogue, self.names)
        for part in (part for table in self.file.tables(TF, TRACKING) for part in decoder.decode(table)):
            held.append(part)
            while sum(map(len, held)) >= frames:
                whole = Frames.join(held) if len(held) > 1 else held[0]
                yield whole.part(0, frames)
                held = [whole.part(frames, len(whole))] if len(whole) > frames else []
        if held:
            yield Frames.join(held)
