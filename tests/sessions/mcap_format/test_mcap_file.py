import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from support.mcap_samples import assert_same_frames, protobuf_messages, random_frames, session_of, write_foreign

from sessions.errors import SessionFileError
from sessions.mcap_format.mcap_file import McapFile, McapFrames
from sessions.mcap_format.reader import LazyMapping, LazySequence
from sessions.mcap_format.schemas import channel_spec, message_class
from sessions.mcap_format.writer import write_session
from sessions.model.event import Event
from sessions.model.frames import Frames
from sessions.model.scene import Scene


@pytest.fixture
def path(tmp_path):
    frames = random_frames(1, 3000, 6, odd=0.02)
    write_session(
        session_of(frames, events=(Event(1, "a"), Event(2, "b")), scene=Scene(name="bench")), tmp_path / "s.mcap"
    )
    return tmp_path / "s.mcap"


def test_messages_of_a_topic_come_with_their_stamps(path):
    file = McapFile(path)
    assert [time for time, _ in file.payloads("/events")] == [1, 2]
    assert list(file.payloads("/nothing")) == []
    assert file.topics_below("/tr") == ["acking"]


def test_the_last_stamp_is_that_of_the_last_frames(path):
    assert McapFile(path).last_stamp() == random_frames(1, 3000, 6, odd=0.02).stamp_ns[-1]


def test_an_attachment_is_found_by_name_or_is_none(path):
    file = McapFile(path)
    assert b"bench" in file.attachment("scene.toml") and file.attachment("meshes/x.glb") is None
    data = path.read_bytes()
    place = data.index(b"bench")
    path.write_bytes(data[:place] + b"B" + data[place + 1 :])
    with pytest.raises(SessionFileError, match=r"attachment 'scene.toml' is damaged"):
        McapFile(path).attachment("scene.toml")


@pytest.mark.parametrize("length", [1, 7, 1000, 2999, 3000, 10_000])
def test_blocks_are_full_but_the_last(path, length):
    source = McapFrames(McapFile(path), tuple(f"body {k}" for k in range(6)))
    blocks = []
    for block in source.blocks(length):
        blocks.append(block)
        if length == 1 and len(blocks) == 5:
            break
    assert all(len(block) == length for block in blocks[:-1])
    if length > 1:
        assert_same_frames(Frames.join(blocks), random_frames(1, 3000, 6, odd=0.02))


def test_channels_that_only_chunks_declare_are_found(tmp_path):
    messages = protobuf_messages(random_frames(1))
    path = write_foreign(tmp_path / "f.mcap", messages, repeat_channels=False, repeat_schemas=False, chunk_size=999)
    assert {channel.topic for channel in McapFile(path).catalogue.channels.values()} == {"/tf", "/speech"}
    data = path.read_bytes()
    path.write_bytes(data[:2000])
    assert McapFile(path).catalogue.ids("/tf")


def test_values_are_loaded_once_and_only_when_asked_for():
    loaded = []
    mapping = LazyMapping(["b", "a"], lambda key: loaded.append(key) or key.upper())
    assert list(mapping) == ["b", "a"] and len(mapping) == 2 and "a" in mapping and "c" not in mapping and loaded == []
    assert mapping["a"] == mapping["a"] == "A" and loaded == ["a"]
    with pytest.raises(KeyError):
        mapping["c"]
    assert dict(mapping) == {"b": "B", "a": "A"}


def test_a_sequence_is_loaded_once_at_its_first_use():
    loaded = []
    sequence = LazySequence(lambda: loaded.append(1) or [3, 4, 5])
    assert loaded == []
    assert sequence[1] == 4 and sequence[1:] == (4, 5) and len(sequence) == 3 and list(sequence) == [3, 4, 5]
    assert sequence == [3, 4, 5] and sequence != [3] and hash(sequence) == hash((3, 4, 5)) and loaded == [1]


TOPICS = ["/tf", "/tracking", "/events", "/intervals", "/scene", "/contacts/live", "/hands/anna/left", "/tracks/wand"]


@pytest.mark.parametrize("topic", TOPICS)
def test_a_stranger_can_decode_every_channel_from_its_descriptor_set_alone(topic):
    spec = channel_spec(topic)
    files = descriptor_pb2.FileDescriptorSet.FromString(spec.descriptor_set).file
    pool = descriptor_pool.DescriptorPool()
    for file in files:  # in this order: every dependency stands before what needs it
        pool.Add(file)
    stranger = message_factory.GetMessageClass(pool.FindMessageTypeByName(spec.schema))
    assert [field.name for field in stranger.DESCRIPTOR.fields] == [f.name for f in spec.message.DESCRIPTOR.fields]
    assert channel_spec(topic).descriptor_set == spec.descriptor_set


def test_poses_remarks_and_models_are_messages_that_viewers_know():
    assert [channel_spec(topic).schema for topic in ("/tf", "/events", "/scene")] == [
        "foxglove.FrameTransforms", "foxglove.Log", "foxglove.SceneUpdate",
    ]  # fmt: skip


def test_the_numbers_of_a_status_are_those_of_the_model():
    from sessions.model.frames import Status

    numbers = dict(message_class("Tracking").DESCRIPTOR.fields_by_name["bodies"].message_type.fields_by_name[
        "status"].enum_type.values_by_name.items())  # fmt: skip
    for status in (Status.VALID, Status.LOST, Status.HELD, Status.INTERPOLATED):
        assert numbers[status.name].number == status


def test_field_numbers_of_files_that_exist_never_change():
    numbers = {f.name: f.number for f in message_class("Interval").DESCRIPTOR.fields}
    assert numbers == {"start": 1, "end": 2, "kind": 3, "name": 4, "data": 5}
    numbers = {f.name: f.number for f in message_class("TrackSamples").DESCRIPTOR.fields}
    assert numbers == {"sample_ns": 1, "position": 2, "quaternion_xyzw": 3, "valid": 4}


def test_a_topic_outside_the_profile_is_unknown():
    with pytest.raises(KeyError):
        channel_spec("/speech")
