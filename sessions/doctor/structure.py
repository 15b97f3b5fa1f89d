"""Findings about the container itself: a cut, a wrong index, changed bytes, chunks out of order.

Source: MCAP specification, https://mcap.dev/spec.
"""

import zlib
from collections.abc import Iterator
from typing import BinaryIO, Final

from mcap.opcode import Opcode

from sessions.doctor.finding import Finding, Severity
from sessions.errors import SessionFileError
from sessions.mcap_format.catalogue import Region
from sessions.mcap_format.container import HEAD, MAGIC
from sessions.mcap_format.mcap_file import McapFile, read_footer
from sessions.mcap_format.schemas import TF

DATA_END_BYTES: Final = HEAD.size + 4
SUMMARY_LIMIT_BYTES: Final = 256 << 20  # An index of more than this is not read: 4 million chunks
READ_BYTES: Final = 1 << 22


def structure_findings(file: McapFile) -> Iterator[Finding]:
    """Everything about the container that needs no message."""
    catalogue = file.catalogue
    chunks = [region for region in catalogue.regions if region.start]
    if catalogue.tear is not None:
        size = catalogue.path.stat().st_size
        message = f"it ends or breaks off at byte {catalogue.tear} of {size}, without an index"
        yield Finding("torn", Severity.ERROR, message, count=size - catalogue.tear)
    else:
        with catalogue.path.open("rb") as stream:
            yield from _index(stream, chunks)
    yield from _chunk_order(file, chunks)
    for name in catalogue.attachments:
        try:
            file.attachment(name)
        except SessionFileError:
            yield Finding("damaged-attachment", Severity.ERROR, f"attachment {name!r} fails its checksum", body=name)


def _chunk_order(file: McapFile, chunks: list[Region]) -> Iterator[Finding]:
    ids = file.catalogue.ids(TF)
    poses = [one for one in chunks if one.channels is None or one.channels & ids]
    late = [i for i in range(1, len(poses)) if poses[i].first_ns < poses[i - 1].first_ns]
    if late:
        message = f"{len(late)} of {len(poses)} chunks with poses begin before the chunk in front of them"
        yield Finding("unordered-chunks", Severity.WARNING, message, count=len(late))


def _index(stream: BinaryIO, chunks: list[Region]) -> Iterator[Finding]:
    footer = read_footer(stream)
    if footer is None:
        yield Finding("index-wrong", Severity.WARNING, "its footer is not where a footer belongs")
        return
    foot, record, says = footer
    summary = says.summary_start
    inside = len(MAGIC) <= (summary or foot) <= foot and says.summary_offset_start <= foot
    if inside:
        yield from _data_checksum(stream, summary or foot)
    if not summary:
        if chunks:
            yield Finding("index-missing", Severity.NOTE, f"no index of its {len(chunks)} chunks", count=len(chunks))
        return
    if not inside or foot - summary > SUMMARY_LIMIT_BYTES:
        message = f"its footer puts the index at byte {summary} of {foot + len(record) + len(MAGIC)}"
        yield Finding("index-wrong", Severity.WARNING, message)
        return
    stream.seek(summary)
    index = stream.read(foot - summary)
    if says.summary_crc and zlib.crc32(record[:-4], zlib.crc32(index)) != says.summary_crc:
        yield Finding("index-wrong", Severity.WARNING, "its index fails its checksum", count=len(index))
    listed, there = set(_indexed_chunks(index)), {chunk.start for chunk in chunks}
    if listed != there:
        message = (
            f"its index lists {len(listed & there)} of {len(there)} chunks and {len(listed - there)} that are not there"
        )
        yield Finding("index-wrong", Severity.WARNING, message, count=len(listed ^ there))


def _indexed_chunks(index: bytes) -> Iterator[int]:
    """Starts of the chunks that the index lists."""
    at = 0
    while at + HEAD.size <= len(index):
        opcode, length = HEAD.unpack_from(index, at)
        if opcode == Opcode.CHUNK_INDEX and at + HEAD.size + 24 <= len(index):
            yield int.from_bytes(index[at + HEAD.size + 16 : at + HEAD.size + 24], "little")
        at += HEAD.size + length


def _data_checksum(stream: BinaryIO, end: int) -> Iterator[Finding]:
    """The checksum over everything before the record that ends the data."""
    start = end - DATA_END_BYTES
    if start < len(MAGIC):
        return
    stream.seek(start)
    record = stream.read(DATA_END_BYTES)
    stated = int.from_bytes(record[HEAD.size :], "little")
    if record[:1] != bytes([Opcode.DATA_END]) or not stated:
        return
    crc = 0
    stream.seek(0)
    for size in [READ_BYTES] * (start // READ_BYTES) + [start % READ_BYTES]:
        crc = zlib.crc32(stream.read(size), crc)
    if crc != stated:
        yield Finding("data-crc", Severity.ERROR, f"the first {start} bytes fail the checksum of the file", count=start)
