import io
import zlib

import lz4.frame
import numpy as np
import pytest
import zstandard
from support.mcap_samples import protobuf_messages, random_frames

from sessions.mcap_format.catalogue import Catalogue, ChannelInfo, Region
from sessions.mcap_format.record_block import RecordBlock
from sessions.recovery.chunk_reading import read_chunk, unpacked_start

PACK = {
    "zstd": lambda data: zstandard.ZstdCompressor().compress(data),
    "lz4": lz4.frame.compress,
    "": lambda data: data,
}


@pytest.fixture(scope="module")
def block():
    messages = protobuf_messages(random_frames(1, 3000, 3))
    return RecordBlock.of((1, k, log, publish, payload) for k, (publish, log, payload) in enumerate(messages))


def catalogue():
    found = Catalogue(None)
    found.channels[1] = ChannelInfo("/tf", "protobuf", "foxglove.FrameTransforms")
    return found


def region(packed, block, name, crc=None):
    return Region(0, len(packed), name, len(block.data), zlib.crc32(block.data) if crc is None else crc, None)


@pytest.mark.parametrize("name", PACK)
def test_a_whole_chunk_gives_every_message(block, name):
    packed = PACK[name](block.data)
    table = read_chunk(io.BytesIO(packed), region(packed, block, name), catalogue(), truncated=False)
    assert len(table.channel) == 3000


@pytest.mark.parametrize("name", PACK)
def test_a_truncated_chunk_gives_the_messages_before_the_cut_and_they_are_right(block, name):
    packed = PACK[name](block.data)[: len(PACK[name](block.data)) * 2 // 3]
    table = read_chunk(io.BytesIO(packed), region(packed, block, name), catalogue(), truncated=True)
    count = len(table.channel)
    assert 300 < count < 3000
    assert [table.payload(k) for k in range(count)] == [
        block.data[block.starts[k] + 31 : block.starts[k + 1]] for k in range(count)
    ]


def test_a_chunk_with_a_wrong_checksum_gives_nothing(block):
    packed = PACK[""](block.data)
    changed = bytearray(packed)
    changed[5000] ^= 1
    assert read_chunk(io.BytesIO(bytes(changed)), region(changed, block, ""), catalogue(), truncated=False) is None


def test_without_a_checksum_poses_that_are_none_are_left_out(block):
    changed = bytearray(block.data)
    changed[block.starts[7] + 31] = 0xFF
    table = read_chunk(io.BytesIO(bytes(changed)), region(changed, block, "", 0), catalogue(), truncated=False)
    assert len(table.channel) == 2999 and 7 not in table.sequence


def test_a_bomb_is_unpacked_to_what_its_chunk_declares_and_no_further():
    bomb = zstandard.ZstdCompressor().compress(bytes(256 << 20))
    assert len(unpacked_start(bomb, Region(0, len(bomb), "zstd", 1000, 0, None))) <= 1000
    bomb = lz4.frame.compress(bytes(64 << 20))
    assert len(unpacked_start(bomb, Region(0, len(bomb), "lz4", 1000, 0, None))) <= 1000


def test_a_record_that_is_not_all_there_is_left_out(block):
    end = int(block.starts[2])
    for cut in (0, 1, 8, 9, 20):
        data = block.data[: end + cut]
        table = read_chunk(io.BytesIO(data), region(data, block, ""), catalogue(), truncated=True)
        assert table.sequence.tolist() == [0, 1]
    assert len(read_chunk(io.BytesIO(b""), region(b"", block, ""), catalogue(), truncated=True).channel) == 0


def test_a_part_of_a_table_is_its_rows(block):
    table = read_chunk(io.BytesIO(block.data), region(block.data, block, ""), catalogue(), truncated=False)
    part = table.part(np.array([2, 5]))
    assert part.sequence.tolist() == [2, 5] and part.payload(1) == table.payload(5)
