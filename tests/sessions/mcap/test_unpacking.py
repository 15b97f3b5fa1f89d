import io
import zlib

import lz4.frame
import numpy as np
import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Chunk
from support.session_files import packed

from sessions.errors import SessionFileError
from sessions.mcap.container import MESSAGE_HEADER, Catalogue, RecordSpan, Region
from sessions.mcap.unpacking import read_region, rows_at, together

TWO_MESSAGES = packed((1, 7, 3, 4, b"hello")) + packed((2, 8, 5, 6, b""))
COMPRESS = {"zstd": zstandard.compress, "lz4": lz4.frame.compress, "": bytes}


def unpacked_chunk(given, compression, size=None, crc=None, before=0):
    """The table of messages in a chunk of these bytes that states a size and a checksum, by default the right ones.

    ``before``: messages of the file that were read before.
    """
    size = len(TWO_MESSAGES) if size is None else size
    crc = zlib.crc32(TWO_MESSAGES) if crc is None else crc
    builder = RecordBuilder()
    Chunk(compression, given, 0, 0, crc, size).write(builder)
    record = builder.end()
    region = Region(RecordSpan(Opcode.CHUNK, 0, len(record)), size, channels=None)
    return read_region(io.BytesIO(record), region, Catalogue("file", messages=before))


@pytest.mark.parametrize("compression", COMPRESS)
def test_messages_are_listed_with_their_stamps_and_payloads(compression):
    """A chunk has two messages: (channel, sequence, log time, publish time, payload) of TWO_MESSAGES.

    Only row 1 is of channel 2; no row is of channel 9.
    """
    table = unpacked_chunk(COMPRESS[compression](TWO_MESSAGES), compression)
    assert [table.payload(row) for row in range(2)] == [b"hello", b""]
    assert table.channel.tolist() == [1, 2]
    assert table.sequence.tolist() == [7, 8]
    assert table.log_ns.tolist() == [3, 5]
    assert table.publish_ns.tolist() == [4, 6]
    assert table.of_channels({2, 9}).tolist() == [1]


def test_empty_chunk_has_no_messages():
    """The chunk has no bytes, and states so; the checksum 0 means none."""
    assert unpacked_chunk(b"", "", size=0, crc=0).channel.tolist() == []


def test_small_tables_are_joined(monkeypatch):
    """Five tables have two messages each, and two of them fit into one."""
    monkeypatch.setattr("sessions.mcap.unpacking.JOINED_BYTES", 2 * len(TWO_MESSAGES))
    tables = [*together([unpacked_chunk(TWO_MESSAGES, "")] * 5)]
    assert [table.channel.tolist() for table in tables] == [[1, 2, 1, 2], [1, 2, 1, 2], [1, 2]]
    first_message_of_second_chunk = 2
    assert tables[0].payload(first_message_of_second_chunk) == b"hello"


def test_rows_beyond_the_end_of_the_bytes_are_not_read():
    """A row of two bytes would begin at the last of five."""
    with pytest.raises(IndexError, match="index 4 is out of bounds"):
        rows_at(np.zeros(5, np.uint8), np.array([4]), 2)


@pytest.mark.parametrize("compression", COMPRESS)
@pytest.mark.parametrize("size", [0, 1, len(TWO_MESSAGES) - 1, len(TWO_MESSAGES) + 1])
def test_chunk_of_undeclared_size_is_damaged(compression, size):
    """A chunk of two messages states another size than they have."""
    with pytest.raises(SessionFileError, match=r"damaged \(it declares"):
        unpacked_chunk(COMPRESS[compression](TWO_MESSAGES), compression, size)


@pytest.mark.slow
def test_a_decompression_bomb_is_refused_without_being_unpacked():
    """1 GiB of zeros compresses to less than 1 MiB: its chunk, which states the few bytes of two messages, is refused.

    So are 100 MiB that zstd states no size of, and 100 MiB by LZ4 in a chunk that states 58 bytes: it is unpacked up to
    59, one too many.
    """
    bomb = zstandard.compress(bytes(1 << 30), 1)
    assert len(bomb) < 1 << 20
    with pytest.raises(SessionFileError, match="its content 1073741824"):
        unpacked_chunk(bomb, "zstd")
    hidden = zstandard.ZstdCompressor(write_content_size=False).compress(bytes(100 << 20))
    with pytest.raises(SessionFileError, match="damaged"):
        unpacked_chunk(hidden, "zstd")
    with pytest.raises(SessionFileError, match="declares 58 bytes and holds 59"):
        unpacked_chunk(lz4.frame.compress(bytes(100 << 20), store_size=False), "lz4", size=58)


def test_bad_checksum_compression_or_length_is_damage():
    """A chunk has a wrong checksum, an unknown compression, or a stamp of 2**63 ns, after the year 2262.

    Or its records are cut short by a byte, followed by a stray one, or shorter than a header.
    """
    with pytest.raises(SessionFileError, match="checksum is wrong"):
        unpacked_chunk(TWO_MESSAGES, "", crc=1)
    with pytest.raises(SessionFileError, match="'br' is unknown; known: zstd, lz4, none"):
        unpacked_chunk(TWO_MESSAGES, "br")
    short = b"\x05" + (3).to_bytes(8, "little") + bytes(3)
    for data in (TWO_MESSAGES[:-1], TWO_MESSAGES + b"\x05", short):
        with pytest.raises(SessionFileError, match="impossible length"):
            unpacked_chunk(data, "", len(data), crc=0)
    late = MESSAGE_HEADER.pack(5, 22, 1, 0, 2**63, 0)
    with pytest.raises(SessionFileError, match="2262"):
        unpacked_chunk(late, "", len(late), crc=0)


def test_total_messages_are_limited_by_file_size():
    """A small file may have 100,000 messages; two stand in a chunk behind 99,998 or 99,999 others."""
    assert unpacked_chunk(TWO_MESSAGES, "", before=99_998).channel.tolist() == [1, 2]
    with pytest.raises(SessionFileError, match="more than 100,000 messages"):
        unpacked_chunk(TWO_MESSAGES, "", before=99_999)
