import io
import zlib
from dataclasses import replace
from itertools import accumulate
from pathlib import Path
from typing import NamedTuple

import lz4.frame
import numpy as np
import pytest
import zstandard
from mcap.opcode import Opcode
from mcap.records import Channel
from support.damage import records
from support.mcap_samples import packed as packed_message
from support.mcap_samples import protobuf_messages, random_frames, session_of, tetrahedron

from sessions import write_session
from sessions.mcap_format.catalogue import Catalogue, ChannelInfo, Region
from sessions.recovery.file_scan import read_chunk, scan_file
from sessions.recovery.lost import LostChunk, Recovery


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("survey") / "s.mcap"
    write_session(session_of(random_frames(1, 900, 3, odd=0.2), meshes={"a": tetrahedron()}), path)
    return path


def test_a_whole_file_is_known_completely(path):
    with path.open("rb") as stream:
        found = scan_file(path, stream)
    assert (found.frames, found.lost, found.bytes_skipped) == (900, [], 0)
    assert set(found.names) == {"body 0", "body 1", "body 2"}
    assert list(found.attachments) == ["meshes/a.glb"] and found.checked == {"meshes/a.glb"}
    assert {channel.topic for channel in found.declared.raw[Channel].values()} == {"/tf", "/tracking", "/scene"}


def test_a_checked_index_overrules_a_damaged_head(path):
    data = bytearray(path.read_bytes())
    start, end = next((a, b) for opcode, a, b in records(bytes(data)) if opcode == Opcode.CHANNEL)
    at = bytes(data).index(b"/tf", start, end)
    data[at : at + 3] = b"/xx"
    found = scan_file(path, io.BytesIO(bytes(data)))
    assert found.frames == 900


KEPT = Recovery(Path("out.mcap"), 20, 10, 5_000_000_000, 6_000_000_000)


def test_nothing_lost_is_whole_and_anything_lost_is_not():
    assert KEPT.whole and KEPT.sentences() == ["kept 10 frames and 20 messages"]
    chunk = LostChunk(7, 5_500_000_000, 5_700_000_000, 18, "damaged")
    parts = {"chunks": (chunk,), "bytes_skipped": 1, "bodies": ("a",), "attachments": ("m",), "unknown": 2}
    for name, value in parts.items():
        lost = replace(KEPT, **{name: value})
        assert not lost.whole and len(lost.sentences()) == 2


def test_a_lost_chunk_says_what_when_and_where():
    chunk = LostChunk(7, 5_500_000_000, 5_700_000_000, 18, "damaged")
    words = replace(KEPT, chunks=(chunk,)).sentences()[1]
    assert words == "lost 18 messages, 0.500 s to 0.700 s: the chunk at byte 7 is damaged"
    cut = LostChunk(7, 0, 0, None, "cut short")
    assert "an unknown number of messages: the chunk" in replace(KEPT, chunks=(cut,)).sentences()[1]


PACK = {
    "zstd": lambda data: zstandard.ZstdCompressor().compress(data),
    "lz4": lz4.frame.compress,
    "": lambda data: data,
}


class Block(NamedTuple):
    data: bytes
    starts: list[int]


@pytest.fixture(scope="module")
def block():
    messages = protobuf_messages(random_frames(1, 3000, 3))
    records = [packed_message((1, k, log, publish, payload)) for k, (publish, log, payload) in enumerate(messages)]
    return Block(b"".join(records), [0, *accumulate(map(len, records))])


def catalogue():
    found = Catalogue(None)
    found.channels[1] = ChannelInfo("/tf", "protobuf", "foxglove.FrameTransforms")
    return found


def region(packed, block, name, crc=None):
    return Region(0, len(packed), name, len(block.data), zlib.crc32(block.data) if crc is None else crc, None)


@pytest.mark.parametrize("name", PACK)
def test_a_whole_chunk_gives_every_message(block, name):
    packed = PACK[name](block.data)
    table = read_chunk(io.BytesIO(packed), region(packed, block, name), catalogue())
    assert len(table.channel) == 3000


def test_a_chunk_with_a_wrong_checksum_gives_nothing(block):
    packed = PACK[""](block.data)
    changed = bytearray(packed)
    changed[5000] ^= 1
    assert read_chunk(io.BytesIO(bytes(changed)), region(changed, block, ""), catalogue()) == "damaged"


def test_without_a_checksum_poses_that_are_none_are_left_out(block):
    changed = bytearray(block.data)
    changed[block.starts[7] + 31] = 0xFF
    table = read_chunk(io.BytesIO(bytes(changed)), region(changed, block, "", 0), catalogue())
    assert len(table.channel) == 2999 and 7 not in table.sequence


def test_a_part_of_a_table_is_its_rows(block):
    table = read_chunk(io.BytesIO(block.data), region(block.data, block, ""), catalogue())
    part = table.part(np.array([2, 5]))
    assert part.sequence.tolist() == [2, 5] and part.payload(1) == table.payload(5)
