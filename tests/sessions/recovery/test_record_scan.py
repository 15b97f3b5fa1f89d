import io
import struct
import time
import zlib
from dataclasses import replace
from itertools import accumulate
from pathlib import Path
from typing import NamedTuple

import lz4.frame
import numpy as np
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.records import Channel
from support.damage import chunks, records
from support.mcap_samples import packed as packed_message
from support.mcap_samples import protobuf_messages, random_frames, session_of, tetrahedron, write_foreign

from sessions import write_session
from sessions.mcap_format.catalogue import Catalogue, ChannelInfo, Region
from sessions.recovery.file_scan import read_chunk, scan_file, unpacked_start
from sessions.recovery.lost import LostChunk, Recovery
from sessions.recovery.record_scan import RecordScan


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    path = tmp_path_factory.mktemp("scan") / "s.mcap"
    write_session(session_of(random_frames(1, 900, 3), meshes={"a": tetrahedron()}), path)
    return path.read_bytes()


def pieces(data):
    return list(RecordScan(io.BytesIO(data)).pieces())


def test_every_record_of_a_whole_file_is_found_and_nothing_else(data):
    assert [(one.opcode, one.start, one.end) for one in pieces(data)] == records(data)


def test_bytes_that_are_no_record_are_skipped_to_the_next_that_is(data):
    start, _ = chunks(data)[1]
    found = pieces(data[:start] + b"\xff" * 5000 + data[start:])
    assert (0, start, start + 5000) in [(one.opcode, one.start, one.end) for one in found]
    assert sum(one.opcode == Opcode.CHUNK for one in found) == len(chunks(data))


def test_a_chunk_whose_own_length_changed_is_believed_by_its_inner_lengths(data):
    start, _ = chunks(data)[1]
    changed = bytearray(data)
    changed[start + 3] ^= 0xFF
    assert [one.end for one in pieces(bytes(changed)) if one.opcode == Opcode.CHUNK] == [end for _, end in chunks(data)]


def test_a_chunk_that_the_end_of_the_file_cuts_is_truncated(data):
    start, end = chunks(data)[-1]
    last = pieces(data[: (start + end) // 2])[-1]
    assert (
        last.opcode == Opcode.CHUNK and last.truncated and last.region.offset + last.region.length == (start + end) // 2
    )


def covered(data, found):
    """Pieces follow one another without a gap from the magic to the end."""
    at = 8 if data[:8] == b"\x89MCAP0\r\n" else 0
    for one in found:
        assert one.start == at and one.end > at
        at = one.end if not one.truncated else len(data)
    return at


@settings(max_examples=200)
@given(st.data())
def test_any_bytes_are_walked_to_the_end_without_a_gap(data, draw):
    body = bytearray(data)
    for _ in range(draw.draw(st.integers(0, 6))):
        at = draw.draw(st.integers(0, len(body) - 1))
        body[at : at + draw.draw(st.integers(0, 40))] = draw.draw(st.binary(max_size=40))
    body = bytes(body)
    assert covered(body, pieces(body)) >= min(len(body), 8) - 8


@pytest.mark.parametrize("pattern", [b"\x00", b"\x05\x00\x00\x00\x00\x00\x00\x00\x00", b"\x06" * 9, b"\x09" + bytes(8)])
def test_hostile_repetition_takes_time_in_proportion_to_the_size(pattern):
    def seconds(size):
        body = b"\x89MCAP0\r\n" + (pattern * (size // len(pattern) + 1))[:size]
        begun = time.process_time()
        pieces(body)
        return time.process_time() - begun

    seconds(1 << 14)
    small, large = seconds(1 << 16), seconds(1 << 18)
    assert large < 12 * small + 0.2


def test_a_declared_length_is_never_read_before_it_is_believed():
    hostile = b"\x89MCAP0\r\n" + struct.pack("<BQ", Opcode.ATTACHMENT, 1 << 60) + bytes(100)
    assert [one.opcode for one in pieces(hostile)] == [0]
    assert np.sum([one.end - one.start for one in pieces(hostile)]) == len(hostile) - 8


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


def test_messages_outside_chunks_are_found_on_both_sides_of_bytes_that_are_no_record(tmp_path):
    path = write_foreign(tmp_path / "f.mcap", protobuf_messages(random_frames(1, 200)), use_chunking=False)
    data = path.read_bytes()
    start = [start for opcode, start, _ in records(data) if opcode == Opcode.MESSAGE][77]
    found = scan_file(path, io.BytesIO(data[:start] + b"\xff" * 500 + data[start:]))
    assert (found.frames, found.bytes_skipped, len(found.parts)) == (200, 500, 2)


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


def cut(packed, block, name):
    return replace(region(packed, block, name), truncated=True)


@pytest.mark.parametrize("name", PACK)
def test_a_whole_chunk_gives_every_message(block, name):
    packed = PACK[name](block.data)
    table = read_chunk(io.BytesIO(packed), region(packed, block, name), catalogue())
    assert len(table.channel) == 3000


@pytest.mark.parametrize("name", PACK)
def test_a_truncated_chunk_gives_the_messages_before_the_cut_and_they_are_right(block, name):
    packed = PACK[name](block.data)[: len(PACK[name](block.data)) * 2 // 3]
    table = read_chunk(io.BytesIO(packed), cut(packed, block, name), catalogue())
    count = len(table.channel)
    assert 300 < count < 3000
    assert [table.payload(k) for k in range(count)] == [
        block.data[block.starts[k] + 31 : block.starts[k + 1]] for k in range(count)
    ]


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


def test_a_bomb_is_unpacked_to_what_its_chunk_declares_and_no_further():
    bomb = zstandard.ZstdCompressor().compress(bytes(256 << 20))
    assert len(unpacked_start(bomb, Region(0, len(bomb), "zstd", 1000, 0, None))) <= 1000
    bomb = lz4.frame.compress(bytes(64 << 20))
    assert len(unpacked_start(bomb, Region(0, len(bomb), "lz4", 1000, 0, None))) <= 1000


def test_a_record_that_is_not_all_there_is_left_out(block):
    end = block.starts[2]
    for more in (0, 1, 8, 9, 20):
        data = block.data[: end + more]
        table = read_chunk(io.BytesIO(data), cut(data, block, ""), catalogue())
        assert table.sequence.tolist() == [0, 1]
    assert len(read_chunk(io.BytesIO(b""), cut(b"", block, ""), catalogue()).channel) == 0


def test_a_part_of_a_table_is_its_rows(block):
    table = read_chunk(io.BytesIO(block.data), region(block.data, block, ""), catalogue())
    part = table.part(np.array([2, 5]))
    assert part.sequence.tolist() == [2, 5] and part.payload(1) == table.payload(5)
