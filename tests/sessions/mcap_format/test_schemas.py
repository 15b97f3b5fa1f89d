import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from sessions.mcap_format.schemas import channel_spec, message_class

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
