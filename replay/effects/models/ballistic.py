"""Where falling liquid goes: into the first opening that its parabola enters from above, or beside them all."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray

GRAVITY: Final = 9.80665
"""m/s2. Source: standard gravity, 3rd CGPM 1901."""


@dataclass(frozen=True, eq=False)
class Disc:
    """An opening in the room."""

    name: str  # whose it is
    # centre, normal: (3,) world metres, and the unit direction out of the vessel
    centre: FloatArray
    normal: FloatArray
    radius: float  # metres


def disc_entered(start: FloatArray, velocity: FloatArray, discs: Iterable[Disc]) -> str:
    """Name of the opening that liquid let go at ``start`` (3,) with ``velocity`` (3,) enters first; ``""``: none.

    World Y is up. An opening that faces down or sideways is not entered, nor one that the liquid starts below.
    """
    entered = [(time, disc.name) for disc in discs if (time := _entry(start, velocity, disc)) is not None]
    return min(entered)[1] if entered else ""


def place_at_height(start: FloatArray, velocity: FloatArray, height: float) -> FloatArray:
    """Where (3,) it falls through a height; ``start`` itself where it starts no higher and does not rise to it."""
    time = _fall(start[1] - height, -velocity[1], 0.5 * GRAVITY)
    return start.copy() if time is None else _place(start, velocity, time)


def _entry(start: FloatArray, velocity: FloatArray, disc: Disc) -> float | None:
    if disc.normal[1] <= 0.0:
        return None
    above = float(disc.normal @ (start - disc.centre))
    time = _fall(above, -float(disc.normal @ velocity), 0.5 * GRAVITY * float(disc.normal[1]))
    if time is None:
        return None
    away = _place(start, velocity, time) - disc.centre
    away = away - (away @ disc.normal) * disc.normal
    return time if float(away @ away) <= disc.radius**2 else None


def _fall(above: float, speed: float, pull: float) -> float | None:
    """Time at which ``above = speed t + pull t^2``, the last one; ``pull`` above 0."""
    root = speed * speed + 4.0 * pull * above
    if above < 0.0 and (speed >= 0.0 or root < 0.0):
        return None
    # Of the two forms of the root the one that adds, so that a fast start or a small height costs no digits.
    if speed >= 0.0:
        return 0.0 if above == 0.0 else 2.0 * above / (speed + math.sqrt(root))
    return (math.sqrt(root) - speed) / (2.0 * pull)


def _place(start: FloatArray, velocity: FloatArray, time: float) -> FloatArray:
    place = start + time * velocity
    place[1] -= 0.5 * GRAVITY * time * time
    return np.asarray(place)
