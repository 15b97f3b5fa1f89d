"""One MCAP file opened for reading: its messages by topic, its attachments, and its frames block by block."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcap.records import Attachment

from sessions.errors import SessionFileError
from sessions.input_files import opened
from sessions.mcap.catalogue import Region, read_catalogue
from sessions.mcap.container import bytes_at, parsed
from sessions.mcap.pose_decoding import FrameDecoder
from sessions.mcap.schemas import PROFILE_FAMILY, TF, TRACKING
from sessions.mcap.unpacking import MessageTable, read_region, together
from sessions.model.frames import Frames

LEAST_POSE_BYTES = 24  # Of a message: a body's name, a stamp and the heads of fields; zeros are left out


class McapFile:
    """A file whose records have been listed; it is closed between calls.

    ``refused``: what was wrong with parts of a file that is not read strictly, and the body that each was of.
    """

    def __init__(self, path: Path, *, strict: bool = True) -> None:
        self.path = path
        self.refused: list[tuple[SessionFileError, str]] = []
        with opened(path, "session file", SessionFileError) as stream:
            self.catalogue = read_catalogue(path, stream, strict=strict)
        # The regions that speak of channels which no record outside chunks has declared are unpacked now.
        with self.path.open("rb") as stream:
            for region in self.catalogue.regions:
                known = self.catalogue.channels.keys()
                if not known or (region.channels is not None and region.channels - known):
                    with nullcontext() if strict else suppress(SessionFileError):
                        read_region(stream, region, self.catalogue)

    @property
    def own(self) -> bool:
        """Whether it is of our profile, of any version."""
        return self.catalogue.profile.startswith(PROFILE_FAMILY)

    def attempt(self, load: Callable[[], Any], otherwise: Any, body: str = "") -> Any:
        """Load a part; a strict reader refuses the file for it, any other notes why and takes ``otherwise``."""
        try:
            return load()
        except SessionFileError as error:
            if self.catalogue.strict:
                raise
            # Damaged attachments are among the faults of the catalogue already.
            if error.code != "damaged-attachment":
                self.refused.append((error, body))
            return otherwise

    def regions(self, *topics: str) -> list[Region]:
        """The regions that may hold messages of these topics, in file order."""
        ids = set[int]().union(*(self.catalogue.ids(topic) for topic in topics))
        # An index that leaves messages out would lose them: only a whole one says where nothing is.
        chunks = [
            region
            for region in self.catalogue.regions
            if region.channels is None or region.channels & ids or not self.catalogue.index_is_whole
        ]
        return chunks if ids else []

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
        """The topics that start with a prefix, without it, each once."""
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
        """The bytes of an attachment, ``None`` when there is none of that name; an error: it is damaged."""
        damaged = [fault.error for fault in self.catalogue.faults if name and fault.name == name]
        if damaged:
            raise damaged[0]
        if name not in self.catalogue.attachments:
            return None
        with self.path.open("rb") as stream:
            record = parsed(bytes_at(stream, self.catalogue.attachments[name]))
        assert isinstance(record, Attachment)
        return bytes(record.data)


@dataclass(frozen=True, eq=False)
class McapFrames:
    """Frames of a file, one column per name; each block is decoded when it is asked for."""

    file: McapFile
    names: tuple[str, ...]

    @property
    def poses_at_most(self) -> int:
        """More frames times bodies than are in the file, told without reading any."""
        return sum(region.size for region in self.file.regions(TF, TRACKING)) // LEAST_POSE_BYTES

    def blocks(self, frames: int) -> Iterator[Frames]:
        """All frames in file order, in blocks of this many (the last may be shorter)."""
        pending: list[Frames] = []
        decoder = FrameDecoder(self.file.catalogue, self.names)
        for block in (block for table in self.file.tables(TF, TRACKING) for block in decoder.decode(table)):
            pending.append(block)
            while sum(map(len, pending)) >= frames:
                whole = Frames.join(pending) if len(pending) > 1 else pending[0]
                yield whole.part(0, frames)
                pending = [whole.part(frames, len(whole))] if len(whole) > frames else []
        if pending:
            yield Frames.join(pending)
