"""Messages of a foreign MCAP file one by one, in file order: protobuf, JSON, or CDR of ROS 2; all read by attribute."""

import json
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final, NamedTuple

from sessions.errors import ImportFileError

NAMED_TOPICS: Final = 8  # Topics that an error names before it ends in dots


class Received(NamedTuple):
    """One message: its topic, the last word of its schema's name, when it was logged, what it says."""

    topic: str
    kind: str
    log_ns: int
    message: Any


def received(source: Path, kinds: Sequence[str], topics: Sequence[str]) -> Iterator[Received]:
    """Every message of these kinds; ``topics``: of these topics alone, where any is named.

    Raises ``ImportFileError``: a file that is no MCAP, damaged or cut short; a message that cannot be read; no message
    of these kinds, or a topic that is not there: names the topics there are.
    """
    from mcap.records import Channel, Header, Message, Schema

    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    decoders: dict[int, Callable[[bytes], Any]] = {}
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
            kind = _kind(schemas.get(channel.schema_id))
            if kind in kinds and channel.topic in (topics or (channel.topic,)):
                found = True
                content = _decoded(source, schemas[channel.schema_id], channel, record.data, decoders)
                yield Received(channel.topic, kind, record.log_time, content)
    seen = {one.topic: getattr(schemas.get(one.schema_id), "name", "no schema") for one in channels.values()}
    absent = [topic for topic in topics if topic not in seen]
    if absent or not found:
        words = [f"{topic} ({name})" for topic, name in seen.items()]
        listed = ", ".join(words[:NAMED_TOPICS]) + ", ..." * (len(words) > NAMED_TOPICS)
        what = f"no topic {absent[0]!r}" if absent else f"no message of poses ({', '.join(kinds)})"
        raise ImportFileError(f"{source}: {what}; there are: {listed or 'none'}")


def _records(source: Path) -> Iterator[Any]:
    from mcap.stream_reader import StreamReader

    try:
        with source.open("rb") as stream:
            yield from StreamReader(stream, validate_crcs=True).records
    except Exception as error:  # the reader of a foreign file raises errors of any kind; each means: damaged
        raise ImportFileError(
            f"{source} is no whole MCAP file ({_why(error)}); record it again, or mend it with `replay recover`"
        ) from None


def _decoded(source: Path, schema: Any, channel: Any, data: bytes, decoders: dict[int, Callable[[bytes], Any]]) -> Any:
    try:
        if channel.id not in decoders:
            decoders[channel.id] = _decoder(channel.message_encoding, schema)
        return decoders[channel.id](data)
    except ImportFileError as error:
        raise ImportFileError(f"{source}: {channel.topic}: {error}") from None
    except Exception as error:  # decoders of foreign bytes raise errors of any kind; each means: damaged
        raise ImportFileError(
            f"{source}: {channel.topic}: a {schema.name} cannot be read ({_why(error)}); "
            "record it again or leave the topic out"
        ) from None


def _decoder(encoding: str, schema: Any) -> Callable[[bytes], Any]:
    if encoding == "protobuf":
        kind = _kind(schema)
        return getattr(import_module(f"foxglove_schemas_protobuf.{kind}_pb2"), kind).FromString
    if encoding == "json":
        return _read_json
    if encoding == "cdr":
        try:
            from mcap_ros2.decoder import DecoderFactory
        except ImportError:
            raise ImportFileError(
                'messages of ROS 2 need mcap-ros2-support; install it: pip install -e ".[formats]"'
            ) from None
        decode = DecoderFactory().decoder_for(encoding, schema)
        if decode is not None:
            return decode
        raise ImportFileError(f"a schema in {schema.encoding!r} is not known; record with schemas in ros2msg")
    raise ImportFileError(f"messages are encoded as {encoding!r}; write protobuf, json or cdr (ROS 2)")


def _kind(schema: Any) -> str:
    return "" if schema is None else str(schema.name).replace("/", ".").rsplit(".", 1)[-1]


def _why(error: Exception) -> str:
    return str(error).splitlines()[0][:100] if str(error) else type(error).__name__


def _read_json(data: bytes) -> SimpleNamespace:
    value = json.loads(data, object_hook=lambda given: SimpleNamespace(**given))
    if not isinstance(value, SimpleNamespace):
        raise ValueError("it is no object")
    return value
