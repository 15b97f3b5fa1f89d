"""XDF files of the Lab Streaming Layer: streams of MoCap or LSL4Unity become bodies, of Gaze gaze, of text events.

Every channel of any other stream of numbers becomes a scalar.

Clock offsets are applied as pyxdf does; how far they are from a straight line is said per stream. Stamps are not
smoothed. A quaternion is OrientationA (scalar), B, C, D; Confidence 0 means that the object was not seen.

Source: XDF specification, and its wiki, pages *MoCap Meta Data* and *Gaze Meta-Data*.
"""

import gzip
import logging
import zlib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from sessions.errors import ImportFileError
from sessions.importers.csv_mapping import METRES, PoseColumns, pose_columns
from sessions.importers.finish import Imported
from sessions.importers.joining import ClockFit
from sessions.importers.pose_table import (
    BesidePoses,
    Numbers,
    PoseTable,
    SourceFrame,
    Stamps,
    imported,
    stamps_of,
)
from sessions.input_files import read_text
from sessions.meshes.conventions import CONVENTIONS
from sessions.meshes.conventions import convention as convention_named
from sessions.model.event import Event
from sessions.scene_files.toml_table import nearest, parse_toml

MAGIC: Final = b"XDF:"
MOST_UNPACKED, UNPACKED_PER_BYTE = 100_000_000, 50  # Bytes; recordings shrink to a third, zeros to a thousandth
ASSUMED: Final = "openxr"
ROLES: Final = {
    "positionx": 0, "positiony": 1, "positionz": 2, "orientationb": 3, "orientationc": 4, "orientationd": 5,
    "orientationa": 6, "orientationx": 3, "orientationy": 4, "orientationz": 5, "orientationw": 6, "confidence": 7,
}  # fmt: skip
"""Type of a channel in small letters -> its place in x y z qx qy qz qw confidence."""

UNITY: Final = "unity."
"""How the types of streams begin that LSL4Unity sends: of its pose and transform outlets, in Unity's axes."""

UNITY_ROLES: Final = {
    **{("", f"pos{axis}"): place for place, axis in enumerate("xyz")},
    **{("", f"rot{axis}"): 3 + place for place, axis in enumerate("xyzw")},
    **{("position in world space", axis): place for place, axis in enumerate("xyz")},
    **{("quaternion component", axis): 3 + place for place, axis in enumerate("xyzw")},
    **{("position", axis): place for place, axis in enumerate("xyz")},
    **{(kind, axis): 3 + place for kind in ("quaternion", "orientation") for place, axis in enumerate("xyzw")},
}
"""Type and label of a channel in small letters, as LSL4Unity and others send, or its label alone -> as in ``ROLES``."""

UNITY_KINDS: Final = frozenset(("position in world space", "quaternion component"))
"""Types of channels that LSL4Unity alone sends."""

RAY: Final = ("positionx", "positiony", "positionz", "directionx", "directiony", "directionz")
"""Types of the channels of an eye, in small letters."""

UNITS: Final = {"meters": "m", "meter": "m", "metres": "m", "centimeters": "cm", "millimeters": "mm", "": "m"}

KEYS: Final = ("label", "type", "unit", "object", "marker", "eye")
"""Elements of a channel that are looked at."""


def read_xdf(source: Path, *, convention: str | None = None, mapping: str | Path | None = None) -> Imported:
    """Everything in an XDF file.

    Parameters
    ----------
    convention : axes of its poses, which XDF does not state; ``None``: right-handed, +Y up.
    mapping : a TOML file that says which channels of which streams are a body; ``None``: what their types say.

    Raises ``ImportFileError``: names file, stream and channel.
    """
    streams, notes = _streams(source)
    whole = _is_whole(source)
    if not whole:
        notes.append("the file is cut short or damaged: the last pose of each body is flagged as lost")
    if mapping is None:
        posed = [stream for stream in streams if stream.holds_poses]
        tables, units = _tables(posed)
    else:
        plan, tables = read_stream_mapping(mapping), dict[str, PoseTable]()
        convention, units = convention or plan.convention, {plan.units}
        posed = [plan.put_into(tables, body, source, streams) for body in plan.bodies]
    if not tables:
        seen = [f"{stream.name} ({_text(stream.data['info'], 'type')})" for stream in streams]
        raise ImportFileError(
            f"{source}: no stream of type MoCap with PositionX and OrientationA; there are: {', '.join(seen) or 'none'}"
            "; say which channels are a pose with --mapping FILE"
        )
    for table in tables.values():
        if table.valid is not None:
            table.valid[-1:] &= whole
    lengths = {UNITS.get(unit, unit) for unit in units}
    if len(lengths) > 1 or not lengths <= METRES.keys():
        raise ImportFileError(f"{source}: lengths are in {', '.join(sorted(units))}; record all in one of m, cm, mm")
    kinds = {"unity" if stream.is_unity else ASSUMED for stream in posed}
    if len(kinds) > 1 and not convention:
        raise ImportFileError(f"{source}: poses of Unity and others are in it; name the axes of all by --convention")
    axes, (unit,) = convention_named(convention or min(kinds)), lengths
    assumed = [] if convention else [f"axes {axes.name} ({axes.words})"]
    assumed += ["lengths in m"] if "" in units else []
    for stream in streams:
        (notes if stream.data["clock_times"] else assumed).append(stream.clock)
    clock = "LSL clock of the recording computer, s"
    frame, beside = SourceFrame(axes, unit, METRES[unit], clock, assumed=tuple(assumed)), BesidePoses()
    for stream in streams:
        if stream not in posed:
            stream.put_beside(frame, beside)
    samples = beside.put_into(imported(tables, frame, notes), stated=False)
    events = [event for stream in streams for event in stream.events()]
    return replace(samples, events=sorted(events, key=lambda event: event.time_ns))


def _tables(posed: list["Stream"]) -> tuple[dict[str, PoseTable], set[str]]:
    """Every body of these streams, and the units of their lengths."""
    tables: dict[str, PoseTable] = {}
    units: set[str] = set()
    for stream in posed:
        for name, channels in stream.bodies():
            tables[name if name not in tables else f"{stream.name}/{name}"] = stream.poses(channels)
            units.add(stream.unit(channels[0]))
    return tables, units


class Stream:
    """A stream as pyxdf reads it: its name, its type in small letters, its channels, and what was measured."""

    def __init__(self, source: Path, data: dict[str, Any]) -> None:
        info = data["info"]
        self.name, self.kind = _text(info, "name"), _text(info, "type").lower()
        self.is_text = _text(info, "channel_format") == "string"
        self.where = f"{source}: stream {self.name!r}"
        self.data = data
        for key in ("desc", "channels"):
            info = (info.get(key) or [None])[0] if isinstance(info, dict) else None
        listed = info.get("channel", []) if isinstance(info, dict) else []
        self.channels = [{key: _text(one, key) for key in KEYS} for one in listed]

    @property
    def stamps(self) -> Stamps:
        """Nanoseconds, (n,)."""
        return stamps_of(np.asarray(self.data["time_stamps"], dtype=np.float64), self.where)

    @property
    def values(self) -> Numbers | None:
        """The samples (n, channels), ``None`` where they are no numbers."""
        values = np.asarray(self.data["time_series"])
        return values.astype(np.float64) if values.dtype.kind in "fiu" and values.ndim == 2 else None

    @property
    def clock(self) -> str:
        """How its clock was brought onto the recorder's."""
        if not self.data["clock_times"]:
            return f"stream {self.name!r}: no clock offsets, so that its clock is taken for the recorder's"
        fit = ClockFit.of(self.data["clock_times"], self.data["clock_values"])
        return f"stream {self.name!r}: {fit.readings} clock offsets applied, {fit.words}"

    @property
    def is_unity(self) -> bool:
        """Whether LSL4Unity sent it: by its type, or by the types of its channels."""
        return self.kind.startswith(UNITY) or any(one["type"].lower() in UNITY_KINDS for one in self.channels)

    @property
    def holds_poses(self) -> bool:
        """Whether it is a MoCap, or its channels are a place and a quaternion, whatever it is called."""
        with suppress(ImportFileError):
            return self.kind == "mocap" or next(self.bodies(), None) is not None
        return self.is_unity

    def unit(self, channel: int) -> str:
        """The unit of a channel in small letters."""
        return self.channels[channel]["unit"].lower()

    def bodies(self) -> Iterator[tuple[str, list[int]]]:
        """Each object that has a place and a quaternion, and its channels in the order of ``ROLES``."""
        found: dict[str, dict[int, int]] = {}
        for number, channel in enumerate(self.channels):
            kind, label = channel["type"].lower(), channel["label"].lower()
            name = channel["object"] or channel["marker"] or self.name
            if kind in ("orientationp", "orientationh", "orientationr"):
                raise ImportFileError(
                    f"{self.where}: {name!r} has Euler angles, whose order XDF does not state; record OrientationA to D"
                )
            role = ROLES.get(kind, UNITY_ROLES.get((kind, label), UNITY_ROLES.get(("", label), -1)))
            if role >= 0 and found.setdefault(name, {}).setdefault(role, number) != number:
                raise ImportFileError(
                    f"{self.where}: {name!r} has two channels {channel['type']}; name an <object> for each channel"
                )
        for name, roles in found.items():
            if set(range(7)) <= set(roles):
                yield name, [roles[role] for role in sorted(roles)]

    def poses(self, channels: list[int], columns: PoseColumns | None = None) -> PoseTable:
        """A place, a rotation and perhaps a confidence from channels in this order."""
        values = self.values
        if values is None or values.shape[1] <= max(channels):
            why = "its samples are not the numbers its channels describe; record again"
            raise ImportFileError(f"{self.where}: {why}")
        rows, turn = values[:, channels], len(columns.numbers) if columns else 7
        valid = rows[:, turn] > 0.0 if len(channels) > turn else np.ones(len(rows), dtype=np.bool_)
        turns = columns.quaternions(rows[:, 3:turn]) if columns else rows[:, 3:7]
        return PoseTable(self.stamps, rows[:, :3], turns, valid)

    def put_beside(self, frame: SourceFrame, beside: BesidePoses) -> None:
        """Every eye with a place and a direction, and every other channel of numbers."""
        values = self.values
        if values is None or not len(values):
            return
        name, stamps = self.name or "stream", self.stamps
        described = [*self.channels, *[dict.fromkeys(KEYS, "")] * values.shape[1]][: values.shape[1]]
        eyes: dict[str, dict[str, int]] = {}
        for number, channel in enumerate(described):
            eyes.setdefault(channel["eye"], {})[channel["type"].lower()] = number
        taken: set[int] = set()
        for eye, types in eyes.items():
            if self.kind == "gaze" and types.keys() >= set(RAY):
                columns = [types[kind] for kind in RAY]
                unit = self.unit(columns[0])
                metres = METRES.get(UNITS.get(unit, unit), frame.metres)
                seen = values[:, types["confidence"]] > 0 if "confidence" in types else np.ones(len(values), np.bool_)
                origins = frame.axes.points(values[:, columns[:3]]) * metres
                directions = frame.axes.points(values[:, columns[3:]])
                beside.looked(f"{name}/{eye}" if len(eyes) > 1 and eye else name, stamps, origins, directions, seen)
                taken |= {*columns}
        for number, channel in enumerate(described):
            if number not in taken:
                label = channel["label"] or channel["type"] or str(number + 1)
                whole = f"{name}/{label}" if len(described) > 1 else name
                beside.scalar(whole, stamps, values[:, number], channel["unit"])

    def events(self) -> Iterator[Event]:
        """Every sample of a stream of text."""
        if self.is_text:
            for stamp, words in zip(self.stamps.tolist(), self.data["time_series"], strict=True):
                yield Event(stamp, self.name or "marker", " ".join(filter(None, words)))


def _text(data: Any, key: str) -> str:
    """The text of an element of pyxdf's dictionaries; "" where there is none."""
    value = data.get(key) if isinstance(data, dict) else None
    text = value[0] if isinstance(value, list) and value else ""
    return text.strip() if isinstance(text, str) else ""


def _streams(source: Path) -> tuple[list[Stream], list[str]]:
    """Every stream on the recorder's clock, and whether the reader had to skip anything."""
    try:
        from pyxdf import load_xdf
    except ImportError:
        raise ImportFileError('XDF needs pyxdf; install it: pip install "vrlab-replay[formats]"') from None
    _check_size(source)
    heard = _Heard(logging.WARNING)
    logger = logging.getLogger("pyxdf")
    logger.addHandler(heard)
    before, logger.propagate = logger.propagate, False
    try:
        streams, _ = load_xdf(str(source), dejitter_timestamps=False)
    except Exception as error:  # the reader of a foreign file raises errors of any kind; each means: damaged
        why = str(error).splitlines()[0][:100] if str(error) else type(error).__name__
        raise ImportFileError(f"{source} is no whole XDF file ({why}); record it again") from None
    finally:
        logger.removeHandler(heard)
        logger.propagate = before
    notes = [f"{heard.count} places of the file could not be read and were skipped"] if heard.count else []
    return [Stream(source, stream) for stream in streams], notes


def _check_size(source: Path) -> None:
    """Refuse a compressed file of a megabyte that would be read for hours."""
    most = MOST_UNPACKED + UNPACKED_PER_BYTE * source.stat().st_size
    # What is not compressed, or damaged, the reader of the format names.
    with suppress(OSError, EOFError, zlib.error), gzip.open(source) as unpacked:
        if unpacked.seek(most + 1) > most:
            what = f"{source} unpacks to more than {most:,} bytes, as no recording does"
            raise ImportFileError(f"{what}; unpack it with gzip -d to import it all the same")


def _is_whole(source: Path) -> bool:
    """Whether the last chunk ends with the file. Of one cut short pyxdf fills the last sample with older bytes."""
    size = source.stat().st_size
    with source.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:  # compressed: the reader notices
            return True
        while width := file.read(1):
            length = file.read(width[0])
            end = file.tell() + int.from_bytes(length, "little")
            if end > size or len(length) < width[0]:
                return False
            file.seek(end)
    return True


class _Heard(logging.Handler):
    """Counts what the reader complains about, instead of printing it."""

    count = 0

    def emit(self, record: logging.LogRecord) -> None:
        """Count damage; a remark about segments is none."""
        self.count += record.levelno >= logging.ERROR


class StreamMapping(NamedTuple):
    """Bodies of an XDF file, each with the name of its stream and the labels of its channels; their axes and unit."""

    convention: str
    units: str
    bodies: Mapping[str, tuple[str, PoseColumns]]

    def put_into(self, tables: dict[str, PoseTable], body: str, source: Path, streams: list[Stream]) -> Stream:
        """Put the poses of a body into the tables; the stream that they stand in."""
        name, columns = self.bodies[body]
        named = {stream.name: stream for stream in streams}
        if name not in named:
            raise ImportFileError(f"{source}: no stream {name!r}{nearest(name, named)}")
        stream = named[name]
        labels = {one["label"] or str(number + 1): number for number, one in enumerate(stream.channels)}
        wanted = [label for label in (*columns.numbers, columns.valid) if label]
        missing = [label for label in wanted if label not in labels]
        if missing:
            raise ImportFileError(f"{stream.where}: no channel {missing[0]!r}{nearest(missing[0], labels)}")
        tables[body] = stream.poses([labels[label] for label in wanted], columns)
        return stream


def read_stream_mapping(path: str | Path) -> StreamMapping:
    """The mapping of a TOML file; ImportFileError: all its faults at once, each with file, table and key."""
    faults: list[str] = []
    whole = parse_toml(read_text(path, "mapping", ImportFileError), Path(path).name, ImportFileError, faults)
    bodies = {
        name: (table.text("stream", None), pose_columns(table)) for name, table in whole.named_tables("bodies").items()
    }
    if not bodies:
        whole.refuse("give [bodies.NAME] with stream, position and a rotation for every body")
    mapping = StreamMapping(whole.text("convention", "", CONVENTIONS), whole.text("units", "m", METRES), bodies)
    whole.done()
    if faults:
        raise ImportFileError("; ".join(faults))
    return mapping
