"""Compiled separating-axis test of oriented boxes; it knows arrays only."""

from __future__ import annotations

import numpy as np

from cdcore.kernels.box_axes import apart_on_all_axes
from cdcore.kernels.compiling import hot_kernel, kernel
from cdcore.numerics import UNDERFLOW_PAD, BoolArray, FloatArray, IntArray


@hot_kernel
def frame_of_box(rotation: FloatArray, axes: FloatArray, out: FloatArray) -> None:
    """``out`` (3, 3) = rotation @ axes: the box's axes in the world."""
    for i in range(3):
        for j in range(3):
            out[i, j] = rotation[i, 0] * axes[0, j] + rotation[i, 1] * axes[1, j] + rotation[i, 2] * axes[2, j]


@kernel
def boxes_may_meet(
    frames: IntArray,
    first: IntArray,
    second: IntArray,
    rotation: FloatArray,
    translation: FloatArray,
    centres: FloatArray,
    axes: FloatArray,
    halves: FloatArray,
    sizes: FloatArray,
    pad_ulps: float,
    meets: BoolArray,
) -> None:
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
