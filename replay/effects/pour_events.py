"""What all liquids that fall share: when two flows are one, and a place as an event tells it."""

from __future__ import annotations

from typing import Final

from replay.effects.output import FloatArray, Vector

GAP_S: Final = 0.3
"""A flow that stops for less is the same flow: tremor of a held tilt lets it pause for some frames."""


def vector_of(place: FloatArray) -> Vector:
    """A place (3,) as three numbers."""
    return (float(place[0]), float(place[1]), float(place[2]))
