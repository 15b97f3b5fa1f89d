"""What is wrong with the container itself: a tear, an index that lies, bytes that changed, chunks out of order.

Everything here is a list of places in the file as well as findings, so that whoever saves what is left can use it.
Source: MCAP specification, https://mcap.dev/spec.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final

from mcap.opcode import Opcode

from sessions.doctor.finding import Finding, Severity
from sessions.errors import SessionFileError
from sessions.mcap_format.catalogue import Catalogue, Region
from sessions.mcap_format.container import MAGIC
from sessions.mcap_format.mcap_file import McapFile
from sessions.mcap_format.schemas import TF

_HEAD: Final = struct.Struct("<BQ")
_FOOTER: Final = struct.Struct("<BQQQI")
_CHUNK_BEFORE_NAME: Final = struct.Struct("<QQQII")
DATA_END_BYTES: Final = _HEAD.size + 4
SUMMARY_LIMIT_BYTES: Final = 256 << 20
"""An index of more than this is not read: 4 million chunks."""
READ_BYTES: Final = 1 << 22


@dataclass(frozen=True)
class ChunkPlace:
    """A chunk's record and the log times that it declares.

    Parameters
    ----------
    start : first byte of the chunk record.
    region : its data.
    first_ns, last_ns : declared least and greatest log time.
    """

    start: int
    region: Region
    first_ns: int
    last_ns: int


def chunk_places(catalogue: Catalogue) -> list[ChunkPlace]:
    """Where the chunks are and when they say that they were written; runs of loose messages are left out."""
    places = []
    with catalogue.path.open("rb") as stream:
        for region in catalogue.regions:
            name = len(region.compression.encode())
            start = region.offset - 8 - name - _CHUNK_BEFORE_NAME.size - _HEAD.size
            stream.seek(max(0, start))
            head = stream.read(_HEAD.size + _CHUNK_BEFORE_NAME.size)
            if start < 0 or len(head) < _HEAD.size + _CHUNK_BEFORE_NAME.size or head[0] != Opcode.CHUNK:
                continue
            first, last, _, crc, length = _CHUNK_BEFORE_NAME.unpack_from(head, _HEAD.size)
            if (crc, length) == (region.crc, name):
                places.append(ChunkPlace(start, region, first, last))
    return places


def structure_findings(file: McapFile) -> Iterator[Finding]:
    """Everything about the container that needs no message."""
    catalogue = file.catalogue
    places = chunk_places(catalogue)
    if catalogue.tear is not None:
        size = catalogue.path.stat().st_size
        message = f"it ends or breaks off at byte {catalogue.tear} of {size}, without an index"
        yield Finding("torn", Severity.ERROR, message, count=size - catalogue.tear)
    else:
        with catalogue.path.open("rb") as stream:
            yield from _index(stream, places)
    yield from _chunk_order(file, places)
    for name in catalogue.attachments:
        try:
            file.attachment(name)
        except SessionFileError:
            yield Finding("damaged-attachment", Severity.ERROR, f"attachment {name!r} fails its checksum", body=name)


def _chunk_order(file: McapFile, places: list[ChunkPlace]) -> Iterator[Finding]:
    ids = file.catalogue.ids(TF)
    poses = [one for one in places if one.region.channels is None or one.region.channels & ids]
    late = [i for i in range(1, len(poses)) if poses[i].first_ns < poses[i - 1].first_ns]
    if late:
        message = f"{len(late)} of {len(poses)} chunks with poses begin before the chunk in front of them"
        yield Finding("unordered-chunks", Severity.WARNING, message, count=len(late))


def _index(stream: BinaryIO, places: list[ChunkPlace]) -> Iterator[Finding]:
    end = stream.seek(0, 2)
    foot = end - len(MAGIC) - _FOOTER.size
    stream.seek(max(0, foot))
    content = stream.read(_FOOTER.size)
    if len(content) < _FOOTER.size or content[0] != Opcode.FOOTER:
        yield Finding("index-wrong", Severity.WARNING, "its footer is not where a footer belongs")
        return
    _, _, summary, offsets, crc = _FOOTER.unpack(content)
    yield from _data_checksum(stream, summary or foot)
    if not summary:
        if places:
            yield Finding("index-missing", Severity.NOTE, f"no index of its {len(places)} chunks", count=len(places))
        return
    if (
        not len(MAGIC) <= summary <= foot
        or foot - summary > SUMMARY_LIMIT_BYTES
        or not (not offsets or offsets <= foot)
    ):
        message = f"its footer puts the index at byte {summary} of {end}"
        yield Finding("index-wrong", Severity.WARNING, message)
        return
    stream.seek(summary)
    index = stream.read(foot - summary)
    if crc and zlib.crc32(content[:-4], zlib.crc32(index)) != crc:
        yield Finding("index-wrong", Severity.WARNING, "its index fails its checksum", count=len(index))
    listed = set(_indexed_chunks(index))
    there = {place.start for place in places}
    if listed != there:
        message = (
            f"its index lists {len(listed & there)} of {len(there)} chunks and {len(listed - there)} that are not there"
        )
        yield Finding("index-wrong", Severity.WARNING, message, count=len(listed ^ there))


def _indexed_chunks(index: bytes) -> Iterator[int]:
    """Starts of the chunks that the index lists."""
    at = 0
    while at + _HEAD.size <= len(index):
        opcode, length = _HEAD.unpack_from(index, at)
        if opcode == Opcode.CHUNK_INDEX and at + _HEAD.size + 24 <= len(index):
            yield int.from_bytes(index[at + _HEAD.size + 16 : at + _HEAD.size + 24], "little")
        at += _HEAD.size + length


def _data_checksum(stream: BinaryIO, end: int) -> Iterator[Finding]:
    """The checksum over everything before the record that ends the data."""
    start = end - DATA_END_BYTES
    if start < len(MAGIC):
        return
    stream.seek(start)
    record = stream.read(DATA_END_BYTES)
    stated = int.from_bytes(record[_HEAD.size :], "little")
    if record[:1] != bytes([Opcode.DATA_END]) or not stated:
        return
    crc, left = 0, start
    stream.seek(0)
    while left > 0:
        part = stream.read(min(READ_BYTES, left))
        if not part:
            return
        crc, left = zlib.crc32(part, crc), left - len(part)
    if crc != stated:
        yield Finding("data-crc", Severity.ERROR, f"the first {start} bytes fail the checksum of the file", count=start)


def is_mcap(path: Path) -> bool:
    """Whether a file begins as an MCAP does."""
    with path.open("rb") as stream:
        return stream.read(len(MAGIC)) == MAGIC
