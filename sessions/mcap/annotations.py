"""Events, intervals, live contacts, hands, faster tracks, gaze and scalars as messages, and back without loss.

Each ``*_message`` gives (topic, publish_ns, payload); each ``read_*`` takes the payloads of one topic.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.Log_pb2 import Log

from sessions.errors import SessionFileError
from sessions.mcap import schemas
from sessions.mcap.frame_codec import SECOND_NS, check_stamp
from sessions.model.event import PHASES, Event, Interval, LiveContact
from sessions.model.session import GazeTrack, HandTrack, ScalarTrack, Track

Message = tuple[str, int, bytes]
LEVELS = ("", "debug", "info", "warning", "error", "fatal")
UNCLOSED = "unclosed"  # Key in an interval's data that says its end was never recorded
# One message of a stream of samples carries this many: 0.25 s at 1 kHz.
BATCH = 256


def stamp_ns(stamp: Any) -> int:
    """A protobuf Timestamp as nanoseconds."""
    return int(stamp.seconds) * SECOND_NS + int(stamp.nanos)


def _message(topic: str, time_ns: int, message: Any) -> Message:
    check_stamp(f"something on {topic} is", time_ns)
    return topic, time_ns, bytes(message.SerializeToString(deterministic=True))


def event_message(event: Event) -> Message:
    """An event as ``foxglove.Log``: ``name`` is the body, ``file`` the event's name, ``message`` both words."""
    if event.level not in LEVELS[1:]:
        raise SessionFileError(f"event {event.name!r} has level {event.level!r}; use one of: {', '.join(LEVELS[1:])}")
    text = f"{event.name}: {event.message}" if event.message else event.name
    log = Log(message=text, name=event.body, file=event.name)
    log.level = Log.Level.ValueType(LEVELS.index(event.level))
    log.timestamp.FromNanoseconds(event.time_ns)
    return _message(schemas.EVENTS, event.time_ns, log)


def read_event(payload: bytes, publish_ns: int) -> Event:
    """An event; a remark that another program wrote keeps its words as they are."""
    log = Log.FromString(payload)
    time_ns = stamp_ns(log.timestamp) if log.HasField("timestamp") else publish_ns
    level = LEVELS[log.level] if 0 < log.level < len(LEVELS) else "info"
    if log.message == log.file:
        return Event(time_ns, log.file, "", log.name, level)
    if log.message.startswith(f"{log.file}: "):
        return Event(time_ns, log.file, log.message[len(log.file) + 2 :], log.name, level)
    return Event(time_ns, log.name, log.message, "", level)


def interval_message(interval: Interval, *, closed: bool = True) -> Message:
    """An interval; one that is not closed has no end yet and is superseded by the closed one that follows."""
    if interval.end_ns < interval.start_ns:
        raise SessionFileError(
            f"{interval.kind} {interval.name!r} ends at {interval.end_ns} ns, before its start at "
            f"{interval.start_ns} ns; swap the two"
        )
    message = schemas.message_class("Interval")(kind=interval.kind, name=interval.name)
    message.start.FromNanoseconds(interval.start_ns)
    if closed:
        message.end.FromNanoseconds(interval.end_ns)
    for key, value in interval.data.items():
        message.data.add(key=key, value=value)
    return _message(schemas.INTERVALS, interval.start_ns, message)


def read_intervals(payloads: Iterable[bytes], last_ns: int) -> tuple[Interval, ...]:
    """Intervals in the order they began; one whose end is missing lasts to ``last_ns`` and says so."""
    intervals: dict[tuple[int, str, str, int], Interval] = {}
    closed: dict[tuple[int, str, str], int] = {}
    for payload in payloads:
        message = schemas.message_class("Interval").FromString(payload)
        start, end = stamp_ns(message.start), stamp_ns(message.end)
        data = {fact.key: fact.value for fact in message.data}
        what = (start, message.kind, message.name)
        # A message without an end is replaced by the next one of the same start, kind and name.
        key = (*what, closed.get(what, 0))
        if message.HasField("end"):
            closed[what] = closed.get(what, 0) + 1
        else:
            end, data[UNCLOSED] = max(start, last_ns), "true"
        intervals[key] = Interval(start, end, message.kind, message.name, data)
    return tuple(intervals.values())


def contact_message(contact: LiveContact) -> Message:
    """A report of the live engine as a message."""
    if contact.phase not in PHASES:
        raise SessionFileError(f"a live contact has phase {contact.phase!r}; use one of: {', '.join(PHASES)}")
    bodies = {"body_a": contact.body_a, "body_b": contact.body_b}
    phase = PHASES.index(contact.phase) + 1
    message = schemas.message_class("Contact")(**bodies, phase=phase, point=contact.point or ())
    message.timestamp.FromNanoseconds(contact.time_ns)
    return _message(schemas.LIVE_CONTACTS, contact.time_ns, message)


def read_contact(payload: bytes) -> LiveContact:
    """The report of the live engine in a message; SessionFileError: it holds no known phase or no whole point."""
    message = schemas.message_class("Contact").FromString(payload)
    if not 0 < message.phase <= len(PHASES) or len(message.point) not in (0, 3):
        raise SessionFileError("a message on /contacts/live has no known phase or a point that is not three numbers")
    point = tuple(message.point) or None
    return LiveContact(stamp_ns(message.timestamp), message.body_a, message.body_b, PHASES[message.phase - 1], point)


def _read_hand(payloads: Iterable[bytes]) -> HandTrack:
    """The samples of one hand in order of time; repeats of a stamp are dropped, an unnamed button is released."""
    samples = [schemas.message_class("Hand").FromString(payload) for payload in payloads]
    names = dict.fromkeys(button.name for sample in samples for button in sample.buttons)
    columns = {name: column for column, name in enumerate(names)}
    pressed = np.zeros((len(samples), len(columns)), dtype=np.bool_)
    for row, sample in enumerate(samples):
        for button in sample.buttons:
            pressed[row, columns[button.name]] = button.pressed
    numbers = np.array([(sample.trigger, sample.grip) for sample in samples], dtype=np.float64).reshape(-1, 2)
    times = np.array([stamp_ns(sample.timestamp) for sample in samples], dtype=np.int64)
    stamps, rows = np.unique(times, return_index=True)
    trigger, grip = numbers[rows].T
    return HandTrack(stamps, trigger, grip, tuple(columns), pressed[rows])


Columns = Mapping[str, tuple[str, int]]

_STREAMS: Mapping[str, tuple[Callable[..., Any], Columns]] = {
    schemas.TRACKS_PREFIX: (
        Track,
        {"position": ("positions", 3), "quaternion_xyzw": ("quaternions_xyzw", 4), "valid": ("valid", 1)},
    ),
    schemas.GAZE_PREFIX: (
        GazeTrack,
        {"origin": ("origins", 3), "direction": ("directions", 3), "valid": ("valid", 1), "body": ("bodies", 1)},
    ),
    schemas.SCALARS_PREFIX: (ScalarTrack, {"value": ("values", 1)}),
}
"""Prefix of topics -> class of the stream, and field of its messages -> column and numbers per sample."""

_KINDS: Mapping[str, Any] = {"valid": np.bool_, "body": object}
"""Types of fields that hold no float64."""


def stream_messages(prefix: str, key: str, stream: Any) -> Iterator[Message]:
    """A hand sample by sample; any other stream in batches, each stamped with its first sample."""
    if isinstance(stream, HandTrack):
        numbers = (stream.times_ns.tolist(), stream.trigger.tolist(), stream.grip.tolist(), stream.pressed.tolist())
        for time_ns, trigger, grip, pressed in zip(*numbers, strict=True):
            hand = schemas.message_class("Hand")(trigger=trigger, grip=grip)
            hand.timestamp.FromNanoseconds(time_ns)
            for name, down in zip(stream.buttons, pressed, strict=True):
                hand.buttons.add(name=name, pressed=down)
            yield _message(prefix + key, time_ns, hand)
        return
    columns, unit = _STREAMS[prefix][1], {"unit": stream.unit} if isinstance(stream, ScalarTrack) else {}
    for start in range(0, len(stream), BATCH):
        rows, fields = slice(start, start + BATCH), {}
        for name, (column, _) in columns.items():
            fields[name] = np.array(getattr(stream, column)[rows], dtype=_KINDS.get(name)).reshape(-1).tolist()
        message = schemas.channel_spec(prefix).message(sample_ns=stream.times_ns[rows].tolist(), **fields, **unit)
        yield _message(prefix + key, int(stream.times_ns[start]), message)


def read_stream(prefix: str, payloads: Iterable[bytes]) -> Any:
    """A stream in order of time; repeats of a stamp are dropped."""
    stream = _read_hand(payloads) if prefix == schemas.HANDS_PREFIX else _read_batches(prefix, payloads)
    if len(stream.times_ns) and stream.times_ns[0] < 0:  # no writer can; the span of such stamps may exceed int64
        raise SessionFileError("a sample is stamped before 0; run `replay doctor` on it")
    return stream


def _read_batches(prefix: str, payloads: Iterable[bytes]) -> Any:
    made, columns = _STREAMS[prefix]
    whole = schemas.channel_spec(prefix).message()
    for payload in payloads:
        whole.MergeFromString(payload)
        if any(len(getattr(whole, name)) != width * len(whole.sample_ns) for name, (_, width) in columns.items()):
            kind = whole.DESCRIPTOR.name
            raise SessionFileError(f"a message of {kind} has samples of unequal length; run `replay doctor` on it")
    stamps, rows = np.unique(np.array(whole.sample_ns, dtype=np.int64), return_index=True)
    given: dict[str, Any] = {"unit": whole.unit} if made is ScalarTrack else {}
    for name, (attribute, width) in columns.items():
        values = np.array(getattr(whole, name), dtype=_KINDS.get(name, np.float64))
        given[attribute] = values.reshape(-1, width)[rows] if width > 1 else values[rows]
    return made(stamps, **given)
