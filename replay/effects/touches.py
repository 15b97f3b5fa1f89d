"""Contacts as effects share them: each with its frames, its place and its direction."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from replay.effects.declaring import Pair
from replay.effects.inputs import EffectInputs, PairContact
from replay.effects.output import FloatArray, Vector, vector_of

FLAT: Final = 1e-3
"""A curve narrower than this share of its length is a line, and a line has no plane."""


@dataclass(frozen=True, eq=False)
class EffectContact:
    """One contact of a pair, for the effects that build on it."""

    pair: Pair  # names as declared
    # first, stop: first frame in contact, and the first frame clear of it (T where the recording ends before)
    first: int
    stop: int
    last: int  # last frame seen in contact: poses may be lost between it and ``stop``
    before: int  # last frame before ``first`` known to be clear; -1 where there is none
    point: Vector | None  # where the surfaces met in the first frame, world metres, or ``None`` without faces
    # unit vector across the curve in which they met there, either way, or ``None`` where it spans no plane
    normal: Vector | None
    flicker: bool  # no two frames that follow each other are both in contact: a bump, or a tracker's noise


@dataclass(frozen=True, eq=False)
class Touches:
    """All contacts: pair -> touches in order of time, and pair -> what the detector said."""

    by_pair: Mapping[Pair, tuple[EffectContact, ...]]
    reported: Mapping[Pair, PairContact]

    def of(self, pair: Pair, *, flickers: bool = False) -> tuple[EffectContact, ...]:
        """The contacts of a pair in either order of names; those of one frame only where asked for."""
        found = self.by_pair.get(pair) or self.by_pair.get((pair[1], pair[0]), ())
        return tuple(one for one in found if flickers or not one.flicker)

    @classmethod
    def told(cls, inputs: EffectInputs) -> "Touches":
        """Contacts at frames; of pairs that an effect sweep looks at, those between frames."""
        told: Touches = inputs.output("contact").data
        if not inputs.has("sweep"):
            return told
        swept: Touches = inputs.output("sweep").data
        better = {pair: found for pair in told.by_pair if (found := swept.of(pair, flickers=True))}
        return cls({**told.by_pair, **better}, told.reported)

    def meeting(self, pair: Pair, frame: int) -> FloatArray:
        """Points (n, 3), world metres, of the curve in which a pair meets at a frame; none without faces."""
        reported = self.reported.get(pair) or self.reported[pair[1], pair[0]]
        return reported.section(frame).reshape(-1, 3)


def touch_of(reported: PairContact, first: int, stop: int) -> EffectContact:
    """The contact of a pair in these frames."""
    clear = np.flatnonzero(reported.known[:first] & ~reported.touching[:first])
    points = reported.section(first).reshape(-1, 3)
    point = vector_of(points.mean(axis=0)) if len(points) else None
    before, known = int(clear[-1]) if len(clear) else -1, np.flatnonzero(reported.known[first:stop])
    seen = reported.touching[first:stop][known]
    flicker = not bool((seen[1:] & seen[:-1]).any())
    last = first + int(np.flatnonzero(reported.touching[first:stop])[-1])
    return EffectContact(reported.pair, first, stop, last, before, point, _normal(points), flicker)


def _normal(points: FloatArray) -> Vector | None:
    """Normal of the plane that fits the curve of intersection: a fresh contact cuts a small flat loop."""
    if len(points) < 3:
        return None
    _, size, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    return vector_of(axes[2]) if size[1] > FLAT * size[0] else None
