"""Messages of a foreign MCAP file one by one, in file order: protobuf, JSON, or CDR of ROS 2; all read by attribute.

Of a decoded message what is missing is NaN or "".
"""

import json
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import nullcontext, redirect_stderr, redirect_stdout, suppress
from importlib import import_module
from io import StringIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final, NamedTuple

from sessions.errors import ImportFileError, SessionFileError
from sessions.mcap_format.catalogue import ChannelInfo
from sessions.mcap_format.mcap_file import McapFile
from sessions.mcap_format.refusals import brief
from sessions.mcap_format.unpacking import MessageTable

LONGEST_READING: Final = 4096  # Bytes; a longer message is a picture or a cloud of points and holds no single number
NAMED_TOPICS: Final = 8  # Topics that an error names before it ends in dots


Decoders = dict[int, Callable[[bytes], Any]]


class Received(NamedTuple):
    """One message: its topic, the last word of its schema's name, when it was logged, what it says."""

    topic: str
    kind: str
    log_ns: int
    message: Any


def received(source: Path, kinds: Sequence[str], topics: Sequence[str]) -> Iterator[Received]:
    """Every message of these kinds, and short ones of other kinds as kind ``""``, where they can be read.

    ``topics``: of these topics alone, where any is named.

    Raises ``ImportFileError``: a file that is no MCAP, damaged or cut short; a message that cannot be read; no message
    of these kinds, or a topic that is not there: names the topics there are.
    """
    decoders: Decoders = {}
    found = False
    try:
        file = McapFile(source)
    except SessionFileError as error:
        raise _unreadable(source, brief(error)) from None
    if file.own:
        raise ImportFileError(f"{source} is a session already; run `replay run {source}`")
    if file.catalogue.tear is not None:
        raise _unreadable(source, f"it is cut short at byte {file.catalogue.tear}")
    for table in _tables(file):
        for row, number in enumerate(table.channel.tolist()):
            channel = file.catalogue.channels.get(number)
            if channel is not None and channel.topic in (topics or (channel.topic,)):
                kind = _kind(channel.schema) if _kind(channel.schema) in kinds else ""
                found |= bool(kind)
                record = int(table.log_ns[row]), table.payload(row)
                yield from _message(source, kind, channel, record, decoders)
    channels = file.catalogue.channels.values()
    seen = {channel.topic: channel.schema_name or "no schema" for channel in channels}
    absent = [f"no topic {topic!r}" for topic in topics if topic not in seen]
    absent += [] if found else [f"no message of poses ({', '.join(kinds)})"]
    if absent:
        words = [f"{topic} ({name})" for topic, name in seen.items()]
        there = ", ".join(words[:NAMED_TOPICS]) + ", ..." * (len(words) > NAMED_TOPICS)
        raise ImportFileError(f"{source}: {absent[0]}; there are: {there or 'none'}")


def _message(
    source: Path, kind: str, channel: ChannelInfo, record: tuple[int, bytes], decoders: Decoders
) -> Iterator[Received]:
    """The message, decoded; one that holds no pose where it is short and can be read."""
    log_ns, data = record
    if kind or len(data) <= LONGEST_READING:
        with nullcontext() if kind else suppress(ImportFileError):
            yield Received(channel.topic, kind, log_ns, _decoded(source, channel, data, decoders))


def _tables(file: McapFile) -> Iterator[MessageTable]:
    """The messages of every region, in file order."""
    try:
        yield from file.read(file.catalogue.regions)
    except SessionFileError as error:
        raise _unreadable(file.path, brief(error)) from None


def _unreadable(source: Path, why: str) -> ImportFileError:
    return ImportFileError(f"{source} is no whole MCAP file ({why}); record it again, or mend it with `replay recover`")


def _decoded(source: Path, channel: ChannelInfo, data: bytes, decoders: Decoders) -> Any:
    number = channel.record.id
    try:
        if number not in decoders:
            decoders[number] = _decoder(channel.record.message_encoding, channel.schema)
        return decoders[number](data)
    except ImportFileError as error:
        raise ImportFileError(f"{source}: {channel.topic}: {error}") from None
    except Exception as error:  # decoders of foreign bytes raise errors of any kind; each means: damaged
        raise ImportFileError(
            f"{source}: {channel.topic}: a {channel.schema_name or 'message'} cannot be read ({_why(error)}); "
            "record it again or leave the topic out"
        ) from None


def _decoder(encoding: str, schema: Any) -> Callable[[bytes], Any]:
    if encoding == "protobuf":
        kind = _kind(schema)
        if schema.name.startswith("foxglove."):
            return getattr(import_module(f"foxglove_schemas_protobuf.{kind}_pb2"), kind).FromString
        return _described(schema)
    if encoding == "json":
        return _read_json
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


def _described(schema: Any) -> Callable[[bytes], Any]:
    """A decoder of a protobuf message by the description that the file carries."""
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name)).FromString


def _kind(schema: Any) -> str:
    return "" if schema is None else str(schema.name).replace("/", ".").rsplit(".", 1)[-1]


def _why(error: Exception) -> str:
    return str(error).splitlines()[0][:100] if str(error) else type(error).__name__


def _read_json(data: bytes) -> SimpleNamespace:
    value = json.loads(data, object_hook=lambda given: SimpleNamespace(**given))
    if not isinstance(value, SimpleNamespace):
        raise ValueError("it is no object")
    return value


def number(value: Any) -> float:
    """A number as float64; NaN where it is none."""
    fits = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300
    return float(value) if fits else math.nan


def numbers_of(value: Any, names: Iterable[str]) -> list[float]:
    """Some attributes as numbers."""
    return [number(getattr(value, name, None)) for name in names]


def text(value: Any) -> str:
    """A text; "" where it is none."""
    return value if isinstance(value, str) else ""


def listed(value: Any) -> list[Any]:
    """The entries of a list; none where it is no list."""
    return [] if isinstance(value, str) or not hasattr(value, "__len__") else list(value)


def part(value: Any, path: str) -> Any:
    """The attribute that dots lead to; ``None`` where it is absent."""
    for name in path.split("."):
        value = getattr(value, name, None)
    return value


def stamp_of(time: Any) -> int:
    """Nanoseconds of a timestamp of protobuf, JSON or ROS; 0 where it is absent."""
    parts = []
    for names in (("seconds", "sec"), ("nanos", "nsec", "nanosec")):
        values = (getattr(time, name, None) for name in names)
        parts.append(next((value for value in values if type(value) is int), 0))
    return parts[0] * 1_000_000_000 + parts[1]
