"""What all liquids that fall share: when two flows are one, and a place as an event tells it."""

from __future__ import annotations

from typing import Final

from replay.effects.output import FloatArray, Vector

GAP_S: Final = 0.5
"""A flow that stops for less is the same flow: a glass held at its greatest tilt goes on dribbling with the tremor of
the hand. With 0.3 s one pour of twelve came out as two."""


def vector_of(place: FloatArray) -> Vector:
    """A place (3,) as three numbers."""
    return (float(place[0]), float(place[1]), float(place[2]))
