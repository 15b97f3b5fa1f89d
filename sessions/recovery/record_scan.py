"""Finds the plausible records of a damaged MCAP file and skips the bytes between them.

The walk reads every byte at most a few times. It trusts a declared length only when the bytes at its end agree, so it
ends on every file, in time proportional to its size.

Source: MCAP specification, https://mcap.dev/spec.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import BinaryIO, Final

from mcap.opcode import Opcode

from sessions.mcap_format.catalogue import CHUNK_LIMIT_BYTES, DECLARING, SMALL_RECORD_BYTES, Region, chunk_region
from sessions.mcap_format.container import CHUNK_HEAD, HEAD, LENGTH_BEFORE_DATA, MAGIC

COMPRESSIONS: Final = ("zstd", "lz4", "")
COPIED_ATTACHMENT_BYTES: Final = 128 << 20  # A mesh larger than this is not copied: it would have 4 million faces

WINDOW_BYTES: Final = 1 << 20
FIXED_LENGTHS: Final = {Opcode.FOOTER: 20, Opcode.DATA_END: 4, Opcode.SUMMARY_OFFSET: 17}
INDEXING: Final = {Opcode.STATISTICS, Opcode.CHUNK_INDEX, Opcode.ATTACHMENT_INDEX, Opcode.METADATA_INDEX}
_LANDMARK: Final = re.compile(rb"(?=([\x05\x06\x07\x09][\x00-\xff]{5}\x00\x00\x00))")
"""Opcode of a message, chunk, message index or attachment, then a length below 2^40."""


@dataclass(frozen=True)
class Piece:
    """A record that makes sense, head included, or bytes that do not."""

    opcode: int  # 0: bytes between records
    start: int
    end: int
    region: Region | None = None  # of a chunk
    truncated: bool = False  # the file ends inside it

    @property
    def content(self) -> int:
        """Where what follows the head begins."""
        return self.start + HEAD.size


class RecordScan:
    """Walks a file, open for reading, from its magic to its end."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self._size = stream.seek(0, 2)

    def pieces(self) -> Iterator[Piece]:
        """Every record that makes sense, and the stretches between them as pieces with opcode 0."""
        at = len(MAGIC) if self._read(0, len(MAGIC)) == MAGIC else 0
        while at < self._size and self._read(at, len(MAGIC)) != MAGIC:
            piece = self._piece(at)
            if piece is None or piece.truncated:
                after = self._next_landmark(at + 1)
                # A chunk that seems truncated although a record follows it is noise.
                noise = piece is None or after < self._size
                piece = Piece(0, at, after) if piece is None or noise else replace(piece, end=after)
            yield piece
            at = piece.end

    def bytes_of(self, piece: Piece) -> bytes:
        """What follows a record's head."""
        return self._read(piece.content, piece.end - piece.content)

    def _read(self, at: int, count: int) -> bytes:
        if at > self._size:
            return b""
        self._stream.seek(at)
        return self._stream.read(count)

    def _head(self, at: int) -> tuple[int, int]:
        """Opcode and length of the record there; opcode 0 where the file ends before."""
        head = self._read(at, HEAD.size)
        return HEAD.unpack(head) if len(head) == HEAD.size else (0, self._size)

    def _piece(self, at: int) -> Piece | None:
        opcode, length = self._head(at)
        if opcode == Opcode.CHUNK:
            return self._chunk(at, length)
        end = at + HEAD.size + length
        fits = end <= self._size and self._makes_sense(opcode, at + HEAD.size, length)
        return Piece(opcode, at, end) if fits else None

    def _makes_sense(self, opcode: int, start: int, length: int) -> bool:
        if opcode in FIXED_LENGTHS:
            return length == FIXED_LENGTHS[Opcode(opcode)]
        if opcode == Opcode.MESSAGE:
            return LENGTH_BEFORE_DATA <= length <= CHUNK_LIMIT_BYTES
        if opcode == Opcode.MESSAGE_INDEX:
            entries = int.from_bytes(self._read(start + 2, 4), "little")
            return length == 6 + entries and entries % 16 == 0
        if opcode == Opcode.ATTACHMENT:
            return self._is_attachment(start, length)
        return opcode in DECLARING | INDEXING and length <= SMALL_RECORD_BYTES

    def _is_attachment(self, start: int, length: int) -> bool:
        """The lengths inside an attachment add up to its own."""
        at, end = start + 16, start + length
        for _ in range(2):
            at += 4 + int.from_bytes(self._read(at, 4), "little")
            if at + 8 > end:
                return False
        size = int.from_bytes(self._read(at, 8), "little")
        return length <= COPIED_ATTACHMENT_BYTES and at + 8 + size + 4 == end

    def _chunk(self, at: int, length: int) -> Piece | None:
        """A chunk is believed by its inner lengths; its record's own may be the byte that changed."""
        region = chunk_region(at, self._read(at + HEAD.size, CHUNK_HEAD.size + 12))
        if region is None or region.compression not in COMPRESSIONS or region.size > CHUNK_LIMIT_BYTES:
            return None
        end = region.offset + region.length
        if region.first_ns > region.last_ns or (end != at + HEAD.size + length and not self._is_followed(end)):
            return None
        region.length, region.truncated = min(region.length, self._size - region.offset), end > self._size
        return Piece(Opcode.CHUNK, at, end, region, region.truncated)

    def _is_followed(self, at: int) -> bool:
        opcode, length = self._head(at)
        return at + HEAD.size + length <= self._size and (
            opcode == Opcode.CHUNK or self._makes_sense(opcode, at + HEAD.size, length)
        )

    def _next_landmark(self, at: int) -> int:
        """The next record that is too regular to be chance, or the end of the file."""
        while at < self._size:
            window = self._read(at, WINDOW_BYTES + HEAD.size)
            for match in _LANDMARK.finditer(window):
                place = at + match.start()
                if match.start() < WINDOW_BYTES and self._is_landmark(place):
                    return place
            at += WINDOW_BYTES
        return self._size

    def _is_landmark(self, at: int) -> bool:
        """A record that makes sense and is followed by another, or by the end."""
        piece = self._piece(at)
        return piece is not None and (piece.truncated or piece.end == self._size or self._is_followed(piece.end))
