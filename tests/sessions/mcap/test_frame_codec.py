from pathlib import Path

import pytest
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from hypothesis import given
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.records import Channel
from support.session_files import (
    any_frames,
    assert_same_frames,
    packed,
    protobuf_messages,
    random_frames,
)

from sessions.errors import SessionFileError
from sessions.mcap import frame_codec
from sessions.mcap.container import Catalogue, ChannelInfo, RecordSpan, Region
from sessions.mcap.frame_codec import FrameDecoder, FrameEncoder
from sessions.mcap.schemas import message_class
from sessions.mcap.unpacking import messages_of_region
from sessions.model.session import Frames, Status


def frame_messages(*records):
    """A table of messages as a reader finds them in a file; records are (channel, sequence, log, publish, payload)."""
    return messages_of_region(
        b"".join(map(packed, records)),
        Region(RecordSpan(Opcode.MESSAGE, start=0, end=0), size=0, channels=None),
        Catalogue(path=None),
    )


def encoded_records(frames):
    """Records of frames."""
    return list(FrameEncoder(tf_channel=1, tracking_channel=2).encode(frames))


def decoder_of_frames(names=None, **more):
    """A decoder of the topics /tf and /tracking."""
    catalogue = Catalogue(Path("file"))
    for number, topic in ((1, "/tf"), (2, "/tracking")):
        catalogue.channels[number] = ChannelInfo(Channel(number, topic, "protobuf", {}, 0), schema=None)
    return FrameDecoder(catalogue, names, **more)


def decoded_frames(tables, names=None):
    """The frames of messages, decoded table by table."""
    item = decoder_of_frames(names)
    pieces = [piece for each in tables for piece in item.decode(each)]
    return Frames.join(pieces) if pieces else Frames.empty(item.names)


@given(any_frames(), st.integers(1, 4))
def test_frames_survive_any_chunk_boundary(frames, every):
    """Random frames are encoded as messages, 1 to 4 in a chunk, and decoded chunk by chunk to the same frames."""
    records = encoded_records(frames)
    tables = [frame_messages(*records[start : start + every]) for start in range(0, len(records), every)]
    assert_same_frames(decoded_frames(tables, frames.names), frames)


@given(st.data())
def test_batch_decoding_equals_single_decoding_for_any_damaged_byte(data):
    """Up to four of 20 messages have a byte damaged: decoded in a table or one by one they give the same, or a refusal.

    One by one they go through the protobuf library. ``absent``: the fraction of poses that are missing.
    """
    frames = random_frames(
        data.draw(st.integers(0, 9)), count=20, bodies=2, absent=data.draw(st.sampled_from([0.0, 0.3]))
    )
    records = encoded_records(frames)
    for row in data.draw(st.lists(st.integers(0, 19), max_size=4)):
        *stamps, payload = records[row]
        payload = bytearray(payload)
        payload[data.draw(st.integers(0, 10_000)) % len(payload)] ^= data.draw(st.sampled_from([1, 2, 8, 64, 128, 255]))
        records[row] = (*stamps, bytes(payload))
    outcomes = []
    for tables in ([frame_messages(*records)], [frame_messages(record) for record in records]):
        try:
            outcomes.append(decoded_frames(tables, frames.names))
        except SessionFileError:
            outcomes.append(None)
    if None in outcomes:
        assert outcomes == [None, None], "only one of them refuses"
    else:
        assert_same_frames(*outcomes)


def tracking_payload(status, **header):
    """The bytes of a message that says the status of body 0."""
    message = message_class("Tracking")()
    message.bodies.add(name="body 0", status=status)
    return message.SerializeToString()


def record_of(channel, payload, sequence=7, log=6, publish=5):
    """A message of channel 1, poses of a frame, or of channel 2, a note on the status of bodies in a frame."""
    return (channel, sequence, log, publish, payload)


POSES, NOTE = 1, 2
((_PUBLISH, _LOG, PAYLOAD_OF_BODY_0),) = protobuf_messages(random_frames(seed=0, count=1, bodies=1))


@pytest.mark.parametrize(
    ("other", "status"),
    [
        pytest.param({}, Status.LOST, id="the same frame"),
        pytest.param({"sequence": 8}, Status.VALID, id="another number"),
        pytest.param({"log": 9}, Status.VALID, id="another log time"),
        pytest.param({"publish": 9}, Status.VALID, id="another stamp"),
    ],
)
def test_note_without_matching_frame_changes_nothing(other, status):
    """A note says that body 0 was lost in a frame, which it names by sequence, log and publish time."""
    note = record_of(NOTE, tracking_payload(Status.LOST), **other)
    frames = decoded_frames([frame_messages(note, record_of(POSES, PAYLOAD_OF_BODY_0))])
    assert frames.status.tolist() == [[status]]


@pytest.mark.parametrize(
    "status", [pytest.param(0, id="absent"), pytest.param(1, id="valid"), pytest.param(9, id="unknown")]
)
def test_note_of_absent_or_unknown_status_changes_nothing(status):
    """A frame has a pose of body 0, which is valid for that, though a note calls it absent or gives no known status."""
    note = record_of(NOTE, tracking_payload(status))
    frames = decoded_frames([frame_messages(note, record_of(POSES, PAYLOAD_OF_BODY_0))])
    assert frames.status.tolist() == [[Status.VALID]]


def test_note_alone_makes_no_sample():
    """A note says that body 0 was lost in a frame that has no pose of it."""
    note = record_of(NOTE, tracking_payload(Status.LOST))
    frames = decoded_frames([frame_messages(note, record_of(POSES, b""))], ("body 0",))
    assert frames.status.tolist() == [[Status.ABSENT]]


def test_tolerant_decoder_records_time_range_of_unlisted_bodies():
    """Two frames have a pose of "body 0", and the list of bodies is empty: the decoder goes on, and counts it.

    ``met`` is (frame of reference, body) -> first and last stamp and number of samples.
    """
    frames, tolerant = random_frames(seed=0, count=2, bodies=1), decoder_of_frames((), strict=False)
    for publish, log, payload in protobuf_messages(frames):
        assert len([*tolerant.decode(frame_messages((1, 0, log, publish, payload)))]) == 1
    first_ns, last_ns = frames.stamp_ns.tolist()
    assert [*tolerant.met] == [("world", "body 0")]
    (met,) = tolerant.met.values()
    assert (met.first_ns, met.last_ns, met.count) == (first_ns, last_ns, 2)


def test_hostile_messages_are_refused_in_a_sentence(monkeypatch):
    """A message has poses of three bodies, where two are allowed, or more bytes than the 10 allowed, both lowered here.

    Or a note on status, of one byte 255, is no message of protobuf.
    """
    payload = protobuf_messages(random_frames(seed=0, count=1, bodies=3))[0][2]
    monkeypatch.setattr(frame_codec, "MAX_BODIES", 2)
    with pytest.raises(SessionFileError, match="more than 2 bodies"):
        decoded_frames([frame_messages((1, 0, 0, 0, payload))])
    monkeypatch.setattr(frame_codec, "MESSAGE_BYTES", 10)
    with pytest.raises(SessionFileError, match="more than the 10 allowed"):
        decoded_frames([frame_messages((1, 0, 0, 0, payload))])
    with pytest.raises(SessionFileError, match=r"no vrlab.Tracking"):
        decoded_frames([frame_messages((2, 7, 6, 5, b"\xff"), (1, 7, 6, 5, b""))])


def test_messages_that_repeat_a_body_thousands_of_times_are_refused():
    """Small messages could demand much memory: 63 messages with 4,000 entries for one body hold 252,000 samples.

    A small file may have 250,000. Entries are poses, or notes on the status of a body.
    """
    poses, tracking = FrameTransforms(), message_class("Tracking")()
    for _ in range(4000):
        poses.transforms.add(child_frame_id="body 0")
        tracking.bodies.add(name="body 0")
    repeated_poses, repeated_states = poses.SerializeToString(), tracking.SerializeToString()
    channel_of_poses, channel_of_states = 1, 2
    pose_messages = [(channel_of_poses, 0, stamp, stamp, repeated_poses) for stamp in range(63)]
    state_messages = [(channel_of_states, 0, 0, 0, repeated_states), (channel_of_poses, 0, 0, 0, b"")] * 63
    for messages in (pose_messages, state_messages):
        with pytest.raises(SessionFileError, match="more bodies than those of a file of its size"):
            decoded_frames([frame_messages(*messages)])
