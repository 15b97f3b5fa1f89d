"""Records of a damaged MCAP file: those that make sense, and past the bytes that do not to the next that does.

The walk looks at every byte at most a few times and believes no length before what lies there agrees with it, so it
ends on every file, in time proportional to its size.

Source: MCAP specification, https://mcap.dev/spec.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO, Final

from mcap.opcode import Opcode

from sessions.mcap_format.catalogue import CHUNK_LIMIT_BYTES, SMALL_RECORD_BYTES, Region
from sessions.mcap_format.container import MAGIC
from sessions.mcap_format.record_block import LENGTH_BEFORE_DATA

HEAD: Final = struct.Struct("<BQ")
CHUNK_HEAD: Final = struct.Struct("<QQQII")
COMPRESSIONS: Final = (b"zstd", b"lz4", b"")
ATTACHMENT_LIMIT_BYTES: Final = 128 << 20
"""A mesh larger than this is not copied: it would have 4 million faces."""

WINDOW_BYTES: Final = 1 << 20
FIXED_LENGTHS: Final = {Opcode.FOOTER: 20, Opcode.DATA_END: 4, Opcode.SUMMARY_OFFSET: 17}
SMALL: Final = {
    Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.METADATA, Opcode.STATISTICS, Opcode.CHUNK_INDEX,
    Opcode.ATTACHMENT_INDEX, Opcode.METADATA_INDEX,
}  # fmt: skip
_LANDMARK: Final = re.compile(rb"(?=([\x05\x06\x07\x09][\x00-\xff]{5}\x00\x00\x00))")
"""Opcode of a message, chunk, message index or attachment, then a length below 2^40."""


@dataclass(frozen=True)
class Piece:
    """A record that makes sense where it lies.

    Parameters
    ----------
    opcode : what it is; 0 for bytes that are no record.
    start, end : its bytes in the file, head included.
    region : for a chunk, where its data lies.
    first_ns, last_ns : for a chunk, the log times that it declares.
    torn : the file ends inside it.
    """

    opcode: int
    start: int
    end: int
    region: Region | None = None
    first_ns: int = 0
    last_ns: int = 0
    torn: bool = False

    @property
    def content(self) -> int:
        """Where what follows the head begins."""
        return self.start + HEAD.size


class RecordScan:
    """Walks a file from its magic to its end.

    Parameters
    ----------
    stream : open for reading.
    """

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self._size = stream.seek(0, 2)

    def pieces(self) -> Iterator[Piece]:
        """Every record that makes sense, and the stretches between them as pieces with opcode 0."""
        at = len(MAGIC) if self._read(0, len(MAGIC)) == MAGIC else 0
        while at < self._size and self._read(at, len(MAGIC)) != MAGIC:
            piece = self._piece(at)
            if piece is None or piece.torn:
                after = self._next_landmark(at + 1)
                yield (
                    Piece(piece.opcode, at, after, piece.region, piece.first_ns, piece.last_ns, True)
                    if (piece is not None and after == self._size)
                    else Piece(0, at, after)
                )
                at = after
            else:
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

    def _piece(self, at: int) -> Piece | None:
        head = self._read(at, HEAD.size)
        if len(head) < HEAD.size:
            return None
        opcode, length = HEAD.unpack(head)
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
        return opcode in SMALL and length <= SMALL_RECORD_BYTES

    def _is_attachment(self, start: int, length: int) -> bool:
        """The lengths inside an attachment add up to its own."""
        at, end = start + 16, start + length
        for _ in range(2):
            at += 4 + int.from_bytes(self._read(at, 4), "little")
            if at + 8 > end:
                return False
        size = int.from_bytes(self._read(at, 8), "little")
        return length <= ATTACHMENT_LIMIT_BYTES and at + 8 + size + 4 == end

    def _chunk(self, at: int, length: int) -> Piece | None:
        """A chunk is believed by its inner lengths; its record's own may be the byte that changed."""
        start = at + HEAD.size
        head = self._read(start, CHUNK_HEAD.size + 12)
        if len(head) < CHUNK_HEAD.size + 8:
            return None
        first, last, size, crc, name_length = CHUNK_HEAD.unpack_from(head)
        name = head[CHUNK_HEAD.size : CHUNK_HEAD.size + name_length] if name_length <= 4 else None
        if name not in COMPRESSIONS or size > CHUNK_LIMIT_BYTES or first > last:
            return None
        packed = int.from_bytes(head[CHUNK_HEAD.size + name_length :][:8], "little")
        offset = start + CHUNK_HEAD.size + name_length + 8
        inner = CHUNK_HEAD.size + name_length + 8 + packed
        if inner != length and not self._is_followed(start + inner):
            return None
        torn = offset + packed > self._size
        region = Region(offset, min(packed, self._size - offset), name.decode(), size, crc, None)
        return Piece(Opcode.CHUNK, at, start + inner, region, first, last, torn)

    def _is_followed(self, at: int) -> bool:
        head = self._read(at, HEAD.size)
        if len(head) < HEAD.size:
            return False
        opcode, length = HEAD.unpack(head)
        return at + HEAD.size + length <= self._size and (
            opcode == Opcode.CHUNK or self._makes_sense(opcode, at + HEAD.size, length)
        )

    def _next_landmark(self, at: int) -> int:
        """The next record that can be told from chance, or the end of the file."""
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
        if piece is None:
            return False
        return piece.torn or piece.end == self._size or self._is_followed(piece.end)
