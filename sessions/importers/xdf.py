"""XDF files of the Lab Streaming Layer: streams with a place and a quaternion become bodies, streams of text events.

Every channel of any other stream of numbers becomes a scalar. Clock offsets are applied as pyxdf does. Stamps are not
smoothed. A quaternion is OrientationA (scalar), B, C, D; Confidence 0 means that the object was not seen.

Source: XDF specification, and its wiki, page *MoCap Meta Data*.
"""

import gzip
import logging
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from math import inf
from pathlib import Path
from typing import Any, Final

import numpy as np

from sessions.errors import ImportFileError
from sessions.importers.csv_columns_and_units import (
    LENGTHS,
    PoseColumns,
    convention_key,
    mapping_table,
    pose_columns,
    rotations_key,
)
from sessions.importers.importing import (
    METRES_PER_UNIT,
    PoseTable,
    SourceFrame,
    Stream,
    is_inverse,
    numbered_name,
    session_of_tables,
)
from sessions.importers.ledger import Ledger, Numbers, Stamps, stamps_of
from sessions.input_files import kind_of_file, nearest
from sessions.meshes.conventions import convention as convention_named
from sessions.model.assumption import Confidence
from sessions.model.event import Event
from sessions.model.session import Session

MAGIC: Final = b"XDF:"
NAMED_CHANNELS: Final = 8  # Channels without a role that are named
MOST_UNPACKED, UNPACKED_PER_BYTE = 100_000_000, 50  # Bytes; recordings shrink to a third, zeros to a thousandth
SAMPLES, HEAD_BYTES = b"\x03\x00", 6
"""The tag of a chunk of samples; behind it and the number of the stream a byte says how wide their count is."""
STREAMS_JOINED: Final = "that go on with a stream of the same name"
ASSUMED: Final = "openxr"
UNITY_AXES: Final = "unity"
UNITY: Final = "unity."
"""How the types of streams begin that LSL4Unity sends: of its pose and transform outlets, in Unity's axes."""
UNITY_KINDS: Final = ("position in world space", "quaternion component")
"""Types of channels that LSL4Unity alone sends."""
POSITIONS: Final = ("position", "pos", "position ", "position in world space ")
ROTATIONS: Final = ("orientation", "rot", "orientation ", "quaternion ", "quaternion component ")
ROLES: Final = {
    **{f"{word}{axis}": role for word in POSITIONS for role, axis in enumerate("xyz")},
    **{f"{word}{axis}": role for word in ROTATIONS for role, axis in enumerate("xyzw", start=3)},
    **{f"orientation{letter}": role for role, letter in enumerate("bcda", start=3)},
    "confidence": 7,
}
"""Type of a channel, type and label, or label, in small letters -> its place in x y z qx qy qz qw confidence."""


TYPED: Final = PoseColumns(tuple("xyz"), tuple("xyzw"))
"""What the channels of a body are in the order of ``ROLES``."""


def read_xdf(
    source: Path,
    *,
    convention: str | None = None,
    rotations: str | None = None,
    mapping: str | Path | None = None,
) -> Session:
    """Everything in an XDF file.

    Parameters
    ----------
    convention : axes of its poses, which XDF does not state; ``None``: right-handed, +Y up.
    rotations : their direction, of ``ROTATIONS``; ``None``: the mapping's, else that of a pose.
    mapping : a TOML file that says which channels of which streams are a body; ``None``: what their types say.

    Raises ``ImportFileError``: names file, stream and channel.
    """
    ledger = Ledger(source)
    is_whole = _is_whole(source)
    streams, notes = _streams(source, ledger)
    bodies: dict[str, tuple[_LslStream, list[int], PoseColumns]] = {}
    units: set[str] = set()
    if mapping is None:
        for stream in streams:
            for name, channels in stream.bodies.items():
                body = name if name not in bodies else numbered_name(f"{stream.name}/{name}", bodies)
                if body != name:
                    notes.append(f"{body}: another body of the name {name}, of stream {stream.name!r}")
                bodies[body] = stream, channels, TYPED
                units |= stream.length_units(channels)
    else:
        stated, unit, direction, mapped = read_stream_mapping(mapping)
        convention = convention or stated
        rotations = rotations or direction
        for body, (name, columns) in mapped.items():
            stream = _stream_named(name, streams, source)
            axes = convention_named(convention or (UNITY_AXES if stream.is_unity else ASSUMED))
            ordered = columns.in_order_of(axes, f"{source}: [bodies.{body}]")
            bodies[body] = stream, stream.labelled(ordered), ordered
        stated_units = {unit for stream, channels, _ in bodies.values() for unit in stream.length_units(channels)}
        units = _units_of_mapping(unit, stated_units, source)
    posed = [stream for stream, _, _ in bodies.values()]
    tables = {name: stream.poses(channels, columns) for name, (stream, channels, columns) in bodies.items()}
    if not tables:
        present = [f"{stream.name} ({stream.kind})" for stream in streams]
        raise ImportFileError(
            f"{source}: no stream of type MoCap with PositionX and OrientationA; "
            f"there are: {', '.join(present) or 'none'}"
            "; say which channels are a pose with --mapping FILE"
        )
    notes += _unread_channels(bodies)
    if not is_whole:
        notes.append("the file is cut short or damaged: the last pose of each body is flagged as lost")
        ledger.book("samples", "the end of the file", read=1, kept=0, dropped={"cut off, and perhaps more": 1})
        for table in tables.values():
            assert table.valid is not None
            table.valid[-1:] = False
    lengths = {METRES_PER_UNIT.get(unit or "m") for unit in units}
    if len(lengths) > 1 or None in lengths:
        raise ImportFileError(f"{source}: lengths are in {', '.join(sorted(units))}; record all in one of m, cm, mm")
    kinds = {UNITY_AXES if stream.is_unity else ASSUMED for stream in posed}
    if len(kinds) > 1 and not convention:
        raise ImportFileError(f"{source}: poses of Unity and others are in it; name the axes of all by --convention")
    assumed = list[str]()
    for stream in streams:
        (notes if stream.data["clock_times"] else assumed).append(stream.clock)
    clock = "LSL clock of the recording computer, s"
    confidence = Confidence.SURE if kinds == {UNITY_AXES} else Confidence.OPEN
    frame = SourceFrame.in_axes(convention, min(kinds), max(units), clock, assumed, confidence)
    frame = replace(frame, inverse_rotations=is_inverse(rotations))
    numbers = [number for stream in streams if stream not in posed for number in stream.numbers()]
    events = tuple(event for stream in streams for event in stream.events())
    return replace(session_of_tables(tables, frame, ledger, notes, numbers), events=events)


def _units_of_mapping(unit: str, stated: set[str], source: Path) -> set[str]:
    """The unit of a mapping, or else those that channels state; ImportFileError where they contradict each other."""
    contradicting = sorted(
        other for other in stated if METRES_PER_UNIT.get(other, METRES_PER_UNIT.get(unit)) != METRES_PER_UNIT.get(unit)
    )
    if unit and contradicting:
        raise ImportFileError(
            f'{source}: channels state lengths in {", ".join(contradicting)}, and the mapping says units = "{unit}"; '
            "correct the mapping"
        )
    return {unit} if unit else stated


def _unread_channels(bodies: Mapping[str, "tuple[_LslStream, list[int], PoseColumns]"]) -> Iterator[str]:
    """Sentences on the channels of streams of poses that are no part of a pose."""
    read: dict[str, set[int]] = {}
    streams = {stream.where: stream for stream, _, _ in bodies.values()}
    for stream, channels, _ in bodies.values():
        read.setdefault(stream.where, set()).update(channels)
    for where, stream in streams.items():
        labels = [channel["label"] or channel["type"] for channel in stream.channels]
        unread = [label for number, label in enumerate(labels) if number not in read[where]]
        if unread:
            more = f" and {len(unread) - NAMED_CHANNELS} more" if len(unread) > NAMED_CHANNELS else ""
            named = ", ".join(unread[:NAMED_CHANNELS])
            yield f"stream {stream.name!r}: channels that are not read: {named}{more}"


def _stream_named(name: str, streams: Sequence["_LslStream"], source: Path) -> "_LslStream":
    """The stream that a mapping names; ImportFileError where there is none, or several that are not one recording."""
    named = [stream for stream in streams if stream.name == name]
    if not named:
        raise ImportFileError(f"{source}: no stream {name!r}{nearest(name, [stream.name for stream in streams])}")
    if len(named) > 1:
        raise ImportFileError(
            f"{source}: {len(named)} streams are called {name!r} and differ in channels or overlap in time, so that "
            "they are not one stream that was interrupted; record them under names of their own"
        )
    return named[0]


class _LslStream:
    """A stream as pyxdf reads it: its name, its type, and what its channels are called."""

    def __init__(self, source: Path, data: dict[str, Any]) -> None:
        info = data["info"]
        self.data = data
        self.name, self.kind = _text(info, "name"), _text(info, "type")
        self.where = f"{source}: stream {self.name!r}"
        described = _first(_first(info, "desc"), "channels")
        listed = described.get("channel", []) if isinstance(described, dict) else []
        keys = ("label", "type", "unit", "object", "marker")
        self.channels = [{key: _text(channel, key) for key in keys} for channel in listed]

    @property
    def description(self) -> tuple[object, ...]:
        """All that streams have in common where they are one that was interrupted."""
        info = self.data["info"]
        return self.name, self.kind, _text(info, "source_id"), _text(info, "channel_format"), self.channels

    @property
    def unread(self) -> int:
        """How many samples its footer counts beyond those that could be read; 0 where it has no footer."""
        footer = self.data.get("footer")
        count = _text(footer.get("info"), "sample_count") if isinstance(footer, dict) else ""
        return max(int(count) - len(self.data["time_stamps"]), 0) if count.isdecimal() and len(count) < 10 else 0

    @property
    def interval(self) -> tuple[float, float]:
        """Its first and its last stamp, s."""
        stamps = np.asarray(self.data["time_stamps"], dtype=np.float64)
        return (float(stamps.min()), float(stamps.max())) if len(stamps) else (inf, -inf)

    @property
    def stamps(self) -> Stamps:
        """Nanoseconds, (n,)."""
        return stamps_of(np.asarray(self.data["time_stamps"], dtype=np.float64), 1e9, self.where)

    @property
    def values(self) -> Numbers | None:
        """The samples (n, channels), ``None`` where they are no numbers."""
        values = np.asarray(self.data["time_series"])
        return values.astype(np.float64) if values.dtype.kind in "fiu" and values.ndim == 2 else None

    @property
    def clock(self) -> str:
        """How its clock was brought onto the recorder's."""
        ahead = self.data["clock_values"]
        if not ahead:
            return f"stream {self.name!r}: no clock offsets, so that its clock is taken for the recorder's"
        return f"stream {self.name!r}: {len(ahead)} clock offsets applied, {min(ahead):.6f} to {max(ahead):.6f} s"

    @property
    def is_unity(self) -> bool:
        """Whether LSL4Unity sent it: by its type, or by the types of its channels."""
        kinds = {channel["type"].lower() for channel in self.channels}
        return self.kind.lower().startswith(UNITY) or not kinds.isdisjoint(UNITY_KINDS)

    def length_units(self, channels: Sequence[int]) -> set[str]:
        """The units that the channels of a place state, in small letters; ``""`` of one that states none."""
        return {self.channels[number]["unit"].lower() for number in channels[:3]}

    @cached_property
    def bodies(self) -> dict[str, list[int]]:
        """Each object that has a place and a quaternion: its channels in the order of ``ROLES``.

        Two channels of one role are an error in a stream of poses; any other stream then holds none.
        """
        columns: dict[str, dict[int, int]] = {}
        for number, channel in enumerate(self.channels):
            kind, label = channel["type"].lower(), channel["label"].lower()
            name = channel["object"] or channel["marker"] or self.name
            role = next((ROLES[word] for word in (kind, f"{kind} {label}", label) if word in ROLES), None)
            if role is None or columns.setdefault(name, {}).setdefault(role, number) == number:
                continue
            if self.kind.lower() != "mocap" and not self.is_unity:
                return {}
            what = f"{name!r} has two channels {channel['type']}; name an <object> for each channel"
            raise ImportFileError(f"{self.where}: {what}")
        whole = {name: roles for name, roles in columns.items() if roles.keys() >= {*range(7)}}
        return {name: [roles[role] for role in sorted(roles)] for name, roles in whole.items()}

    def labelled(self, columns: PoseColumns) -> list[int]:
        """The channels that a mapping names."""
        labels = {channel["label"] or str(number): number - 1 for number, channel in enumerate(self.channels, start=1)}
        requested = [label for label in (*columns.numbers, columns.valid) if label]
        for label in requested:
            if label not in labels:
                raise ImportFileError(f"{self.where}: no channel {label!r}{nearest(label, labels)}")
        return [labels[label] for label in requested]

    def poses(self, channels: list[int], columns: PoseColumns) -> PoseTable:
        """A place, a rotation and perhaps a confidence from channels in this order."""
        values = self.values
        if values is None or values.shape[1] <= max(channels):
            why = "its samples are not the numbers its channels describe; record again"
            raise ImportFileError(f"{self.where}: {why}")
        rows, end = values[:, channels], len(columns.numbers)
        valid = rows[:, end] > 0.0 if len(channels) > end else np.ones(len(rows), dtype=np.bool_)
        return PoseTable(self.stamps, rows[:, :3], columns.quaternions(rows[:, 3:end]), valid)

    def numbers(self) -> Iterator[Stream]:
        """Every channel of numbers, by its label."""
        values = self.values
        if values is None or not len(values):
            return
        name, stamps = self.name or "stream", self.stamps
        for number, column in enumerate(values.T):
            channel = self.channels[number] if number < len(self.channels) else {"label": "", "type": "", "unit": ""}
            label = channel["label"] or channel["type"] or str(number + 1)
            yield Stream(f"{name}/{label}" if values.shape[1] > 1 else name, stamps, column, channel["unit"])

    def events(self) -> Iterator[Event]:
        """Every sample of a stream of text."""
        if _text(self.data["info"], "channel_format") == "string":
            for stamp, texts in zip(self.stamps.tolist(), self.data["time_series"], strict=True):
                yield Event(stamp, self.name or "marker", " ".join(filter(None, texts)))


def _first(data: Any, key: str) -> Any:
    """The first element of a name in pyxdf's dictionaries; ``None`` where there is none."""
    value = data.get(key) if isinstance(data, dict) else None
    return value[0] if isinstance(value, list) and value else None


def _text(data: Any, key: str) -> str:
    text = _first(data, key)
    return text.strip() if isinstance(text, str) else ""


def _streams(source: Path, ledger: Ledger) -> tuple[list[_LslStream], list[str]]:
    """Every stream on the recorder's clock, and notes; the parts of one that was interrupted are joined."""
    try:
        from pyxdf import load_xdf
    except ImportError:
        raise ImportFileError('XDF needs pyxdf; install it: pip install "vrlab-replay[formats]"') from None
    _check_size(source)
    heard: list[int] = []
    logger = logging.getLogger("pyxdf.pyxdf")

    def is_printed(record: logging.LogRecord) -> bool:
        heard.append(record.levelno)
        return False

    logger.addFilter(is_printed)
    try:
        streams, _ = load_xdf(str(source), dejitter_timestamps=False)
    except Exception as error:  # the reader of a foreign file raises errors of any kind; each means: damaged
        if kind := kind_of_file(source):
            raise ImportFileError(f"{source} is no XDF file that can be read but {kind}") from None
        why = str(error).splitlines()[0][:100] if str(error) else type(error).__name__
        raise ImportFileError(f"{source} is no whole XDF file ({why}); record it again") from None
    finally:
        logger.removeFilter(is_printed)
    skipped = sum(level >= logging.ERROR for level in heard)  # a remark about segments is no damage
    if skipped:
        why = "in places of the file that could not be read, and perhaps more"
        ledger.book("samples", "damaged places", read=skipped, kept=0, dropped={why: skipped})
    notes = list[str]()
    return _joined_streams([_LslStream(source, stream) for stream in streams], source, ledger, notes), notes


def _joined_streams(streams: list[_LslStream], source: Path, ledger: Ledger, notes: list[str]) -> list[_LslStream]:
    """Streams with the parts of each one that was interrupted joined: all of one description, one after the other.

    A recorder writes a stream that comes back as another stream of the same name. Streams that overlap in time stay
    apart: they were sent at once.
    """
    groups: list[list[_LslStream]] = []
    for stream in streams:
        alike = next((group for group in groups if group[0].description == stream.description), None)
        if alike is None:
            groups.append([stream])
        else:
            alike.append(stream)
    joined = []
    for group in groups:
        lost = sum(stream.unread for stream in group)
        why = "that the stream's footer counts and that could not be read"
        ledger.book("samples", f"stream {group[0].name}", read=lost, kept=0, dropped={why: lost})
        group.sort(key=lambda stream: stream.interval)
        disjoint = all(before.interval[1] < after.interval[0] for before, after in pairwise(group))
        samples = sum(len(stream.data["time_stamps"]) for stream in group)
        if len(group) == 1 or not disjoint:
            joined += group
        else:
            joined.append(_LslStream(source, _concatenated_data([stream.data for stream in group])))
            notes.append(f"stream {group[0].name!r}: {len(group)} parts of {samples:,} samples joined")
        merged = {STREAMS_JOINED: len(group) - 1} if disjoint else {}
        ledger.book("streams", read=len(group), kept=len(group) - sum(merged.values()), merged=merged)
    return joined


def _concatenated_data(streams: list[dict[str, Any]]) -> dict[str, Any]:
    """The data of streams one after the other, as pyxdf holds them."""
    series = [stream["time_series"] for stream in streams if len(stream["time_series"])]
    is_text = any(isinstance(values, list) for values in series)
    return {
        **streams[0],
        "time_stamps": np.concatenate([stream["time_stamps"] for stream in streams]),
        "time_series": [row for values in series for row in values] if is_text else np.concatenate(series),
        "clock_times": [time for stream in streams for time in stream["clock_times"]],
        "clock_values": [value for stream in streams for value in stream["clock_values"]],
    }


def _check_size(source: Path) -> None:
    """Refuse a compressed file of a megabyte that would be read for hours."""
    most = MOST_UNPACKED + UNPACKED_PER_BYTE * source.stat().st_size
    # What is not compressed, or damaged, the reader of the format names.
    with suppress(OSError, EOFError, zlib.error), gzip.open(source) as unpacked:
        if unpacked.seek(most + 1) > most:
            what = f"{source} unpacks to more than {most:,} bytes, as no recording does"
            raise ImportFileError(f"{what}; unpack it with gzip -d to import it all the same")


def _is_whole(source: Path) -> bool:
    """Whether the last chunk ends with the file. Of one cut short pyxdf fills the last sample with older bytes.

    Raises ``ImportFileError``: a chunk claims more samples than the file has bytes; pyxdf would make room for them all.
    """
    size = source.stat().st_size
    with source.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:  # compressed: the reader notices
            return True
        while width := file.read(1):
            length = file.read(width[0])
            start = file.tell()
            head, width_of_count = file.read(HEAD_BYTES), file.read(1)
            claimed = int.from_bytes(file.read(max(width_of_count, default=0)), "little")
            if head.startswith(SAMPLES) and claimed > size:
                what = f"a chunk claims {claimed:,} samples of at least a byte"
                raise ImportFileError(f"{source} is no whole XDF file ({what}); record it again")
            end = start + int.from_bytes(length, "little")
            if end > size or len(length) < width[0]:
                return False
            file.seek(end)
    return True


def read_stream_mapping(path: str | Path) -> tuple[str, str, str, dict[str, tuple[str, PoseColumns]]]:
    """Axes, unit, direction of rotations, and of each body its stream and the labels of its channels.

    Raises ImportFileError: all faults at once.
    """
    with mapping_table(path) as whole:
        bodies = {
            name: (table.text("stream", None), pose_columns(table))
            for name, table in whole.named_tables("bodies").items()
        }
        if not bodies:
            whole.refuse("give [bodies.NAME] with stream, position and a rotation for every body")
        return convention_key(whole), whole.text("units", "", LENGTHS), rotations_key(whole), bodies
