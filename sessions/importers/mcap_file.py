"""MCAP files of other programs: poses in Foxglove's messages (protobuf or JSON), tf2 and geometry_msgs of ROS 2 (CDR).

Source: Foxglove schemas, https://docs.foxglove.dev/docs/sdk/schemas; ROS 2 common_interfaces; ROS REP 103, REP 105.
"""

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final, NamedTuple

from sessions.errors import ImportFileError, SessionFileError
from sessions.importers.finish import Imported
from sessions.importers.frame_tree import FrameTree
from sessions.importers.pose_table import SourceFrame, imported
from sessions.mcap_format.catalogue import ChannelInfo
from sessions.mcap_format.mcap_file import McapFile
from sessions.mcap_format.refusals import brief
from sessions.meshes.conventions import convention as convention_named

ASSUMED: Final = "ros"
"""Axes where none are named: Foxglove and ROS both follow REP 103."""
NAMED_TOPICS: Final = 8  # Topics that an error names before it ends in dots


def read_mcap(
    source: Path,
    *,
    convention: str | None = None,
    topics: Sequence[str] = (),
) -> Imported:
    """Every pose in an MCAP file of another program.

    A frame is a body of its name, a pose one of its topic. Stamps are those of the messages.

    Parameters
    ----------
    convention : a name in ``CONVENTIONS``; ``None``: that of ROS.
    topics : read these alone; none: all that hold poses. Of several whose poses are in frames that no transform joins,
        the frames are taken for one world.

    Raises ``ImportFileError``: names file, topic and what to do.
    """
    axes = convention_named(convention or ASSUMED)
    tree, unstamped = FrameTree(str(source)), 0
    for channel, log_ns, message in _messages(source, topics):
        unstamped += _add(channel, log_ns, message, tree)
    tables, words, joined = tree.tables(join=len(topics) > 1)
    if unstamped:
        words.append(f"{unstamped} poses without a stamp have the time they were logged at")
    assumed = [] if convention else [f"axes {ASSUMED} ({axes.words})"]
    frame = SourceFrame(axes, "m", "stamps of the messages, ns", "ns", (*assumed, "lengths in m", *joined))
    return replace(imported(tables, frame, words), of_people=False)


class _Layout(NamedTuple):
    """Where a message keeps its poses: attributes, with dots between them."""

    rows: str  # the list of poses; "" where the message is one
    parent: str
    child: str  # "" where a body is named after its topic
    stamp: str
    place: str
    turn: str


_FOXGLOVE_FRAME = _Layout("", "parent_frame_id", "child_frame_id", "timestamp", "translation", "rotation")
_FOXGLOVE_POSE = _Layout("", "frame_id", "", "timestamp", "pose.position", "pose.orientation")
_TRANSFORM = _Layout(
    "", "header.frame_id", "child_frame_id", "header.stamp", "transform.translation", "transform.rotation"
)
_POSE = _Layout("", "header.frame_id", "", "header.stamp", "pose.position", "pose.orientation")

LAYOUTS: Final[Mapping[str, _Layout]] = {
    "FrameTransform": _FOXGLOVE_FRAME,
    "FrameTransforms": _FOXGLOVE_FRAME._replace(rows="transforms"),
    "PoseInFrame": _FOXGLOVE_POSE,
    "PosesInFrame": _FOXGLOVE_POSE._replace(rows="poses", place="position", turn="orientation"),
    "TransformStamped": _TRANSFORM,
    "TFMessage": _TRANSFORM._replace(rows="transforms"),
    "PoseStamped": _POSE,
    "PoseWithCovarianceStamped": _POSE._replace(place="pose.pose.position", turn="pose.pose.orientation"),
    "PoseArray": _POSE._replace(rows="poses", place="position", turn="orientation"),
}
"""Last word of a schema's name -> where its poses are."""


def _add(channel: ChannelInfo, log_ns: int, message: Any, tree: FrameTree) -> int:
    """Hang the poses of a message into the tree; how many bear no stamp of their own."""
    layout, unstamped = LAYOUTS[_kind(channel)], 0
    rows = _part(message, layout.rows) if layout.rows else [message]
    topic, static = channel.topic.strip("/") or "pose", channel.topic.endswith("tf_static")
    for place, row in enumerate(rows if hasattr(rows, "__len__") else ()):
        head = row if layout.child else message
        name = _part(row, layout.child) if layout.child else f"{topic}/{place}" if layout.rows else topic
        stamp = _stamp_of(_part(head, layout.stamp))
        unstamped += stamp == 0
        pose = (_part(row, layout.place), "xyz"), (_part(row, layout.turn), "xyzw")
        numbers = [_number(getattr(part, axis, None)) for part, axes in pose for axis in axes]
        parent = _part(head, layout.parent)
        parent, name = (value if isinstance(value, str) else "" for value in (parent, name))
        if not layout.child and name == parent.strip("/"):
            name = f"{name} pose"  # a topic may bear the name of the frame that its poses are in
        tree.add(parent, name, stamp or log_ns, numbers, static=static)
    return unstamped


def _kind(channel: ChannelInfo) -> str:
    """The last word of the name of its schema."""
    return channel.schema_name.replace("/", ".").rsplit(".", 1)[-1]


def _part(value: Any, path: str) -> Any:
    """The attribute that dots lead to; ``None`` where it is absent."""
    for name in path.split("."):
        value = getattr(value, name, None)
    return value


def _number(value: Any) -> float:
    fits = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300
    return float(value) if fits else math.nan


def _stamp_of(time: Any) -> int:
    """Nanoseconds of a timestamp of protobuf, JSON or ROS; 0 where it is absent."""
    parts = []
    for names in (("seconds", "sec"), ("nanos", "nsec", "nanosec")):
        values = (getattr(time, name, None) for name in names)
        parts.append(next((value for value in values if type(value) is int), 0))
    return parts[0] * 1_000_000_000 + parts[1]


def _messages(source: Path, topics: Sequence[str]) -> Iterator[tuple[ChannelInfo, int, Any]]:
    """Every message of poses in file order: its channel, when it was logged, and what it says, read by attribute."""
    decoders: dict[int, Callable[[bytes], Any]] = {}
    found = False
    try:
        file = McapFile(source)
        channels = file.catalogue.channels
        if file.own:
            raise ImportFileError(f"{source} is a session already; run `replay run {source}`")
        if file.catalogue.tear is not None:
            raise _unreadable(source, f"it is cut short at byte {file.catalogue.tear}")
        posed = [
            number
            for number, channel in channels.items()
            if _kind(channel) in LAYOUTS and channel.topic in (topics or (channel.topic,))
        ]
        for table in file.tables(*(channels[number].topic for number in posed)):
            for row in table.of_channels({*posed}).tolist():
                number, found = int(table.channel[row]), True
                message = _decoded(source, channels[number], table.payload(row), decoders)
                yield channels[number], int(table.log_ns[row]), message
    except SessionFileError as error:
        raise _unreadable(source, brief(error)) from None
    seen = {channel.topic: channel.schema_name or "no schema" for channel in channels.values()}
    absent = [f"no topic {topic!r}" for topic in topics if topic not in seen]
    absent += [] if found else [f"no message of poses ({', '.join(LAYOUTS)})"]
    if absent:
        words = [f"{topic} ({name})" for topic, name in seen.items()]
        there = ", ".join(words[:NAMED_TOPICS]) + (", ..." if len(words) > NAMED_TOPICS else "")
        raise ImportFileError(f"{source}: {absent[0]}; there are: {there or 'none'}")


def _unreadable(source: Path, why: str) -> ImportFileError:
    return ImportFileError(f"{source} is no whole MCAP file ({why}); record it again, or mend it with `replay recover`")


def _decoded(source: Path, channel: ChannelInfo, data: bytes, decoders: dict[int, Callable[[bytes], Any]]) -> Any:
    number = channel.record.id
    try:
        if number not in decoders:
            decoders[number] = _decoder(channel.record.message_encoding, channel.schema)
        return decoders[number](data)
    except ImportFileError as error:
        raise ImportFileError(f"{source}: {channel.topic}: {error}") from None
    except Exception as error:  # decoders of foreign bytes raise errors of any kind; each means: damaged
        why = str(error).splitlines()[0][:100] if str(error) else type(error).__name__
        raise ImportFileError(
            f"{source}: {channel.topic}: a {channel.schema_name} cannot be read ({why}); "
            "record it again or leave the topic out"
        ) from None


def _decoder(encoding: str, schema: Any) -> Callable[[bytes], Any]:
    if encoding == "protobuf":
        return _protobuf_decoder(schema)
    if encoding == "json":
        return lambda data: json.loads(data, object_hook=lambda given: SimpleNamespace(**given))
    if encoding == "cdr":
        try:
            from mcap_ros2.decoder import DecoderFactory
        except ImportError:
            raise ImportFileError(
                'messages of ROS 2 need mcap-ros2-support; install it: pip install "vrlab-replay[formats]"'
            ) from None
        # Of a schema that it cannot read the library prints lines of its own beside the error.
        with redirect_stderr(StringIO()), redirect_stdout(StringIO()):
            decode = DecoderFactory().decoder_for(encoding, schema)
        if decode is not None:
            return decode
        raise ImportFileError(f"a schema in {schema.encoding!r} is not known; record with schemas in ros2msg")
    raise ImportFileError(f"messages are encoded as {encoding!r}; write protobuf, json or cdr (ROS 2)")


def _protobuf_decoder(schema: Any) -> Callable[[bytes], Any]:
    """By the description that the file carries."""
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name)).FromString
