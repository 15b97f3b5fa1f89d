"""The box stage: separating axes of whole-body boxes reject what the spheres let through, never bodies that touch."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cdcore.bounding.box import Box
from cdcore.kernels.box_axes import apart_on_all_axes
from cdcore.kernels.compiling import hot_kernel, kernel
from cdcore.numerics import EPS, UNDERFLOW_PAD, BoolArray, FloatArray, IntArray
from cdcore.protocol import Motion


@hot_kernel
def frame_of_box(rotation: FloatArray, axes: FloatArray, out: FloatArray) -> None:
    """``out`` (3, 3) = rotation @ axes: the box's axes in the world."""
    for i in range(3):
        for j in range(3):
            out[i, j] = rotation[i, 0] * axes[0, j] + rotation[i, 1] * axes[1, j] + rotation[i, 2] * axes[2, j]


@kernel
def boxes_may_meet(
    frames: IntArray, first: IntArray, second: IntArray, rotation: FloatArray, translation: FloatArray,
    centres: FloatArray, axes: FloatArray, halves: FloatArray, sizes: FloatArray, pad_ulps: float, meets: BoolArray,
) -> None:  # fmt: skip
    """Fill ``meets`` (K,): False only where the boxes of bodies ``first[k]``, ``second[k]`` are certainly apart."""
    world_a, world_b = np.empty((3, 3)), np.empty((3, 3))
    m, d, offset = np.empty((3, 3)), np.empty(3), np.empty(3)
    for k in range(len(frames)):
        t, a, b = frames[k], first[k], second[k]
        ra, rb, ta, tb = rotation[t, a], rotation[t, b], translation[t, a], translation[t, b]
        frame_of_box(ra, axes[a], world_a)
        frame_of_box(rb, axes[b], world_b)
        largest_a = max(abs(ta[0]), abs(ta[1]), abs(ta[2]))
        largest_b = max(abs(tb[0]), abs(tb[1]), abs(tb[2]))
        pad = pad_ulps * (sizes[a] + sizes[b] + largest_a + largest_b) + UNDERFLOW_PAD
        for i in range(3):
            ca = ra[i, 0] * centres[a, 0] + ra[i, 1] * centres[a, 1] + ra[i, 2] * centres[a, 2] + ta[i]
            cb = rb[i, 0] * centres[b, 0] + rb[i, 1] * centres[b, 1] + rb[i, 2] * centres[b, 2] + tb[i]
            offset[i] = cb - ca
        for i in range(3):
            for j in range(3):
                m[i, j] = world_a[0, i] * world_b[0, j] + world_a[1, i] * world_b[1, j] + world_a[2, i] * world_b[2, j]
            d[i] = world_a[0, i] * offset[0] + world_a[1, i] * offset[1] + world_a[2, i] * offset[2]
        meets[k] = not apart_on_all_axes(m, d, halves[a], halves[b], pad)


BOX_PAD_ULPS: Final = 1024.0
"""Pad of the box stage in eps of both bodies' size.

A rotation may be off orthonormal by 64 eps per entry of R^T R (``ORTHONORMAL_KEEP``), 192 eps as a map; the axes of B
seen from A twice that: 384 eps of a half diagonal for each body. Placing vertices, centres and axes rounds by less
than 64 eps of size more. 1024 is above twice the sum; at 1 m it is 0.2 nanometres of lost tightness.
"""


class BoxStage:
    """Tests oriented boxes of all bodies for separation, 15 axes, for many pair-frames at once."""

    def __init__(self, boxes: Sequence[Box], pairs: IntArray) -> None:
        self.centres = np.array([box.centre for box in boxes]).reshape(-1, 3)
        self.axes = np.array([box.axes for box in boxes]).reshape(-1, 3, 3)
        self.halves = np.array([box.half for box in boxes]).reshape(-1, 3)
        with np.errstate(over="ignore"):
            self.sizes = np.linalg.norm(self.centres, axis=1) + np.linalg.norm(self.halves, axis=1)
        self.first = np.ascontiguousarray(pairs[:, 0])
        self.second = np.ascontiguousarray(pairs[:, 1])

    def may_meet(self, motion: Motion, frames: IntArray, columns: IntArray) -> BoolArray:
        """(K,): False only where the bodies are certainly apart.

        ``frames`` and ``columns`` (K,): frame numbers and columns of the pairs; both bodies have a pose there.
        """
        meets = np.empty(len(frames), dtype=np.bool_)
        boxes_may_meet(
            np.ascontiguousarray(frames), self.first[columns], self.second[columns], motion.rotations,
            motion.translations, self.centres, self.axes, self.halves, self.sizes, BOX_PAD_ULPS * EPS, meets,
        )  # fmt: skip
        return meets
