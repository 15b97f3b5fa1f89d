"""Reads every frame that can be read, and notes the data that the strict reader refuses."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sessions.errors import SessionFileError
from sessions.mcap_format.catalogue import Region
from sessions.mcap_format.mcap_file import McapFile
from sessions.mcap_format.metadata import MAX_BODIES
from sessions.mcap_format.pose_decoding import BodySamples, FrameDecoder
from sessions.mcap_format.unpacking import MessageTable, read_region
from sessions.model.frames import Frames


@dataclass
class Appearance:
    """How often, and from when to when (frame stamps), a body was given in a frame."""

    first_ns: int
    last_ns: int
    count: int = 0


@dataclass
class Noted:
    """What a strict reader would have refused.

    Parameters
    ----------
    frames : (parent, child) -> when it was met.
    doubled : bodies that one message holds twice, with how often; the first is kept.
    unpacked : regions whose bytes are damaged, and why.
    unread : regions whose messages are not what their schema says, and why.
    """

    frames: dict[tuple[str, str], Appearance] = field(default_factory=dict)
    doubled: Counter[str] = field(default_factory=Counter)
    unpacked: list[tuple[Region, SessionFileError]] = field(default_factory=list)
    unread: list[tuple[Region, SessionFileError]] = field(default_factory=list)


class TolerantFrames(FrameDecoder):
    """The readable frames of a file, chunk by chunk; ``noted`` fills while they are read.

    Bodies that ``names`` does not list become further columns where they appear.
    """

    def __init__(self, file: McapFile, names: tuple[str, ...]) -> None:
        super().__init__(file.catalogue, names)
        self.noted = Noted(doubled=self.doubled)

    def blocks(self) -> Iterator[Frames]:
        """All frames in file order; every region of the file is unpacked, also where it holds no poses."""
        with self._catalogue.path.open("rb") as stream:
            for region in self._catalogue.regions:
                try:
                    table = read_region(stream, region, self._catalogue)
                except SessionFileError as error:
                    self.noted.unpacked.append((region, error))
                    continue
                try:
                    yield from self.decode(table)
                except SessionFileError as error:
                    self.noted.unread.append((region, error))

    def _column(self, parent: str, name: str) -> int:
        del parent
        return self._columns.setdefault(name, len(self._columns))

    def _samples(self, table: MessageTable, rows: NDArray[np.int64], end: NDArray[np.int64]) -> list[BodySamples]:
        kept = super()._samples(table, rows, end)
        for part in kept:
            if part.child not in self._columns and len(self._columns) >= MAX_BODIES:
                raise self._refused(f"/tf holds more than {MAX_BODIES} bodies", "too-much")
            times = table.publish_ns[rows[part.rows]]
            first, last = int(times.min()), int(times.max())
            seen = self.noted.frames.setdefault((part.parent, part.child), Appearance(first, last))
            seen.first_ns, seen.last_ns = min(seen.first_ns, first), max(seen.last_ns, last)
            seen.count += len(part.rows)
        return kept
