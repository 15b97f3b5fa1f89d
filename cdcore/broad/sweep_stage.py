"""Sweep and prune: world boxes whose ends overlap on all three axes, found by sorting what is nearly sorted.

Source: D. Baraff, Dynamic simulation of non-penetrating rigid bodies (1992); J. D. Cohen, M. C. Lin, D. Manocha,
M. K. Ponamgi, I-COLLIDE (1995).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdcore.bounding.box import Box
from cdcore.broad.box_stage import BOX_PAD_ULPS
from cdcore.broad.sweep_kernels import sweep
from cdcore.numerics import EPS, ByteArray, FloatArray, IntArray
from cdcore.protocol import Motion


@dataclass(frozen=True, eq=False)
class SweepAnswer:
    """Verdicts (T, P): CLEAR, CANDIDATE or NO_POSE; neighbours exchanged, and overlaps begun or ended."""

    verdict: ByteArray
    swaps: int
    events: int


@dataclass(frozen=True, eq=False)
class SweepMemory:
    """Endpoints (3, 2N), their order, and the axes each two bodies share, as the last frame left them."""

    ends: FloatArray
    order: IntArray
    shared: IntArray


class SweepStage:
    """Finds the pair-frames whose world boxes overlap.

    Choose it for many bodies that move little from frame to frame; ``SphereStage`` knows the paths and is cheaper over
    a recording.

    Parameters
    ----------
    boxes : one per body, along its own axes.
    pairs : (P, 2) body numbers.
    """

    def __init__(self, boxes: Sequence[Box], pairs: IntArray) -> None:
        self._centres = np.array([box.centre for box in boxes]).reshape(-1, 3)
        self._halves = np.array([box.half for box in boxes]).reshape(-1, 3)
        with np.errstate(over="ignore"):
            self._sizes = np.linalg.norm(self._centres, axis=1) + np.linalg.norm(self._halves, axis=1)
        self._first = np.ascontiguousarray(pairs[:, 0])
        self._second = np.ascontiguousarray(pairs[:, 1])

    def fresh_memory(self) -> SweepMemory:
        """All bodies at one point, where they overlap, low ends before high ends."""
        count = len(self._centres)
        order = np.concatenate([np.arange(0, 2 * count, 2), np.arange(1, 2 * count, 2)])
        return SweepMemory(np.zeros((3, 2 * count)), np.tile(order, (3, 1)), np.full((count, count), 3, dtype=np.int64))

    def candidates(self, motion: Motion, memory: SweepMemory) -> SweepAnswer:
        """Answer for every frame and pair of the motion; ``memory`` is left as its last frame was."""
        verdict = np.zeros((len(motion), len(self._first)), dtype=np.uint8)
        swaps, events = sweep(
            motion.rotations, motion.translations, motion.valid, self._centres, self._halves, self._sizes,
            BOX_PAD_ULPS * EPS, self._first, self._second, memory.ends, memory.order, memory.shared, verdict,
        )  # fmt: skip
        return SweepAnswer(verdict, int(swaps), int(events))
