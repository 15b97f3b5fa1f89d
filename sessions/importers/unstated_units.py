"""Units that neither a file nor a person states: which unit is taken, why, and whether it is sure or open.

Lengths are in the unit of the axes, or metres; how far poses are from the origin says whether that is a room. The unit
of times follows from the steps between rows. Angles are in degrees, which is open where radians would fit.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from sessions.importers.ledger import Numbers, Stamps
from sessions.meshes.conventions import Convention
from sessions.model.assumption import Assumption, Confidence, Origin, Subject
from sessions.model.session import Track
from sessions.quantities import length, number

SMALLEST_RADIUS_M: Final = 0.02
"""Metres from the origin that poses of a tracked room reach at least."""
LARGEST_RADIUS_M: Final = 30.0
"""Metres from the origin within which poses of a tracked room are."""
STEPS: Final = (("s", 5e-4, 0.5), ("ms", 0.5, 500.0), ("us", 500.0, 5e5), ("ns", 5e5, 5e8))
"""Unit of a clock -> the steps between rows that a recording of 2 to 2,000 Hz has in it."""
TICKS: Final = (621_355_968_000_000_000, 662_380_416_000_000_000)
""".NET ticks of 1970 and of 2100; as nanoseconds of the Unix epoch these are the years 1989 to 1990."""
LIKELY_RATES_HZ: Final = (10.0, 250.0)
"""Rates of trackers and headsets; a guessed unit of time that gives another rate is not sure."""
MOST_RADIANS: Final = 4.0 * math.pi
"""Radians beyond two turns are likely degrees, whatever a mapping says."""
FULL_ANGLE_TOLERANCE: Final = 0.1
"""Degrees that reach half a turn of radians, or a whole one, to this much, are likely radians."""


def usual_length_unit(axes: Convention) -> str:
    """Returns the unit that lengths in these axes usually have."""
    return axes.unit or "m"


def length_unit_assumption(unit: str, radius: float, reason: str, alternatives: Sequence[str]) -> Assumption:
    """Returns that lengths are taken to be in this unit; it is open where no laboratory is as large as the room then.

    ``radius``: metres from the origin of nearly all poses. ``reason``: why the unit is sure whatever the room; ``""``.
    """
    confidence = Confidence.SURE
    if not reason:
        reason = f"99 of 100 poses are then within {length(radius)} of the origin"
        if not SMALLEST_RADIUS_M <= radius <= LARGEST_RADIUS_M:
            confidence = Confidence.OPEN
    return Assumption(
        Subject.LENGTH_UNIT, unit, Origin.GUESS, confidence, reason=reason, alternatives=tuple(alternatives)
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


def time_unit_by_steps(values: Sequence[float]) -> str:
    """Returns the unit in which the first numbers of a clock step as a recording does; ``""``: no step tells."""
    if not (np.diff(values) > 0).any():
        return ""
    steps = np.diff(np.unique(values))  # of rows in any order
    if TICKS[0] <= values[0] < TICKS[1]:
        return "ticks"
    step = float(np.median(steps))
    return next((name for name, lower, upper in STEPS if lower <= step < upper), "")


def time_unit_assumption(unit: str, stamps_ns: Stamps) -> Assumption:
    """Returns that a clock is taken to be in this unit; it is open where no tracker has the rate of its stamps then."""
    steps = np.diff(np.unique(stamps_ns))
    rate = 1e9 / float(np.median(steps)) if len(steps) else math.nan
    reason = f"there are then {number(rate)} samples a second" if len(steps) else "one stamp says no rate"
    is_likely = LIKELY_RATES_HZ[0] <= rate <= LIKELY_RATES_HZ[1]
    confidence = Confidence.SURE if is_likely else Confidence.OPEN
    return Assumption(Subject.TIME_UNIT, unit, Origin.GUESS, confidence, reason=reason)


def angle_unit_assumption(unit: str, largest: float) -> Assumption:
    """Returns that angles are taken to be in this unit; it is open where the largest is one turn of radians at most."""
    is_open = 0.0 < largest <= 2.0 * math.pi
    return Assumption(
        subject=Subject.ANGLE_UNIT,
        value=unit,
        origin=Origin.GUESS,
        confidence=Confidence.OPEN if is_open else Confidence.SURE,
        reason=f"the largest number is {number(largest)}",
        alternatives=("deg", "rad") if is_open else (),
    )


def likely_angle_unit(unit: str, largest: float) -> str:
    """Returns the unit that the largest of the angles is likely in, whatever unit is stated for them."""
    if unit == "rad":
        return "deg" if largest > MOST_RADIANS else unit
    full_angles = (math.pi, 2.0 * math.pi)
    return "rad" if any(-FULL_ANGLE_TOLERANCE < largest - angle <= 0.0 for angle in full_angles) else unit


def largest_angle(angles: Iterable[Numbers]) -> float:
    """Returns the largest size of all numbers; 0 without any."""
    return max((float(np.nanmax(np.abs(rows), initial=0.0)) for rows in angles), default=0.0)


def degrees_by_format(angles: Iterable[Numbers]) -> Assumption:
    """Returns that angles are in degrees as their format says; where all would fit radians, that is a doubt."""
    largest = largest_angle(angles)
    if not 0.0 < largest <= 2.0 * math.pi:
        return Assumption(Subject.ANGLE_UNIT, "deg", Origin.FORMAT)
    reason = f"the format has degrees, but no angle is larger than {number(largest)}, as of radians"
    return Assumption(Subject.ANGLE_UNIT, "deg", Origin.GUESS, Confidence.OPEN, reason=reason)
