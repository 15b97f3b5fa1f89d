"""Where falling liquid goes: into the first opening that its parabola enters from above, or beside them all."""

from typing import Final

import numpy as np

from cdcore.numerics import FloatArray

GRAVITY: Final = 9.80665
"""m/s2. Source: standard gravity, 3rd CGPM 1901."""


def entry_times(
    start: FloatArray, velocity: FloatArray, centre: FloatArray, normal: FloatArray, radius: float
) -> FloatArray:
    """Seconds (n,) until liquid let go at ``start`` with ``velocity`` (n, 3) enters an opening; infinite: it does not.

    World Y is up; ``normal`` is the unit direction out of the vessel. An opening that faces down or sideways is not
    entered, nor one that the liquid starts below.
    """
    upward = normal[:, 1] > 0.0
    above = ((start - centre) * normal).sum(axis=1)
    time = _fall(above, -(velocity * normal).sum(axis=1), 0.5 * GRAVITY * np.where(upward, normal[:, 1], 1.0))
    away = places(start, velocity, np.where(np.isfinite(time), time, 0.0)) - centre
    away -= (away * normal).sum(axis=1)[:, None] * normal
    inside = (away * away).sum(axis=1) <= radius**2
    return np.asarray(np.where(upward & inside, time, np.inf))


def places_at_height(start: FloatArray, velocity: FloatArray, height: FloatArray) -> FloatArray:
    """Where (n, 3) it falls through a height (n,); ``start`` itself where it starts no higher and never rises to it."""
    time = _fall(start[:, 1] - height, -velocity[:, 1], np.full(len(start), 0.5 * GRAVITY))
    return places(start, velocity, np.where(np.isfinite(time), time, 0.0))


def places(start: FloatArray, velocity: FloatArray, time: FloatArray) -> FloatArray:
    """Where (n, 3) falling liquid is after some seconds (n,)."""
    found = start + time[:, None] * velocity
    found[:, 1] -= 0.5 * GRAVITY * time * time
    return np.asarray(found)


def _fall(above: FloatArray, speed: FloatArray, pull: FloatArray) -> FloatArray:
    """Times (n,) at which ``above = speed t + pull t^2``, the last ones; infinite: never. ``pull`` is above 0."""
    root = speed * speed + 4.0 * pull * above
    never = (above < 0.0) & ((speed >= 0.0) | (root < 0.0))
    root = np.sqrt(np.maximum(0.0, root))
    # Of the two forms of the root the one that adds, so that a fast start or a small height costs no digits.
    down = np.where(speed + root > 0.0, 2.0 * above / np.where(speed + root > 0.0, speed + root, 1.0), 0.0)
    return np.asarray(np.where(never, np.inf, np.where(speed >= 0.0, down, (root - speed) / (2.0 * pull))))
