from itertools import pairwise

import numpy as np
import pytest
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from hypothesis import given, settings
from hypothesis import strategies as st
from support.mcap_samples import SECOND, any_frames, random_frames

from sessions.errors import SessionFileError
from sessions.mcap_format.pose_encoding import FRAME_WITHOUT_SAMPLES, FrameEncoder, column_view, varint
from sessions.mcap_format.record_block import MESSAGE_HEADER
from sessions.mcap_format.schemas import message_class
from sessions.model.frames import Frames, Status


def records(block):
    for start, channel in zip(block.starts.tolist(), block.channel.tolist(), strict=True):
        _, length, number, sequence, log, publish = MESSAGE_HEADER.unpack_from(block.data, start)
        assert number == channel
        yield channel, sequence, log, publish, block.data[start + MESSAGE_HEADER.size : start + 9 + length]


@settings(deadline=None)
@given(any_frames())
def test_the_protobuf_library_decodes_the_numbers_that_went_in(frames):
    block = FrameEncoder(1, 2).encode(frames)
    found = [record for record in records(block) if record[0] == 1 or record[4] == FRAME_WITHOUT_SAMPLES]
    assert [(r[1], r[2], r[3]) for r in found] == list(
        zip(range(len(frames)), frames.log_ns.tolist(), frames.stamp_ns.tolist(), strict=True)
    )
    for row, (channel, *_, payload) in enumerate(found):
        present = np.flatnonzero(frames.status[row] != Status.ABSENT)
        transforms = FrameTransforms.FromString(payload if channel == 1 else b"").transforms
        assert len(transforms) == len(present)
        for one, column in zip(transforms, present, strict=True):
            assert (one.parent_frame_id, one.child_frame_id) == ("world", frames.names[column])
            assert one.timestamp.seconds * SECOND + one.timestamp.nanos == frames.sample_ns[row, column]
            assert 0 <= one.timestamp.nanos < SECOND
            p, q = one.translation, one.rotation
            values = np.array([p.x, p.y, p.z, q.x, q.y, q.z, q.w])
            expected = np.concatenate([frames.position[row, column], frames.quaternion_xyzw[row, column]])
            assert values.tobytes() == expected.tobytes()


def test_the_note_stands_just_before_its_frame_and_only_where_something_is_not_valid():
    frames = random_frames(4, 300, 3, odd=0.1)
    block = FrameEncoder(1, 2).encode(frames)
    odd = (frames.status > Status.VALID).any(axis=1)
    assert block.channel.tolist() == [channel for bad in odd for channel in ([2, 1] if bad else [1])]
    assert block.group_counts.tolist() == np.cumsum(odd + 1).tolist()
    listed = list(records(block))
    for note, frame in pairwise(listed):
        if note[0] == 2:
            assert note[1:4] == frame[1:4]
            names = {body.name: body.status for body in message_class("Tracking").FromString(note[4]).bodies}
            row = note[1]
            assert names == {n: s for n, s in zip(frames.names, frames.status[row], strict=True) if s > Status.VALID}


def test_frames_are_numbered_on_from_block_to_block():
    frames = random_frames(4, 10)
    encoder = FrameEncoder(1, 2)
    sequences = [r[1] for part in frames.blocks(3) for r in records(encoder.encode(part))]
    assert sequences == list(range(10))


def test_a_frame_before_zero_is_refused():
    frames = random_frames(4, 3)
    early = Frames(frames.names, frames.stamp_ns - frames.stamp_ns[1], frames.log_ns, frames.sample_ns,
                   frames.position, frames.quaternion_xyzw, frames.status)  # fmt: skip
    with pytest.raises(SessionFileError, match="shift all stamps"):
        FrameEncoder(1, 2).encode(early)


@given(st.integers(0, 2**63))
def test_a_varint_has_no_needless_byte_and_reads_back(value):
    data = varint(value)
    assert sum((byte & 0x7F) << (7 * place) for place, byte in enumerate(data)) == value
    assert len(data) == max(1, -(-value.bit_length() // 7)) and data[-1] < 0x80


def test_a_column_view_writes_into_its_table():
    table = np.zeros((3, 20), dtype=np.uint8)
    column_view(table, 5, "<f8")[:] = [1.0, 2.0, np.nan]
    assert np.frombuffer(table[1, 5:13].tobytes(), "<f8")[0] == 2.0 and not table[:, :5].any()
