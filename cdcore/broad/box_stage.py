"""The box stage: separating axes of whole-body boxes reject what the spheres let through, never bodies that touch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from cdcore.bounding.box import Box
from cdcore.broad.box_kernels import boxes_may_meet
from cdcore.numerics import EPS, BoolArray, IntArray
from cdcore.protocol import Motion

BOX_PAD_ULPS: Final = 1024.0
"""Pad of the box stage in eps of both bodies' size.

A rotation may be off orthonormal by 64 eps per entry of R^T R (``ORTHONORMAL_KEEP``), 192 eps as a map; the axes of B
seen from A twice that: 384 eps of a half diagonal for each body. Placing vertices, centres and axes rounds by less
than 64 eps of size more. 1024 is above twice the sum; at 1 m it is 0.2 nanometres of lost tightness.
"""


class BoxStage:
    """Tests oriented boxes of all bodies for separation, 15 axes, for many pair-frames at once."""

    def __init__(self, boxes: Sequence[Box], pairs: IntArray) -> None:
        self._centres = np.array([box.centre for box in boxes]).reshape(-1, 3)
        self._axes = np.array([box.axes for box in boxes]).reshape(-1, 3, 3)
        self._halves = np.array([box.half for box in boxes]).reshape(-1, 3)
        self._sizes = np.linalg.norm(self._centres, axis=1) + np.linalg.norm(self._halves, axis=1)
        self._first = np.ascontiguousarray(pairs[:, 0])
        self._second = np.ascontiguousarray(pairs[:, 1])

    def may_meet(self, motion: Motion, frames: IntArray, columns: IntArray) -> BoolArray:
        """(K,) for K pair-frames: False only where the bodies are certainly apart.

        Parameters
        ----------
        frames, columns : (K,) frame numbers and columns of the pairs; both bodies have a pose there.
        """
        meets = np.empty(len(frames), dtype=np.bool_)
        frames = np.ascontiguousarray(frames)
        boxes_may_meet(
            frames,
            self._first[columns],
            self._second[columns],
            motion.rotations,
            motion.translations,
            self._centres,
            self._axes,
            self._halves,
            self._sizes,
            BOX_PAD_ULPS * EPS,
            meets,
        )
        return meets
