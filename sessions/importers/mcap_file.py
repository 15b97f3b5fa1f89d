"""MCAP files of other programs: poses in Foxglove's messages (protobuf or JSON), tf2 and geometry_msgs of ROS 2 (CDR).

Source: Foxglove schemas, https://docs.foxglove.dev/docs/sdk/schemas; ROS 2 common_interfaces; ROS REP 103, REP 105.
"""

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

from sessions.errors import ImportFileError, SessionFileError
from sessions.importers.frame_tree import FrameTree
from sessions.importers.pose_table import SourceFrame, imported, number
from sessions.mcap_format.catalogue import ChannelInfo
from sessions.mcap_format.mcap_file import McapFile
from sessions.mcap_format.refusals import brief
from sessions.model.session import Session

ASSUMED: Final = "ros"
"""Axes where none are named: Foxglove and ROS both follow REP 103."""
NAMED_TOPICS: Final = 8  # Topics that an error names


def read_mcap(
    source: Path,
    *,
    convention: str | None = None,
    topics: Sequence[str] = (),
) -> Session:
    """Every pose in an MCAP file of another program.

    A frame is a body of its name, a pose one of its topic. Stamps are those of the messages.

    Parameters
    ----------
    convention : a name in ``CONVENTIONS``; ``None``: that of ROS.
    topics : read these alone; none: all that hold poses. Of several whose poses are in frames that no transform joins,
        the frames are taken for one world.

    Raises ``ImportFileError``: names file, topic and what to do.
    """
    tree, unstamped = FrameTree(str(source)), 0
    for channel, log_ns, message in _messages(source, topics):
        unstamped += _add(channel, log_ns, message, tree)
    tables, words, joined = tree.tables(join=len(topics) > 1)
    if unstamped:
        words.append(f"{unstamped} poses without a stamp have the time they were logged at")
    frame = SourceFrame.in_axes(convention, ASSUMED, "m", "stamps of the messages, ns", ["lengths in m", *joined])
    return imported(tables, frame, words)


FRAMES: Final = ("FrameTransform", "FrameTransforms", "TransformStamped", "TFMessage")
POSES: Final = ("PoseInFrame", "PosesInFrame", "PoseStamped", "PoseWithCovarianceStamped", "PoseArray")
"""Last words of the names of schemas: frames that bear their own names, and poses that are named after their topic."""


def _add(channel: ChannelInfo, log_ns: int, message: Any, tree: FrameTree) -> int:
    """Hang the poses of a message into the tree; how many bear no stamp of their own."""
    are_frames, unstamped = _kind(channel) in FRAMES, 0
    topic, static = channel.topic.strip("/") or "pose", channel.topic.endswith("tf_static")
    rows = _part(message, "transforms", "poses")
    for place, row in enumerate([message] if rows is None else rows if hasattr(rows, "__len__") else ()):
        head = row if are_frames else message
        head = _part(head, "header") or head  # of ROS
        pose = _part(row, "transform", "pose") or row
        pose = _part(pose, "pose") or pose  # with covariance
        stamp = _stamp_of(_part(head, "timestamp", "stamp"))
        unstamped += stamp == 0
        parts = (_part(pose, "translation", "position"), "xyz"), (_part(pose, "rotation", "orientation"), "xyzw")
        numbers = [number(_part(part, axis)) for part, axes in parts for axis in axes]
        name = _part(row, "child_frame_id") if are_frames else topic if rows is None else f"{topic}/{place}"
        parent = _part(head, "parent_frame_id", "frame_id")
        parent, name = (value if isinstance(value, str) else "" for value in (parent, name))
        if not are_frames and name == parent.strip("/"):
            name = f"{name} pose"  # a topic may bear the name of the frame that its poses are in
        tree.add(parent, name, stamp or log_ns, numbers, static=static)
    return unstamped


def _kind(channel: ChannelInfo) -> str:
    """The last word of the name of its schema."""
    return channel.schema_name.replace("/", ".").rsplit(".", 1)[-1]


def _part(value: Any, *names: str) -> Any:
    """The first of these attributes that is there; ``None`` where none is."""
    return next((part for name in names if (part := getattr(value, name, None)) is not None), None)


def _stamp_of(time: Any) -> int:
    """Nanoseconds of a timestamp of protobuf, JSON or ROS; 0 where it is absent."""
    parts = []
    for names in (("seconds", "sec"), ("nanos", "nsec", "nanosec")):
        part = _part(time, *names)
        parts.append(part if type(part) is int else 0)
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
            key
            for key, channel in channels.items()
            if _kind(channel) in (*FRAMES, *POSES) and (not topics or channel.topic in topics)
        ]
        for table in file.tables(*(channels[key].topic for key in posed)):
            for row in table.of_channels({*posed}).tolist():
                channel, found = channels[int(table.channel[row])], True
                yield channel, int(table.log_ns[row]), _decoded(source, channel, table.payload(row), decoders)
    except SessionFileError as error:
        raise _unreadable(source, brief(error)) from None
    seen = {channel.topic: channel.schema_name or "no schema" for channel in channels.values()}
    absent = [topic for topic in topics if topic not in seen]
    if absent or not found:
        what = f"no topic {absent[0]!r}" if absent else f"no message of poses ({', '.join((*FRAMES, *POSES))})"
        there = ", ".join(f"{topic} ({name})" for topic, name in [*seen.items()][:NAMED_TOPICS])
        raise ImportFileError(f"{source}: {what}; there are: {there or 'none'}")


def _unreadable(source: Path, why: str) -> ImportFileError:
    return ImportFileError(f"{source} is no whole MCAP file ({why}); record it again, or mend it with `replay recover`")


def _decoded(source: Path, channel: ChannelInfo, data: bytes, decoders: dict[int, Callable[[bytes], Any]]) -> Any:
    key, where = channel.record.id, f"{source}: {channel.topic}"
    try:
        if key not in decoders:
            decoders[key] = _decoder(channel.record.message_encoding, channel.schema, where)
        return decoders[key](data)
    except ImportFileError:
        raise
    except Exception as error:  # decoders of foreign bytes raise errors of any kind; each means: damaged
        why = str(error).splitlines()[0][:100] if str(error) else type(error).__name__
        raise ImportFileError(
            f"{where}: a {channel.schema_name} cannot be read ({why}); record it again or leave the topic out"
        ) from None


def _decoder(encoding: str, schema: Any, where: str) -> Callable[[bytes], Any]:
    if encoding == "protobuf":
        return _protobuf_decoder(schema)
    if encoding == "json":
        return lambda data: json.loads(data, object_hook=lambda given: SimpleNamespace(**given))
    if encoding == "cdr":
        try:
            from mcap_ros2.decoder import DecoderFactory
        except ImportError:
            raise ImportFileError(
                f'{where}: messages of ROS 2 need mcap-ros2-support; install it: pip install "vrlab-replay[formats]"'
            ) from None
        # Of a schema that it cannot read the library prints lines of its own beside the error.
        with redirect_stderr(StringIO()), redirect_stdout(StringIO()):
            decode = DecoderFactory().decoder_for(encoding, schema)
        if decode is not None:
            return decode
        raise ImportFileError(f"{where}: a schema in {schema.encoding!r} is not known; record with schemas in ros2msg")
    raise ImportFileError(f"{where}: messages are encoded as {encoding!r}; write protobuf, json or cdr (ROS 2)")


def _protobuf_decoder(schema: Any) -> Callable[[bytes], Any]:
    """By the description that the file carries."""
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name)).FromString
