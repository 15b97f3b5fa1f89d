"""Samples as their source has them, and their one way into the canonical frame: stamps that increase, axes, lengths.

Numbers beside the poses come along; what is dropped is in the ledger. A few wild stamps cost their own rows and no
others. A clock that starts again is refused, because nobody knows how much time lies between the two recordings that
the series then is.
"""

import calendar
import math
import re
from bisect import bisect_left
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sessions.errors import ImportFileError
from sessions.importers.ledger import FACT, Ledger
from sessions.meshes.conventions import CONVENTIONS, Convention, pose_axes_alternatives
from sessions.meshes.conventions import convention as convention_named
from sessions.model.assumption import ASSUMPTIONS_FACT, Assumption, Confidence, Origin, Subject, assumptions_fact
from sessions.model.samples import ScalarTrack, Track
from sessions.model.session import Session
from sessions.quantities import length
from sessions.quantities import number as number_text

Numbers = NDArray[np.float64]
Stamps = NDArray[np.int64]
Rows = NDArray[np.bool_]

LARGEST_SECONDS: Final = 9.0e9  # Just below what int64 nanoseconds hold
QUATERNION_TOLERANCE: Final = 1e-3
"""A quaternion whose norm is further off 1 is no rotation: its row is flagged as lost."""
METRES: Final[Mapping[str, float]] = {
    "m": 1.0,
    "cm": 0.01,
    "mm": 0.001,
    "meter": 1.0,
    "meters": 1.0,
    "metres": 1.0,
    "centimeters": 0.01,
    "millimeters": 0.001,
    "inches": 0.0254,
    "feet": 0.3048,
    "inch": 0.0254,
    "ft": 0.3048,
}

SMALLEST_RADIUS_M, LARGEST_RADIUS_M = 0.02, 30.0
"""Metres from the origin within which the poses of a tracked room are; beyond these a guessed unit is open."""

LENGTH_UNITS: Final = ("m", "cm", "mm")

RESTART_ROWS: Final = 10
"""So many samples in a row that increase among themselves and fit in nowhere are no wild stamps: a clock began anew."""
OUT_OF_ORDER: Final = "with a stamp out of order"
REPEATED: Final = "with the stamp of another sample"
SAME_SAMPLE: Final = "that repeat a sample"

DAY_NS: Final = 86_400_000_000_000
NO_YEAR: Final = 1900  # What strptime says of a time of day without a date
FRACTION: Final = re.compile(r"(?:(?<=:[0-9]{2}:[0-9]{2})|(?<=T[0-9]{6}))[.,]([0-9]+)")
"""The fraction of a second in ISO 8601, with and without colons."""


class PoseTable(NamedTuple):
    """The rows of one body: (n,) nanoseconds, (n, 3) and (n, 4) in axes and units of the source, (n,) or ``None``."""

    times_ns: Stamps
    positions: Numbers
    quaternions_xyzw: Numbers
    valid: Rows | None = None


class Stream(NamedTuple):
    """A number over time beside the poses: (n,) nanoseconds and (n,) values; NaN where nothing was measured."""

    name: str
    times_ns: Stamps
    values: Numbers
    unit: str = ""


@dataclass(frozen=True)
class SourceFrame:
    """The units and axes of a source, and their origin; ``clock`` is a sentence for a reader.

    ``assumed``: sentences on what no file said. ``others``: units of times and angles, and orders of rotations.
    ``handedness_is_known``: axes of the other handedness are no alternatives.
    ``units_reason``: why a guessed unit is sure; ``""``: by how far poses are from the origin.
    """

    axes: Convention
    units: str
    clock: str
    assumed: tuple[str, ...] = ()
    axes_origin: Origin = Origin.FORMAT
    axes_confidence: Confidence = Confidence.SURE
    axes_reason: str = "usual for this format"
    handedness_is_known: bool = False
    units_origin: Origin = Origin.FORMAT
    units_reason: str = ""
    clock_origin: Origin = Origin.FORMAT
    others: tuple[Assumption, ...] = ()

    @classmethod
    def in_axes(
        cls,
        convention: str | None,
        usual: str,
        units: str,
        clock: str,
        assumed: Sequence[str] = (),
        confidence: Confidence = Confidence.SURE,
    ) -> "SourceFrame":
        """In the axes that somebody named, else in those that are usual for a source, which is then assumed.

        ``units``: ``""`` where the file states none; then that of the axes, or metres. ``confidence``: how sure the
        usual axes are.
        """
        axes = convention_named(convention or usual)
        notes = [] if convention else [f"axes {axes.name} ({axes.description})"]
        unit = units or axes.unit or "m"
        if not units:
            notes.append(f"lengths in {unit}")
        return cls(
            axes=axes,
            units=unit,
            clock=clock,
            assumed=(*notes, *assumed),
            axes_origin=Origin.USER if convention else Origin.GUESS,
            axes_confidence=Confidence.SURE if convention else confidence,
            units_origin=Origin.FILE if units else Origin.GUESS,
        )


def session_of_tables(
    tables: Mapping[str, PoseTable],
    frame: SourceFrame,
    ledger: Ledger,
    notes: Sequence[str] = (),
    streams: Iterable[Stream] = (),
    made: Mapping[str, Track] | None = None,
) -> Session:
    """Tables in the canonical frame and metres, and numbers by their names.

    Every conversion and the ledger are among the facts. Of several streams of one name the later ones are numbered.
    ``made``: tracks that are in that frame already, such as those of capsules between joints.

    Raises ``ImportFileError``: a clock starts again.
    """
    axes = frame.axes
    done = []
    if not axes.is_canonical:
        done.append(f"axes {axes.name} ({axes.description}) to right-handed, +Y up, -Z forward")
    if METRES[frame.units] != 1.0:
        done.append(f"lengths in {frame.units} to m")
    done += notes
    tracks: dict[str, Track] = dict(made or {})
    for name, table in tables.items():
        tracks[name], texts = track_of(name, table, frame, ledger)
        done += texts
    scalars: dict[str, ScalarTrack] = {}
    for stream in streams:
        name = numbered_name(stream.name, scalars)
        if name != stream.name:
            done.append(f"scalar {name}: another of the name {stream.name}")
        keep = increasing_rows(f"scalar {name}", stream.times_ns, (stream.values,), ledger)
        scalars[name] = ScalarTrack(stream.times_ns[keep], stream.values[keep], stream.unit)
    facts = {
        "conversions": "; ".join(_grouped_notes(done)) or "none",
        "source_units": frame.units,
        "source_convention": axes.name,
        "handedness": axes.handedness,
        "clock": frame.clock,
        FACT: ledger.as_text(),
    }
    if frame.assumed:
        facts["assumed"] = "; ".join(frame.assumed)
    facts[ASSUMPTIONS_FACT] = assumptions_fact(pose_assumptions(frame, room_radius(tracks.values())))
    return replace(Session.from_tracks(tracks, facts=facts), scalars=scalars)


def pose_assumptions(frame: SourceFrame, radius: float) -> tuple[Assumption, ...]:
    """Returns what was assumed of the poses of a source.

    ``radius``: metres from the origin within which nearly all positions are, as the unit was taken.
    """
    is_guess = frame.axes_origin is Origin.GUESS
    alternatives = pose_axes_alternatives(frame.axes)
    if frame.handedness_is_known:
        alternatives = tuple(name for name in alternatives if CONVENTIONS[name].handedness == frame.axes.handedness)
    axes = Assumption(
        subject=Subject.POSE_AXES,
        value=frame.axes.name,
        origin=frame.axes_origin,
        confidence=frame.axes_confidence,
        description=_description(frame.axes),
        reason=frame.axes_reason if is_guess else "",
        alternatives=alternatives if is_guess else (),
    )
    handed_origin, reason = frame.axes_origin, ""
    if frame.axes.assumed_handedness:
        handed_origin, reason = Origin.GUESS, "the axes as text leave it out"
    handedness = Assumption(Subject.HANDEDNESS, frame.axes.handedness, handed_origin, reason=reason)
    clock = Assumption(Subject.CLOCK, frame.clock, frame.clock_origin)
    return axes, handedness, length_unit(frame, radius), clock, *frame.others


def _description(axes: Convention) -> str:
    return "" if axes.description == axes.name else axes.description


def length_unit(frame: SourceFrame, radius: float) -> Assumption:
    """Returns the unit of lengths; a guess is open where a room of that size would be no laboratory."""
    confidence, reason = Confidence.SURE, ""
    if frame.units_origin is Origin.GUESS and frame.units_reason:
        reason = frame.units_reason
    elif frame.units_origin is Origin.GUESS:
        reason = f"99 of 100 poses are then within {length(radius)} of the origin"
        if not SMALLEST_RADIUS_M <= radius <= LARGEST_RADIUS_M:
            confidence = Confidence.OPEN
    others = [unit for unit in LENGTH_UNITS if unit != frame.units]
    return Assumption(
        subject=Subject.LENGTH_UNIT,
        value=frame.units,
        origin=frame.units_origin,
        confidence=confidence,
        reason=reason,
        alternatives=(frame.units, *others),
    )


def room_radius(tracks: Iterable[Track]) -> float:
    """Returns the metres from the origin within which 99 of 100 valid positions are; 0 without any.

    A few wild positions say nothing about the unit of the others.
    """
    positions = [track.positions[track.valid] for track in tracks]
    with np.errstate(over="ignore"):
        distances = np.concatenate([np.hypot.reduce(rows, axis=1) for rows in positions] or [np.zeros(0)])
    if not len(distances):
        return 0.0
    rank = len(distances) - 1 - len(distances) // 100
    return float(np.partition(distances, rank)[rank])


def _grouped_notes(notes: Iterable[str]) -> list[str]:
    """Notes of the same words about several things as one: ``a, b: 3 rows dropped``."""
    about: dict[str, list[str]] = {}
    for note in notes:
        what, colon, text = note.partition(": ")
        about.setdefault(colon + text or note, []).append(what if colon else "")
    return [", ".join(filter(None, dict.fromkeys(names))) + text for text, names in about.items()]


def degrees_by_format(angles: Iterable[Numbers]) -> Assumption:
    """Returns that angles are in degrees as their format says; where all would fit radians, that is a doubt."""
    largest = max((float(np.nanmax(np.abs(rows), initial=0.0)) for rows in angles), default=0.0)
    if not 0.0 < largest <= 2.0 * math.pi:
        return Assumption(Subject.ANGLE_UNIT, "deg", Origin.FORMAT)
    reason = f"the format has degrees, but no angle is larger than {number_text(largest)}, as of radians"
    return Assumption(Subject.ANGLE_UNIT, "deg", Origin.GUESS, Confidence.OPEN, reason=reason)


def numbered_name(name: str, taken: Container[str]) -> str:
    """The name, or where it is taken the name with the first number that is free: ``cup (2)``."""
    number, free = 1, name
    while free in taken:
        number += 1
        free = f"{name} ({number})"
    return free


def track_of(name: str, table: PoseTable, frame: SourceFrame, ledger: Ledger) -> tuple[Track, list[str]]:
    """The rows whose stamps increase, in the canonical frame, and sentences about rows that are flagged.

    Rows that hold no rotation are flagged as lost, and keep their numbers.
    """
    notes = []
    keep = increasing_rows(name, table.times_ns, (table.positions, table.quaternions_xyzw), ledger)
    positions = frame.axes.points(table.positions[keep]) * METRES[frame.units]
    quaternions = frame.axes.quaternions(table.quaternions_xyzw[keep])
    claimed = np.ones(len(positions), dtype=np.bool_) if table.valid is None else table.valid[keep]
    pose = np.isfinite(positions).all(axis=1) & is_rotation(quaternions)
    flagged = int((claimed & ~pose).sum())
    if flagged:
        notes.append(f"{name}: {flagged} rows flagged as lost that hold no pose (missing number, no unit quaternion)")
    return Track(table.times_ns[keep], positions, quaternions, claimed & pose), notes


def is_rotation(quaternions: Numbers) -> Rows:
    """Whether each quaternion (n, 4) is one of length 1, (n,)."""
    with np.errstate(over="ignore", invalid="ignore"):
        norm = np.sqrt((quaternions**2).sum(axis=1))
    return np.abs(norm - 1.0) <= QUATERNION_TOLERANCE


def number(value: Any) -> float:
    """A number of a decoded message as float64; NaN where it is none."""
    fits = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300
    return float(value) if fits else math.nan


def stamps_of(times: Numbers, unit_ns: float, where: str) -> Stamps:
    """Times in a unit of so many nanoseconds as int64 nanoseconds, (n,); an error where one is missing or too large."""
    wrong = np.flatnonzero(~(np.abs(times) < LARGEST_SECONDS * 1e9 / unit_ns))
    if len(wrong):
        raise ImportFileError(f"{where}: row {int(wrong[0]) + 1} has no time; remove it or repair the file")
    return np.rint(times * unit_ns).astype(np.int64)


def increasing_rows(
    name: str, stamps: Stamps, values: Sequence[Numbers], ledger: Ledger, *, kind: str = "samples"
) -> Rows:
    """Mask (n,) of the kept samples: the longest subsequence whose stamps increase, of equal stamps the first.

    The account of this ``kind`` and name says what became of the others. ``values``: what the samples hold, arrays
    (n,) or (n, k); they tell a sample that is there twice from two samples of one stamp.

    Raises ``ImportFileError``: the clock starts again.
    """
    keep = longest_increasing(stamps)
    repeated = np.zeros(len(stamps), dtype=np.bool_)
    same = repeated.copy()
    if not keep.all():
        kept = np.flatnonzero(keep)
        match = kept[np.minimum(np.searchsorted(stamps[kept], stamps), len(kept) - 1)]
        repeated = ~keep & (stamps[match] == stamps)
        same[repeated] = _equal(values, np.flatnonzero(repeated), match[repeated])
        _refuse_restart(name, stamps, ~keep & ~same, ledger)
    lost = {REPEATED: int((repeated & ~same).sum()), OUT_OF_ORDER: int((~keep & ~repeated).sum())}
    ledger.book(kind, name, read=len(stamps), kept=int(keep.sum()), dropped=lost, merged={SAME_SAMPLE: int(same.sum())})
    return keep


def wall_clock_ns(text: str, form: str = "") -> int:
    """Nanoseconds since 1970 of a date and time; without a zone it is UTC, a time of day counts from midnight.

    ``form``: as ``datetime.strptime`` takes it, exact to the microsecond; ``""``: ISO 8601, to the last of nine digits.
    ValueError: the text is none.
    """
    fraction = None if form else FRACTION.search(text)
    if form:
        moment = datetime.strptime(text, form)
        if moment.year == NO_YEAR:
            moment = moment.replace(year=1970)
    else:
        moment = datetime.fromisoformat(FRACTION.sub("", text, count=1))
    nanoseconds = int(fraction[1][:9].ljust(9, "0")) if fraction else moment.microsecond * 1000
    return calendar.timegm(moment.utctimetuple()) * 1_000_000_000 + nanoseconds


def past_midnight(stamps: Stamps) -> Stamps:
    """Times of day that go on in the next day where one is more than half a day before the last, (n,)."""
    if not len(stamps):
        return stamps
    days = np.concatenate([[0], np.cumsum(-np.rint(np.diff(stamps) / DAY_NS).astype(np.int64))])
    return stamps + (days - min(int(days.min()), 0)) * DAY_NS


def last_of_each_stamp(name: str, stamps: Stamps, ledger: Ledger) -> NDArray[np.intp]:
    """The rows in order of time, of equal stamps the last, (k,): for states that hold until the next one."""
    order = np.argsort(stamps, kind="stable")
    ends = np.ones(len(stamps), dtype=np.bool_)
    ends[:-1] = np.diff(stamps[order]) > 0
    rows: NDArray[np.intp] = order[ends]
    ledger.book("samples", name, read=len(stamps), kept=len(rows), dropped={REPEATED: len(stamps) - len(rows)})
    return rows


def longest_increasing(stamps: Stamps) -> Rows:
    """The rows of a longest strictly increasing part, (n,); of equal stamps the first that fits.

    Source: Schensted, "Longest increasing and decreasing subsequences", Canadian Journal of Mathematics 13 (1961).
    Cost: O(n) where stamps increase, O(n log n) else.
    """
    keep = np.ones(len(stamps), dtype=np.bool_)
    if (stamps[1:] > stamps[:-1]).all():
        return keep
    # A row after all before it and before all after it is in every longest part; what lies between two of them stands
    # alone.
    keep[1:] &= stamps[1:] > np.maximum.accumulate(stamps)[:-1]
    keep[:-1] &= stamps[:-1] < np.minimum.accumulate(stamps[::-1])[::-1][1:]
    edges = np.flatnonzero(np.diff(np.concatenate([[True], keep, [True]])))
    for first, end in edges.reshape(-1, 2).tolist():
        keep[first + np.array(_longest(stamps[first:end].tolist()), dtype=np.intp)] = True
    return keep


def _longest(values: list[int]) -> list[int]:
    """The places of a longest increasing part, by patience sorting."""
    ends: list[int] = []
    """The least value that a part of each length ends with."""
    indices: list[int] = []
    before = [-1] * len(values)
    for index, value in enumerate(values):
        length = bisect_left(ends, value)
        before[index] = indices[length - 1] if length else -1
        if length == len(ends):
            ends.append(value)
            indices.append(index)
        elif value < ends[length]:
            ends[length], indices[length] = value, index
    chain = []
    index = indices[-1]
    while index >= 0:
        chain.append(index)
        index = before[index]
    return chain


def _equal(values: Sequence[Numbers], rows: NDArray[np.intp], others: NDArray[np.intp]) -> Rows:
    """Whether rows hold the same as others, (n,); NaN is the same as NaN."""
    same = np.ones(len(rows), dtype=np.bool_)
    for column in values:
        left, right = column[rows], column[others]
        alike = (left == right) | (np.isnan(left) & np.isnan(right))
        same &= alike if alike.ndim == 1 else alike.all(axis=1)
    return same


def _refuse_restart(name: str, stamps: Stamps, outside: Rows, ledger: Ledger) -> None:
    """Refuse a series in which many rows follow each other and fit in nowhere."""
    rows = np.flatnonzero(outside)
    if not len(rows):
        return
    breaks = (np.diff(rows) > 1) | (stamps[rows[1:]] <= stamps[rows[:-1]])
    starts = np.concatenate([[0], np.flatnonzero(breaks) + 1])
    lengths = np.diff(np.concatenate([starts, [len(rows)]]))
    longest = int(lengths.argmax())
    if lengths[longest] < RESTART_ROWS:
        return
    first, last = int(rows[starts[longest]]), int(rows[starts[longest] + lengths[longest] - 1])
    begin, end = (float(stamps[row]) / 1e9 for row in (first, last))
    raise ImportFileError(
        f"{ledger.source}: the clock of {name!r} starts again: its samples {first + 1:,} to {last + 1:,} are stamped "
        f"{begin:.3f} s to {end:.3f} s, between others of other times; split the recording there, or correct the stamps"
    )


def rows_lost(stamps: Stamps, groups: Iterable[Rows]) -> int:
    """How many rows an import would drop because stamps repeat or go back, where each group is a body."""
    return sum(int((~longest_increasing(stamps[rows])).sum()) for rows in groups)
