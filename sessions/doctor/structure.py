"""Findings about the file itself: a cut, changed bytes.

Source: MCAP specification, https://mcap.dev/spec.
"""

import zlib
from collections.abc import Iterator
from typing import Final

from mcap.opcode import Opcode

from sessions.doctor.finding import Finding, Severity
from sessions.errors import SessionFileError
from sessions.mcap_format.container import HEAD, MAGIC
from sessions.mcap_format.mcap_file import McapFile, read_footer

DATA_END_BYTES: Final = HEAD.size + 4
READ_BYTES: Final = 1 << 22


def structure_findings(file: McapFile) -> Iterator[Finding]:
    """Everything about the container that needs no message."""
    catalogue = file.catalogue
    if catalogue.tear is not None:
        size = catalogue.path.stat().st_size
        message = f"it ends or breaks off at byte {catalogue.tear} of {size}, without an index"
        yield Finding("torn", Severity.ERROR, message, count=size - catalogue.tear)
    else:
        yield from _data_checksum(file)
    for name in catalogue.attachments:
        try:
            file.attachment(name)
        except SessionFileError:
            yield Finding("damaged-attachment", Severity.ERROR, f"attachment {name!r} fails its checksum", body=name)


def _data_checksum(file: McapFile) -> Iterator[Finding]:
    """The checksum over everything before the record that ends the data."""
    with file.path.open("rb") as stream:
        footer = read_footer(stream)
        if footer is None:
            return
        foot, _, says = footer
        start = (says.summary_start or foot) - DATA_END_BYTES
        if not len(MAGIC) <= start <= foot:
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
