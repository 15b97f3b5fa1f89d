"""Every message of the profile as a protobuf class and every channel with its schema; readable by any protobuf tool.

Poses, remarks and models use Foxglove's published messages, so that Rerun and Foxglove open them as they are. What
those do not know (validity, intervals, hands, live contacts, faster tracks, gaze, scalars) is package ``vrlab`` below,
built from a table instead of generated code.

Source: Foxglove schemas (FrameTransforms, Log, SceneUpdate), https://docs.foxglove.dev/docs/sdk/schemas.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2

PROFILE = "vrlab/1"
PROFILE_FAMILY = "vrlab/"
WORLD = "world"
TF, TRACKING, EVENTS, INTERVALS, SCENE, LIVE_CONTACTS = (
    "/tf", "/tracking", "/events", "/intervals", "/scene", "/contacts/live",
)  # fmt: skip
HANDS_PREFIX, TRACKS_PREFIX, GAZE_PREFIX, SCALARS_PREFIX = "/hands/", "/tracks/", "/gaze/", "/scalars/"
STREAMS = {HANDS_PREFIX: "hands", TRACKS_PREFIX: "fast_tracks", GAZE_PREFIX: "gaze", SCALARS_PREFIX: "scalars"}
"""Prefix of topics -> the part of a session that holds them by what follows the prefix."""

_TIMESTAMP = ".google.protobuf.Timestamp"
_FIELD = descriptor_pb2.FieldDescriptorProto
_SCALARS = {
    "string": _FIELD.TYPE_STRING, "bool": _FIELD.TYPE_BOOL, "double": _FIELD.TYPE_DOUBLE,
    "sfixed64": _FIELD.TYPE_SFIXED64,
}  # fmt: skip
_ENUMS = {
    "Status": ("STATUS_UNKNOWN", "VALID", "LOST", "HELD", "INTERPOLATED"),
    "Phase": ("PHASE_UNKNOWN", "ENTER", "STAY", "EXIT"),
}
_MESSAGES: dict[str, tuple[tuple[str, str], ...]] = {
    # Field numbers are the places in the tuple, from 1: append, never reorder.
    "BodyStatus": (("name", "string"), ("status", "Status")),
    "Tracking": (("bodies", "repeated BodyStatus"), ("frame_without_samples", "bool")),
    "Fact": (("key", "string"), ("value", "string")),
    "Interval": (
        ("start", _TIMESTAMP), ("end", _TIMESTAMP), ("kind", "string"), ("name", "string"), ("data", "repeated Fact"),
    ),
    "Button": (("name", "string"), ("pressed", "bool")),
    "Hand": (("timestamp", _TIMESTAMP), ("trigger", "double"), ("grip", "double"), ("buttons", "repeated Button")),
    "Contact": (
        ("timestamp", _TIMESTAMP), ("body_a", "string"), ("body_b", "string"), ("phase", "Phase"),
        ("point", "repeated double"),
    ),
    "TrackSamples": (
        ("sample_ns", "repeated sfixed64"), ("position", "repeated double"), ("quaternion_xyzw", "repeated double"),
        ("valid", "repeated bool"),
    ),
    "GazeSamples": (
        ("sample_ns", "repeated sfixed64"), ("origin", "repeated double"), ("direction", "repeated double"),
        ("valid", "repeated bool"), ("body", "repeated string"),
    ),
    "ScalarSamples": (("sample_ns", "repeated sfixed64"), ("value", "repeated double"), ("unit", "string")),
}  # fmt: skip


def _file() -> Any:
    file = descriptor_pb2.FileDescriptorProto(
        name="vrlab/session.proto", package="vrlab", syntax="proto3", dependency=["google/protobuf/timestamp.proto"]
    )
    for name, values in _ENUMS.items():
        enum = file.enum_type.add(name=name)
        for number, value in enumerate(values):
            enum.value.add(name=value, number=number)
    for name, fields in _MESSAGES.items():
        message = file.message_type.add(name=name)
        for number, (field, kind) in enumerate(fields, start=1):
            _add_field(message, number, field, kind)
    return file


def _add_field(message: Any, number: int, name: str, kind: str) -> None:
    word = kind.removeprefix("repeated ")
    label = _FIELD.LABEL_REPEATED if kind != word else _FIELD.LABEL_OPTIONAL
    field = message.field.add(name=name, number=number, label=label)
    if word in _SCALARS:
        field.type = _SCALARS[word]
    else:
        field.type = _FIELD.TYPE_ENUM if word in _ENUMS else _FIELD.TYPE_MESSAGE
        field.type_name = word if word.startswith(".") else f".vrlab.{word}"


@cache
def message_class(name: str) -> Any:
    """The protobuf class of one of our own messages, for example ``Tracking``."""
    pool = descriptor_pool.Default()
    timestamp_pb2.Timestamp()  # loading it puts the one dependency into the pool
    try:
        descriptor = pool.FindMessageTypeByName(f"vrlab.{name}")
    except KeyError:
        pool.AddSerializedFile(_file().SerializeToString(deterministic=True))
        descriptor = pool.FindMessageTypeByName(f"vrlab.{name}")
    return message_factory.GetMessageClass(descriptor)


@dataclass(frozen=True)
class ChannelSpec:
    """A channel of the profile: its topic, the full name of its message, and the message's class."""

    topic: str
    schema: str
    message: Any

    @property
    def descriptor_set(self) -> bytes:
        """The message and all it depends on, as MCAP wants a protobuf schema: a serialized FileDescriptorSet."""
        files: dict[str, Any] = {}
        _collect(self.message.DESCRIPTOR.file, files)
        found = descriptor_pb2.FileDescriptorSet(file=files.values())
        return bytes(found.SerializeToString(deterministic=True))


def _collect(file: Any, files: dict[str, Any]) -> None:
    """Dependencies first, each once."""
    if file.name in files:
        return
    for dependency in file.dependencies:
        _collect(dependency, files)
    proto = descriptor_pb2.FileDescriptorProto()
    file.CopyToProto(proto)
    files[file.name] = proto


_MESSAGE_OF: dict[str, Any] = {
    TF: FrameTransforms, EVENTS: Log, SCENE: SceneUpdate,
    TRACKING: "Tracking", INTERVALS: "Interval", LIVE_CONTACTS: "Contact",
    HANDS_PREFIX: "Hand", TRACKS_PREFIX: "TrackSamples", GAZE_PREFIX: "GazeSamples", SCALARS_PREFIX: "ScalarSamples",
}  # fmt: skip
"""Topic, or prefix of topics -> the message's class, or the name of our own."""


def topic_key(topic: str) -> str:
    """The prefix that a topic has, or the topic itself."""
    return next((prefix for prefix in STREAMS if topic.startswith(prefix)), topic)


def channel_spec(topic: str) -> ChannelSpec:
    """The channel of a topic of the profile; ``KeyError`` when the profile has no such topic."""
    message = _MESSAGE_OF[topic_key(topic)]
    message = message_class(message) if isinstance(message, str) else message
    return ChannelSpec(topic, message.DESCRIPTOR.full_name, message)
