"""Poses as their source has them, and their one way into the canonical frame: axes, lengths, clock.

Numbers beside them come along; what is dropped is in the ledger.
"""

import math
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np

from sessions.errors import ImportFileError
from sessions.importers.ledger import FACT, Ledger
from sessions.importers.stamps import Numbers, Rows, Stamps, increasing
from sessions.meshes.conventions import CONVENTIONS, Convention, pose_axes_alternatives
from sessions.meshes.conventions import convention as convention_named
from sessions.model.assumption import ASSUMPTIONS_FACT, Assumption, Confidence, Origin, Subject, assumptions_fact
from sessions.model.session import Session
from sessions.model.track import ScalarTrack, Track
from sessions.quantities import length

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


def imported(
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
        name = numbered(stream.name, scalars)
        if name != stream.name:
            done.append(f"scalar {name}: another of the name {stream.name}")
        keep = increasing(f"scalar {name}", stream.times_ns, (stream.values,), ledger)
        scalars[name] = ScalarTrack(stream.times_ns[keep], stream.values[keep], stream.unit)
    facts = {
        "conversions": "; ".join(_grouped(done)) or "none",
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
        distances = np.sort(np.concatenate([np.hypot.reduce(rows, axis=1) for rows in positions] or [np.zeros(0)]))
    return float(distances[-(len(distances) // 100) - 1]) if len(distances) else 0.0


def _grouped(notes: Iterable[str]) -> list[str]:
    """Notes of the same words about several things as one: ``a, b: 3 rows dropped``."""
    about: dict[str, list[str]] = {}
    for note in notes:
        what, colon, text = note.partition(": ")
        about.setdefault(colon + text or note, []).append(what if colon else "")
    return [", ".join(filter(None, dict.fromkeys(names))) + text for text, names in about.items()]


def numbered(name: str, taken: Container[str]) -> str:
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
    keep = increasing(name, table.times_ns, (table.positions, table.quaternions_xyzw), ledger)
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
