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
    notes += [] if whole else ["the file is cut short or damaged: the last pose of each body is flagged as lost"]
    posed = [stream for stream in streams if mapping is None and _holds_poses(source, stream)]
    if mapping is None:
        tables, units = _tables(source, posed, whole)
    else:
        plan = read_stream_mapping(mapping)
        convention, units = convention or plan.convention, {plan.units}
        tables, posed = plan.tables(source, streams, whole)
    if not tables:
        seen = [f"{_first(one['info'], 'name')} ({_first(one['info'], 'type')})" for one in streams]
        raise ImportFileError(
            f"{source}: no stream of type MoCap with PositionX and OrientationA; there are: {', '.join(seen) or 'none'}"
            "; say which channels are a pose with --mapping FILE"
        )
    lengths = {UNITS.get(unit, unit) for unit in units}
    if len(lengths) > 1 or not lengths <= METRES.keys():
        raise ImportFileError(f"{source}: lengths are in {', '.join(sorted(units))}; record all in one of m, cm, mm")
    kinds = {"unity" if _is_unity(stream) else ASSUMED for stream in posed}
    if len(kinds) > 1 and not convention:
        raise ImportFileError(f"{source}: poses of Unity and others are in it; name the axes of all by --convention")
    axes, (unit,) = convention_named(convention or min(kinds)), lengths
    assumed = [f"axes {axes.name} ({axes.words})"] * (not convention) + ["lengths in m"] * ("" in units)
    for stream in streams:
        (notes if stream["clock_times"] else assumed).append(f"{_where(stream)}: {_clock(stream)}")
    clock = "LSL clock of the recording computer, s"
    frame, beside = SourceFrame(axes, unit, METRES[unit], clock, assumed=tuple(assumed)), BesidePoses()
    for stream in streams:
        if not any(stream is one for one in posed):
            _beside(source, stream, frame, beside)
    samples = beside.put_into(imported(tables, frame, notes), stated=False)
    return replace(samples, events=sorted(_events(source, streams), key=lambda event: event.time_ns))


def _holds_poses(source: Path, stream: dict[str, Any]) -> bool:
    """Whether it is a MoCap, or its channels are a place and a quaternion, whatever it is called."""
    with suppress(ImportFileError):
        return _kind(stream) == "mocap" or next(_bodies(f"{source}: {_where(stream)}", stream), None) is not None
    return _is_unity(stream)


def _is_unity(stream: dict[str, Any]) -> bool:
    """Whether LSL4Unity sent it: by its type, or by the types of its channels."""
    kinds = {_first(channel, "type").lower() for channel in _channels(stream)}
    return _kind(stream).startswith(UNITY) or bool(kinds & UNITY_KINDS)


def _tables(source: Path, streams: list[dict[str, Any]], whole: bool) -> tuple[dict[str, PoseTable], set[str]]:
    """Every body of these streams, and the units of their lengths."""
    tables: dict[str, PoseTable] = {}
    units: set[str] = set()
    for stream in streams:
        for name, channels in _bodies(f"{source}: {_where(stream)}", stream):
            name = name if name not in tables else f"{_first(stream['info'], 'name')}/{name}"
            tables[name] = _poses(source, stream, channels, whole)
            units |= {_unit(stream, channels[0])}
    return tables, units


def _kind(stream: dict[str, Any]) -> str:
    return _first(stream["info"], "type").lower()


def _where(stream: dict[str, Any]) -> str:
    return f"stream {_first(stream['info'], 'name')!r}"


def _streams(source: Path) -> tuple[list[dict[str, Any]], list[str]]:
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
    return streams, [f"{heard.count} places of the file could not be read and were skipped"] * (heard.count > 0)


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


def _bodies(where: str, stream: dict[str, Any]) -> Iterator[tuple[str, list[int]]]:
    """Each object of a stream that has a place and a quaternion, and its channels in the order of ``ROLES``."""
    found: dict[str, dict[int, int]] = {}
    for number, channel in enumerate(_channels(stream)):
        kind, label = _first(channel, "type").lower(), _first(channel, "label").lower()
        name = _first(channel, "object") or _first(channel, "marker") or _first(stream["info"], "name")
        if kind in ("orientationp", "orientationh", "orientationr"):
            raise ImportFileError(
                f"{where}: {name!r} has Euler angles, whose order XDF does not state; record OrientationA to D"
            )
        role = ROLES.get(kind, UNITY_ROLES.get((kind, label), UNITY_ROLES.get(("", label), -1)))
        if role >= 0 and found.setdefault(name, {}).setdefault(role, number) != number:
            raise ImportFileError(
                f"{where}: {name!r} has two channels {_first(channel, 'type')}; name an <object> for each channel"
            )
    for name, roles in found.items():
        if set(range(7)) <= set(roles):
            yield name, [roles[role] for role in sorted(roles)]


class StreamMapping(NamedTuple):
    """Bodies of an XDF file, each with the name of its stream and the labels of its channels; their axes and unit."""

    convention: str
    units: str
    bodies: Mapping[str, tuple[str, PoseColumns]]

    def tables(
        self, source: Path, streams: list[dict[str, Any]], whole: bool
    ) -> tuple[dict[str, PoseTable], list[dict[str, Any]]]:
        """The poses of every body, and the streams that they stand in."""
        named = {_first(stream["info"], "name"): stream for stream in streams}
        tables: dict[str, PoseTable] = {}
        for body, (name, columns) in self.bodies.items():
            if name not in named:
                raise ImportFileError(f"{source}: no stream {name!r}{nearest(name, named)}")
            stream = named[name]
            labels = {
                _first(channel, "label") or str(number + 1): number for number, channel in enumerate(_channels(stream))
            }
            missing = [label for label in (*columns.numbers, columns.valid) if label and label not in labels]
            if missing:
                raise ImportFileError(
                    f"{source}: {_where(stream)}: no channel {missing[0]!r}{nearest(missing[0], labels)}"
                )
            numbers = [labels[label] for label in (*columns.numbers, columns.valid) if label]
            stamps, rows = _samples(source, stream, numbers)
            valid = rows[:, -1] > 0.0 if columns.valid else np.ones(len(rows), dtype=np.bool_)
            valid[-1:] &= whole
            turns = columns.quaternions(rows[:, 3 : len(columns.numbers)])
            tables[body] = PoseTable(stamps, rows[:, :3], turns, valid)
        return tables, [named[name] for name, _ in self.bodies.values()]


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


def _poses(source: Path, stream: dict[str, Any], channels: list[int], whole: bool) -> PoseTable:
    stamps, rows = _samples(source, stream, channels)
    valid = rows[:, 7] > 0.0 if len(channels) > 7 else np.ones(len(rows), dtype=np.bool_)
    valid[-1:] &= whole
    return PoseTable(stamps, rows[:, :3], rows[:, 3:7], valid)


def _samples(source: Path, stream: dict[str, Any], channels: list[int]) -> tuple[Stamps, Numbers]:
    """Stamps (n,) and some channels (n, channels) of a stream of numbers."""
    where, values = _where(stream), np.asarray(stream["time_series"])
    if values.dtype.kind not in "fiu" or values.ndim != 2 or values.shape[1] <= max(channels):
        raise ImportFileError(f"{source}: {where}: its samples are not the numbers its channels describe; record again")
    stamps = stamps_of(np.asarray(stream["time_stamps"], dtype=np.float64), f"{source}: {where}")
    return stamps, values[:, channels].astype(np.float64)


def _beside(source: Path, stream: dict[str, Any], frame: SourceFrame, beside: BesidePoses) -> None:
    """Every eye with a place and a direction, and every other channel of numbers."""
    values = np.asarray(stream["time_series"])
    if values.dtype.kind not in "fiu" or values.ndim != 2 or not len(values):
        return
    name = _first(stream["info"], "name") or "stream"
    stamps = stamps_of(np.asarray(stream["time_stamps"], dtype=np.float64), f"{source}: {_where(stream)}")
    described = [*_channels(stream), *[{}] * values.shape[1]][: values.shape[1]]
    eyes: dict[str, dict[str, int]] = {}
    for number, channel in enumerate(described):
        eyes.setdefault(_first(channel, "eye"), {})[_first(channel, "type").lower()] = number
    taken: set[int] = set()
    for eye, types in eyes.items():
        if _kind(stream) == "gaze" and types.keys() >= set(RAY):
            columns = [types[kind] for kind in RAY]
            unit = _unit(stream, columns[0])
            metres = METRES.get(UNITS.get(unit, unit), frame.metres)
            seen = values[:, types["confidence"]] > 0 if "confidence" in types else np.ones(len(values), np.bool_)
            rays = values[:, columns].astype(np.float64)
            origins, directions = frame.axes.points(rays[:, :3]) * metres, frame.axes.points(rays[:, 3:])
            beside.looked(f"{name}/{eye}" if len(eyes) > 1 and eye else name, stamps, origins, directions, seen)
            taken |= {*columns}
    for number, channel in enumerate(described):
        if number not in taken:
            label = _first(channel, "label") or _first(channel, "type") or str(number + 1)
            whole = f"{name}/{label}" if len(described) > 1 else name
            beside.scalar(whole, stamps, values[:, number].astype(np.float64), _first(channel, "unit"))


def _unit(stream: dict[str, Any], channel: int) -> str:
    return _first(_channels(stream)[channel], "unit").lower()


def _clock(stream: dict[str, Any]) -> str:
    """How a stream's clock was brought onto the recorder's."""
    if not stream["clock_times"]:
        return "no clock offsets, so that its clock is taken for the recorder's"
    fit = ClockFit.of(stream["clock_times"], stream["clock_values"])
    return f"{fit.readings} clock offsets applied, {fit.words}"


def _events(source: Path, streams: list[dict[str, Any]]) -> Iterator[Event]:
    """Every sample of a stream of text."""
    for stream in streams:
        if _first(stream["info"], "channel_format") == "string":
            name = _first(stream["info"], "name") or "marker"
            stamps = stamps_of(np.asarray(stream["time_stamps"], dtype=np.float64), f"{source}: stream {name!r}")
            for stamp, words in zip(stamps.tolist(), stream["time_series"], strict=True):
                yield Event(stamp, name, " ".join(filter(None, words)))


def _channels(stream: dict[str, Any]) -> list[Any]:
    found = stream["info"]
    for key in ("desc", "channels"):
        found = (found.get(key) or [None])[0] if isinstance(found, dict) else None
    return list(found.get("channel", [])) if isinstance(found, dict) else []


def _first(data: Any, key: str) -> str:
    """The text of an element of pyxdf's dictionaries; "" where there is none."""
    value = data.get(key) if isinstance(data, dict) else None
    text = value[0] if isinstance(value, list) and value else ""
    return text.strip() if isinstance(text, str) else ""
