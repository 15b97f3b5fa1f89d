"""MCAP files of other programs: poses in Foxglove's messages (protobuf or JSON), tf2 and geometry_msgs of ROS 2 (CDR).

Source: Foxglove schemas, https://docs.foxglove.dev/docs/sdk/schemas; ROS 2 common_interfaces; ROS REP 103, REP 105.
"""

import json
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

from sessions.errors import ImportFileError, SessionFileError
from sessions.importers.frame_tree import FrameTree, TransformKind
from sessions.importers.importing import SourceFrame, is_inverse, number, session_of_tables
from sessions.importers.ledger import Ledger
from sessions.importers.wall_clock import wall_clock_ns
from sessions.mcap.container import ChannelInfo
from sessions.mcap.reader import McapFile
from sessions.mcap.refusals import brief
from sessions.mcap.unpacking import MessageTable, read_region, together
from sessions.model.assumption import Confidence
from sessions.model.session import Session

ASSUMED: Final = "ros"
"""Axes where none are named: REP 103 defines those of ROS; programs that write Foxglove's messages may have others."""
OPTICAL: Final = re.compile("_optical(_frame)?$")
"""The end of the name of a camera's frame, whose axes are others by REP 103."""
OPTICAL_AXES: Final = "x right, y down, z forward"
FOXGLOVE: Final = "foxglove."
DIGITS: Final = re.compile("-?[0-9]{1,20}")
NAMED_TOPICS: Final = 8  # Topics that an error names


def read_mcap(
    source: Path,
    *,
    convention: str | None = None,
    rotations: str | None = None,
    topics: Sequence[str] = (),
) -> Session:
    """Every pose in an MCAP file of another program.

    A frame is a body of its name, odometry one of the frame that it places, any other pose one of its topic. Stamps are
    those of the messages.

    Parameters
    ----------
    convention : a name in ``CONVENTIONS``; ``None``: that of ROS.
    rotations : the direction of those of each message, of ``ROTATIONS``; ``None``: that of a pose.
    topics : read these alone; none: all that hold poses. Of several whose poses are in frames that no transform joins,
        the frames are taken for one world.

    Raises ``ImportFileError``: names file, topic and what to do.
    """
    ledger = Ledger(source)
    tree = FrameTree(ledger, inverse_rotations=is_inverse(rotations))
    messages = _PoseMessages(source, topics)
    sizes = dict[str, int]()
    for channel, log_ns, message in messages:
        _check_size(source, channel, message, sizes)
        _add(source, channel, log_ns, message, tree)
    messages.account(ledger)
    tables, notes, joined = tree.tables(join=len(topics) > 1)
    notes += messages.unread_topics()
    arrays = [topic for topic, count in sizes.items() if count > 1]
    if arrays:
        joined = [*joined, f"a pose of {', '.join(arrays)} taken to be of the body of its index in the array"]
    confidence = Confidence.SURE if messages.are_of_ros else Confidence.OPEN
    usual = ASSUMED
    if tree.roots and all(map(OPTICAL.search, tree.roots)):
        usual, confidence = OPTICAL_AXES, Confidence.OPEN
    frame = SourceFrame.in_axes(convention, usual, "", "stamps of the messages, ns", joined, confidence)
    return session_of_tables(tables, frame, ledger, notes)


FRAMES: Final = ("FrameTransform", "FrameTransforms", "TransformStamped", "TFMessage")
ODOMETRY: Final = "Odometry"
POSES: Final = ("PoseInFrame", "PosesInFrame", "PoseStamped", "PoseWithCovarianceStamped", "PoseArray", ODOMETRY)
"""Last words of the names of schemas: frames that bear their own names, and poses that are named after their topic."""


def _check_size(source: Path, channel: ChannelInfo, message: Any, sizes: dict[str, int]) -> None:
    """Refuse arrays of poses that get shorter: the pose of a body then has the place of another one.

    ``sizes``: topic -> poses of its longest array so far. An empty array, of a moment when nothing was seen, is none.
    """
    poses: Any = None if _kind(channel) in FRAMES else _first_field(message, "poses")
    count = len(poses) if hasattr(poses, "__len__") else 0
    longest = max(count, sizes.get(channel.topic, 0))
    if 0 < count < longest:
        raise ImportFileError(
            f"{source}: {channel.topic}: its arrays get shorter, from {longest:,} poses to {count:,}, so that nobody "
            "knows which body a pose is of; record a topic for each body, or choose others by --topic"
        )
    sizes[channel.topic] = longest


def _add(source: Path, channel: ChannelInfo, log_ns: int, message: Any, tree: FrameTree) -> None:
    """Hang the poses of a message into the tree."""
    are_frames = _kind(channel) in FRAMES
    topic = channel.topic.strip("/") or "pose"
    rows = _first_field(message, "transforms", "poses")
    for index, row in enumerate([message] if rows is None else rows if hasattr(rows, "__len__") else ()):
        head = row if are_frames else message
        head = _first_field(head, "header") or head  # of ROS
        pose = _first_field(row, "transform", "pose") or row
        pose = _first_field(pose, "pose") or pose  # with covariance
        try:
            stamp = _stamp_of(_first_field(head, "timestamp", "stamp"))
        except ValueError as error:
            raise ImportFileError(f"{source}: {channel.topic}: {error}") from None
        components = (
            (_first_field(pose, "translation", "position"), "xyz"),
            (_first_field(pose, "rotation", "orientation"), "xyzw"),
        )
        numbers = [number(_first_field(vector, axis)) for vector, axes in components for axis in axes]
        name = _first_field(row, "child_frame_id") if are_frames else topic if rows is None else f"{topic}/{index}"
        parent = _first_field(head, "parent_frame_id", "frame_id")
        parent, name = (value if isinstance(value, str) else "" for value in (parent, name))
        kind = TransformKind.STATIC if channel.topic.endswith("tf_static") else TransformKind.MOVING
        placed = _first_field(message, "child_frame_id") if _kind(channel) == ODOMETRY else ""
        if isinstance(placed, str) and placed.strip("/") not in ("", parent.strip("/")):
            name, kind = placed, TransformKind.ODOMETRY
        elif not are_frames and name == parent.strip("/"):
            name = f"{name} pose"  # a topic may bear the name of the frame that its poses are in
        tree.add(parent, name, stamp, log_ns, numbers, topic=channel.topic, kind=kind)


def _kind(channel: ChannelInfo) -> str:
    """The last word of the name of its schema."""
    return channel.schema_name.replace("/", ".").rsplit(".", 1)[-1]


def _first_field(value: Any, *names: str) -> Any:
    """The first of these attributes that is there; ``None`` where none is."""
    return next((field for name in names if (field := getattr(value, name, None)) is not None), None)


def _stamp_of(time: Any) -> int | None:
    """Nanoseconds of a timestamp of protobuf, JSON or ROS; ``None`` where it is absent.

    JSON has 64-bit numbers as text, and protobuf's own JSON a timestamp as ISO 8601. ValueError: it is neither.
    """
    if time is None:
        return None
    if isinstance(time, str):
        return wall_clock_ns(time)
    seconds, nanoseconds = _first_field(time, "seconds", "sec"), _first_field(time, "nanos", "nsec", "nanosec")
    if seconds is None and nanoseconds is None:
        raise ValueError(f"a timestamp is {_brief(time)}; write it as sec and nsec")
    whole, remainder = _integer(seconds), _integer(nanoseconds)
    stamp = whole * 1_000_000_000 + remainder
    if whole > 0 and not 0 <= remainder < 1_000_000_000:
        raise ValueError(
            f"a timestamp has {remainder} nanoseconds beside its {whole} seconds; write those of less than a second"
        )
    if stamp < 0:
        raise ValueError(f"a timestamp is {stamp} ns, before 0; correct the stamps")
    return stamp


def _integer(value: Any) -> int:
    """An integer of a decoded message, which may be text; 0 where it is absent. ValueError: it is no integer."""
    if type(value) is int:
        return value
    if value is None:
        return 0
    if isinstance(value, float) and value.is_integer():
        return int(value)
    if isinstance(value, str) and DIGITS.fullmatch(value):
        return int(value)
    raise ValueError(f"{_brief(value)} in a timestamp is no whole number; write whole seconds and nanoseconds")


def _brief(value: Any) -> str:
    """A value as it is printed, not at length and on a line."""
    return ascii(vars(value) if isinstance(value, SimpleNamespace) else value)[:40]


class _PoseMessages:
    """Every message of poses in file order: its channel, when it was logged, and its content, read by attribute.

    What is damaged or cut off is left out and counted.
    """

    def __init__(self, source: Path, topics: Sequence[str]) -> None:
        self._source, self._topics = source, topics
        self._decoders: dict[int, Callable[[bytes], Any]] = {}
        self._damaged: list[SessionFileError] = []
        self._read = 0
        try:
            self._file = McapFile(source, strict=False)
        except SessionFileError as error:
            raise _unreadable(source, brief(error)) from None
        if self._file.own:
            raise ImportFileError(f"{source} is a session already; {self._own_cure}")
        catalogue = self._file.catalogue
        self._damaged += [fault.error for fault in catalogue.faults]
        self._channels = {
            number: channel
            for number, channel in catalogue.channels.items()
            if _kind(channel) in (*FRAMES, *POSES) and (not topics or channel.topic in topics)
        }

    @property
    def are_of_ros(self) -> bool:
        """Whether every channel that is read has messages of ROS, whose axes REP 103 defines."""
        return all(not channel.schema_name.startswith(FOXGLOVE) for channel in self._channels.values())

    @property
    def _own_cure(self) -> str:
        """How to go on with a session of ours."""
        source = self._source
        is_torn = self._file.catalogue.tear is not None
        return f"save what is there: replay recover {source} NEW.mcap" if is_torn else f"run `replay run {source}`"

    def __iter__(self) -> Iterator[tuple[ChannelInfo, int, Any]]:
        for table in together(self._regions()):
            for row in table.of_channels({*self._channels}).tolist():
                channel = self._channels[int(table.channel[row])]
                message = _decode_message(self._source, channel, table.payload(row), self._decoders)
                self._read += 1
                yield channel, int(table.log_ns[row]), message
        self._check_topics()

    def _regions(self) -> Iterator[MessageTable]:
        """The messages of each region that is whole."""
        topics = [channel.topic for channel in self._channels.values()]
        with self._source.open("rb") as stream:
            for region in self._file.regions(*topics):
                try:
                    table = read_region(stream, region, self._file.catalogue)
                except SessionFileError as error:
                    self._damaged.append(error)
                    if error.code == "too-much":
                        raise _unreadable(self._source, brief(error)) from None
                    continue
                yield table

    def unread_topics(self) -> list[str]:
        """A sentence on the topics with messages that hold no poses known here; none where topics were chosen."""
        catalogue = self._file.catalogue
        unread = {
            channel.topic: channel.schema_name or "no schema"
            for number, channel in catalogue.channels.items()
            if number not in self._channels and (catalogue.counted is None or catalogue.counted.get(number, 0))
        }
        if self._topics or not unread:
            return []
        named = ", ".join(f"{topic} ({name})" for topic, name in [*unread.items()][:NAMED_TOPICS])
        more = f" and {len(unread) - NAMED_TOPICS} more" if len(unread) > NAMED_TOPICS else ""
        return [f"topics that are not read: {named}{more}"]

    def account(self, ledger: Ledger) -> None:
        """Book the messages read, and those that the file's statistics count and that could not be read."""
        catalogue = self._file.catalogue
        lost = 0
        if catalogue.counted is not None:
            declared = sum(catalogue.counted.get(number, 0) for number in self._channels)
            lost = max(declared - self._read, 0)
        why = "that are damaged"
        if self._damaged:
            why = f"that are damaged ({brief(self._damaged[0])})"
            lost = max(lost, len(self._damaged))
        ledger.book("messages", read=self._read + lost, kept=self._read, dropped={why: lost})
        if catalogue.tear is not None:
            cut = {f"cut off at byte {catalogue.tear:,}, and perhaps more": 1}
            ledger.book("messages", "the end of the file", read=1, kept=0, dropped=cut)

    def _check_topics(self) -> None:
        """Refuse a file without a message of poses, or without a topic that was named."""
        catalogue = self._file.catalogue
        schemas = {channel.topic: channel.schema_name or "no schema" for channel in catalogue.channels.values()}
        absent = [topic for topic in self._topics if topic not in schemas]
        if self._read and not absent:
            return
        what = f"no topic {absent[0]!r}" if absent else f"no message of poses ({', '.join((*FRAMES, *POSES))})"
        present = ", ".join(f"{topic} ({name})" for topic, name in [*schemas.items()][:NAMED_TOPICS])
        message = f"{self._source}: {what}; there are: {present or 'none'}"
        if self._damaged:
            message = f"{message}; and it is damaged: {brief(self._damaged[0])}; record it again"
        elif catalogue.tear is not None:
            message = f"{message}; and it is cut short at byte {catalogue.tear:,}; record it again"
        raise ImportFileError(message)


def _unreadable(source: Path, why: str) -> ImportFileError:
    return ImportFileError(f"{source} is no MCAP file that can be read ({why}); record it again")


def _decode_message(
    source: Path, channel: ChannelInfo, data: bytes, decoders: dict[int, Callable[[bytes], Any]]
) -> Any:
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
