"""Liquid on its way from one vessel to another: streams over frames, and what of them counts as one flow."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray, IntArray

GAP_S: Final = 0.7
"""A flow that stops for less is the same flow: a glass held at its greatest tilt goes on dribbling with the tremor of
the hand. With 0.5 s one pour of twelve came out as two."""


@dataclass(frozen=True, eq=False)
class Stream:
    """What left one vessel for one place, a row in each frame in which some did.

    ``source``, ``target``: vessels; target ``""``: it was spilled.
    ``over``: it ran over the brim.
    ``times``, ``frames``, ``volume_ml``: (n,), volumes above 0.
    ``points``: (n, 3) world metres, where it left the source, or where it landed if it was spilled.
    """

    source: str
    target: str
    over: bool
    times: FloatArray
    frames: IntArray
    volume_ml: FloatArray
    points: FloatArray

    @property
    def total_ml(self) -> float:
        """All of it."""
        return float(self.volume_ml.sum())

    def part(self, rows: slice) -> "Stream":
        """Some rows of it."""
        return Stream(
            self.source, self.target, self.over, self.times[rows], self.frames[rows], self.volume_ml[rows],
            self.points[rows],
        )  # fmt: skip


def flows(streams: Sequence[Stream], least_ml: float, gap_s: float = GAP_S) -> list[Stream]:
    """Streams parted where they stop for more than ``gap_s``, in order of time; less than ``least_ml`` is no flow."""
    found = []
    for one in streams:
        cuts = [0, *(np.flatnonzero(np.diff(one.times) > gap_s) + 1).tolist(), len(one.times)]
        found += [one.part(slice(first, stop)) for first, stop in pairwise(cuts) if stop > first]
    whole = [one for one in found if one.total_ml >= least_ml]
    return sorted(whole, key=lambda part: (part.frames[0], part.source, part.target))
