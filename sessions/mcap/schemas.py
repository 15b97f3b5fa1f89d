"""Every message of the profile as a protobuf class and every channel with its schema; readable by any protobuf tool.

Poses, remarks and models use Foxglove's published messages, so that Rerun and Foxglove open them as they are. What
those do not know (validity, intervals, hands, live contacts, faster tracks, gaze, scalars) is package ``vrlab``, whose
descriptor is the text file beside this module.

Source: Foxglove schemas (FrameTransforms, Log, SceneUpdate), https://docs.foxglove.dev/docs/sdk/schemas.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, text_format, timestamp_pb2

OWN_MESSAGES = Path(__file__).with_name("session.textproto")
PROFILE = "vrlab/1"
PROFILE_FAMILY = "vrlab/"
WORLD = "world"
TF = "/tf"
TRACKING = "/tracking"
EVENTS = "/events"
INTERVALS = "/intervals"
SCENE = "/scene"
LIVE_CONTACTS = "/contacts/live"
HANDS_PREFIX, TRACKS_PREFIX, GAZE_PREFIX, SCALARS_PREFIX = "/hands/", "/tracks/", "/gaze/", "/scalars/"
STREAMS = {HANDS_PREFIX: "hands", TRACKS_PREFIX: "fast_tracks", GAZE_PREFIX: "gaze", SCALARS_PREFIX: "scalars"}
"""Prefix of topics -> the part of a session that holds them by what follows the prefix."""


@cache
def message_class(name: str) -> Any:
    """The protobuf class of one of our own messages, for example ``Tracking``."""
    pool = descriptor_pool.Default()
    timestamp_pb2.Timestamp()  # loading it puts the one dependency into the pool
    try:
        descriptor = pool.FindMessageTypeByName(f"vrlab.{name}")
    except KeyError:
        file = descriptor_pb2.FileDescriptorProto()
        text_format.Parse(OWN_MESSAGES.read_text(encoding="utf-8"), file)
        pool.AddSerializedFile(file.SerializeToString(deterministic=True))
        descriptor = pool.FindMessageTypeByName(f"vrlab.{name}")
    return message_factory.GetMessageClass(descriptor)


@dataclass(frozen=True)
class ChannelSpec:
    """The type of the messages of a channel: the full name of their schema, and their class."""

    schema: str
    message: Any

    @property
    def descriptor_set(self) -> bytes:
        """The message and all it depends on, as MCAP wants a protobuf schema: a serialized FileDescriptorSet."""
        files = dict.fromkeys(_dependencies_first(self.message.DESCRIPTOR.file))
        protos = [descriptor_pb2.FileDescriptorProto.FromString(file.serialized_pb) for file in files]
        return bytes(descriptor_pb2.FileDescriptorSet(file=protos).SerializeToString(deterministic=True))


def _dependencies_first(file: Any) -> Iterator[Any]:
    for dependency in file.dependencies:
        yield from _dependencies_first(dependency)
    yield file


_MESSAGE_OF: dict[str, Any] = {
    TF: FrameTransforms,
    EVENTS: Log,
    SCENE: SceneUpdate,
    TRACKING: "Tracking",
    INTERVALS: "Interval",
    LIVE_CONTACTS: "Contact",
    HANDS_PREFIX: "Hand",
    TRACKS_PREFIX: "TrackSamples",
    GAZE_PREFIX: "GazeSamples",
    SCALARS_PREFIX: "ScalarSamples",
}
"""Topic, or prefix of topics -> the message's class, or the name of our own."""


def topic_key(topic: str) -> str:
    """The prefix that a topic has, or the topic itself."""
    return next((prefix for prefix in STREAMS if topic.startswith(prefix)), topic)


def channel_spec(topic: str) -> ChannelSpec:
    """The channel of a topic of the profile; ``KeyError`` when the profile has no such topic."""
    message = _MESSAGE_OF[topic_key(topic)]
    message = message_class(message) if isinstance(message, str) else message
    return ChannelSpec(message.DESCRIPTOR.full_name, message)
