import io
import struct
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.opcode import Opcode
from support.damage import chunks, records
from support.mcap_samples import random_frames, session_of, tetrahedron

from sessions import write_session
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
