import io
import zlib

import lz4.frame
import numpy as np
import pytest
import zstandard

from sessions.errors import SessionFileError
from sessions.mcap_format.catalogue import Catalogue, Region
from sessions.mcap_format.record_block import MESSAGE_HEADER, RecordBlock
from sessions.mcap_format.unpacking import read_region, rows_at

BLOCK = RecordBlock.of([(1, 7, 3, 4, b"hello"), (2, 8, 5, 6, b"")])
PACK = {"zstd": zstandard.compress, "lz4": lz4.frame.compress, "": bytes}


def unpacked(packed, compression, size=None, crc=None):
    size = len(BLOCK.data) if size is None else size
    crc = zlib.crc32(BLOCK.data) if crc is None else crc
    region = Region(0, len(packed), compression, size, crc, None)
    return read_region(io.BytesIO(packed), region, Catalogue("file"))


@pytest.mark.parametrize("compression", PACK)
def test_messages_are_listed_with_their_stamps_and_payloads(compression):
    table = unpacked(PACK[compression](BLOCK.data), compression)
    assert [table.payload(row) for row in range(2)] == [b"hello", b""]
    assert (table.channel.tolist(), table.sequence.tolist()) == ([1, 2], [7, 8])
    assert (table.log_ns.tolist(), table.publish_ns.tolist()) == ([3, 5], [4, 6])
    assert table.of_channels({2, 9}).tolist() == [1]


@pytest.mark.parametrize("compression", PACK)
def test_a_chunk_that_holds_more_or_less_than_it_declares_is_damaged(compression):
    for size in (0, 1, len(BLOCK.data) - 1, len(BLOCK.data) + 1):
        with pytest.raises(SessionFileError, match=r"damaged \(it declares"):
            unpacked(PACK[compression](BLOCK.data), compression, size)


def test_a_decompression_bomb_is_refused_without_being_unpacked():
    bomb = zstandard.compress(bytes(1 << 30), 1)
    assert len(bomb) < 1 << 20
    with pytest.raises(SessionFileError, match="its content 1073741824"):
        unpacked(bomb, "zstd")
    hidden = zstandard.ZstdCompressor(write_content_size=False).compress(bytes(100 << 20))
    with pytest.raises(SessionFileError, match="damaged"):
        unpacked(hidden, "zstd")
    with pytest.raises(SessionFileError, match="declares 58 bytes and holds 59"):
        unpacked(lz4.frame.compress(bytes(100 << 20), store_size=False), "lz4", 58)


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_noise_is_damaged_whatever_it_says(compression):
    rng = np.random.default_rng(0)
    for length in (0, 1, 4, 100):
        with pytest.raises(SessionFileError, match="damaged"):
            unpacked(rng.bytes(length), compression)


def test_a_wrong_checksum_an_unknown_compression_and_impossible_lengths_are_damage():
    with pytest.raises(SessionFileError, match="checksum is wrong"):
        unpacked(BLOCK.data, "", crc=1)
    with pytest.raises(SessionFileError, match="'br' is none of: zstd, lz4, none"):
        unpacked(BLOCK.data, "br")
    short = b"\x05" + (3).to_bytes(8, "little") + bytes(3)
    for data in (BLOCK.data[:-1], BLOCK.data + b"\x05", short):
        with pytest.raises(SessionFileError, match="impossible length"):
            unpacked(data, "", len(data), 0)
    late = MESSAGE_HEADER.pack(5, 22, 1, 0, 2**63, 0)
    with pytest.raises(SessionFileError, match="2262"):
        unpacked(late, "", len(late), 0)


def test_rows_are_copies_of_the_bytes_at_each_start():
    buffer = np.arange(10, dtype=np.uint8)
    assert rows_at(buffer, np.array([0, 7, 2]), 3).tolist() == [[0, 1, 2], [7, 8, 9], [2, 3, 4]]
    assert rows_at(buffer, np.array([], dtype=np.int64), 3).shape == (0, 3)


def test_small_regions_together_are_the_same_messages_in_the_same_order(monkeypatch):
    import sessions.mcap_format.unpacking as unpacking

    def table(first, count):
        block = RecordBlock.of((1 + k % 2, k, 10 * k, 5 * k, bytes([k]) * (k % 7)) for k in range(first, first + count))
        return unpacking.listed(block.data, Region(0, 0, "", 0, 0, None), Catalogue(None))

    monkeypatch.setattr(unpacking, "JOINED_BYTES", 400)
    tables = [table(0, 3), table(3, 9), table(12, 1), table(13, 20), table(33, 2)]
    joined = list(unpacking.together(tables))
    assert 1 < len(joined) < len(tables)

    def told(some):
        names = ("channel", "sequence", "log_ns", "publish_ns")
        return [
            (*(int(getattr(one, name)[row]) for name in names), one.payload(row))
            for one in some
            for row in range(len(one.channel))
        ]

    assert told(joined) == told(tables)
    assert [row[1] for row in told(joined)] == list(range(35))
