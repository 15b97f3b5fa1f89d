"""Messages of a foreign MCAP file one by one, in file order: protobuf, JSON, or CDR of ROS 2; all read by attribute.

Of a decoded message what is missing is NaN or "".
"""

import json
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import nullcontext, redirect_stderr, redirect_stdout, suppress
from dataclasses import replace
from importlib import import_module
from io import StringIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any, BinaryIO, Final, NamedTuple

from sessions.errors import ImportFileError
from sessions.mcap_format.catalogue import MOST_UNPACKED, UNPACKED_PER_BYTE
from sessions.mcap_format.unpacking import unpacked

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
    from mcap.records import Channel, Header, Message, Schema

    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    decoders: Decoders = {}
    found = False
    for record in _records(source):
        if isinstance(record, Header) and record.profile.startswith("vrlab/"):
            raise ImportFileError(f"{source} is a session already; run `replay run {source}`")
        if isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, Channel):
            channels[record.id] = record
        elif isinstance(record, Message) and record.channel_id in channels:
            channel = channels[record.channel_id]
            schema = schemas.get(channel.schema_id)
            if channel.topic in (topics or (channel.topic,)):
                kind = _kind(schema) if _kind(schema) in kinds else ""
                found |= bool(kind)
                yield from _message(source, kind, schema, channel, record, decoders)
    seen = {one.topic: getattr(schemas.get(one.schema_id), "name", "no schema") for one in channels.values()}
    absent = [f"no topic {topic!r}" for topic in topics if topic not in seen]
    absent += [] if found else [f"no message of poses ({', '.join(kinds)})"]
    if absent:
        words = [f"{topic} ({name})" for topic, name in seen.items()]
        there = ", ".join(words[:NAMED_TOPICS]) + ", ..." * (len(words) > NAMED_TOPICS)
        raise ImportFileError(f"{source}: {absent[0]}; there are: {there or 'none'}")


def _message(source: Path, kind: str, schema: Any, channel: Any, record: Any, decoders: Decoders) -> Iterator[Received]:
    """The message, decoded; one that holds no pose where it is short and can be read."""
    if kind or len(record.data) <= LONGEST_READING:
        with nullcontext() if kind else suppress(ImportFileError):
            content = _decoded(source, schema, channel, record.data, decoders)
            yield Received(channel.topic, kind, record.log_time, content)


def _records(source: Path) -> Iterator[Any]:
    """Every record of a file, those of its chunks among them; chunks are unpacked within the bounds of a session's."""
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader, breakup_chunk

    size = source.stat().st_size
    left = MOST_UNPACKED + UNPACKED_PER_BYTE * size
    try:
        with source.open("rb") as stream:
            bounded: Any = _Bounded(stream, size)
            reader = StreamReader(bounded, emit_chunks=True, validate_crcs=True, record_size_limit=size)
            for record in reader.records:
                if not isinstance(record, Chunk):
                    yield record
                    continue
                left -= record.uncompressed_size
                if left < 0:
                    raise ValueError(f"its {size:,} bytes unpack to more than a recording of that size")
                data = unpacked(record.data, record.compression, record.uncompressed_size)
                # What is unpacked already, the library may take apart: it trusts what a chunk declares.
                plain = replace(record, compression="", data=data)
                yield from breakup_chunk(plain, validate_crc=True)
    except Exception as error:  # the reader of a foreign file raises errors of any kind; each means: damaged
        raise ImportFileError(
            f"{source} is no whole MCAP file ({_why(error)}); record it again, or mend it with `replay recover`"
        ) from None


class _Bounded:
    """A stream that gives no more than is there: the library asks for whatever length a record declares."""

    def __init__(self, stream: BinaryIO, size: int) -> None:
        self._stream, self._size = stream, size

    def read(self, count: int) -> bytes:
        return self._stream.read(min(count, self._size))


def _decoded(source: Path, schema: Any, channel: Any, data: bytes, decoders: Decoders) -> Any:
    try:
        if channel.id not in decoders:
            decoders[channel.id] = _decoder(channel.message_encoding, schema)
        return decoders[channel.id](data)
    except ImportFileError as error:
        raise ImportFileError(f"{source}: {channel.topic}: {error}") from None
    except Exception as error:  # decoders of foreign bytes raise errors of any kind; each means: damaged
        raise ImportFileError(
            f"{source}: {channel.topic}: a {getattr(schema, 'name', 'message')} cannot be read ({_why(error)}); "
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
                'messages of ROS 2 need mcap-ros2-support; install it: pip install -e ".[formats]"'
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
