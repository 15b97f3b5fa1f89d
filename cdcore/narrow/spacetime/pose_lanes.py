"""Poses of one body with equal entries of consecutive frames side by side, as kernels load them, and the body's path
length.

The path bounds how far any point of the body can have come between two frames; it errs upwards only.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdcore.narrow.compiling import hot_kernel, kernel
from cdcore.narrow.memory import row_of
from cdcore.narrow.spacetime.bounds import ROUNDOFF
from cdcore.narrow.spacetime.lanes import (
    LANES,
    above,
    dot,
    fused,
    load8,
    minus,
    most,
    moved,
    plus,
    root,
    splat8,
    store,
    times,
)
from cdcore.narrow.spacetime.time_spans import fill_ranges, span_count
from cdcore.numerics import FloatArray, IntArray

STEP_ULPS = 32.0
"""Placing two centres rounds each by at most 7 u of the body's size and distance; taken twice."""
ROWS = 15
"""Rotation row by row, translation, world centre of the root box."""


class PoseLanes(NamedTuple):
    """One body over F frames, or one pose for all of them."""

    entries: FloatArray
    """(15 stride,): rotation row by row, translation, then the world centre of the root box; every row is followed by
    copies of its last frame, so that eight can be loaded anywhere."""
    stride: int
    step: int
    """1, or 0 for a body that keeps one pose throughout: frame f is read at ``f * step``."""
    path: FloatArray
    """(F,) metres, not decreasing: no point moves further between f and h than path[h] - path[f]."""
    ranges: FloatArray
    """(6 n,) where the root centre stays in spans of frames, as ``cdcore.narrow.spacetime.time_spans`` orders them."""
    frames: int
    """F, or 1."""
    restless: bool
    """Whether the pose changes in every frame."""
    size: float
    """Largest distance of a translation from the origin."""
    skew: float
    """Largest Frobenius norm of R^T R - I."""
    row: IntArray
    """(6,) addresses and numbers as the kernels take them: ``memory.PoseMemory``."""


@kernel
def stays_put(rotations: FloatArray, translations: FloatArray, body: int, frames: NDArray[np.int64]) -> bool:
    """Whether a body has one and the same pose at all these frames."""
    first = frames[0]
    for f in range(1, len(frames)):
        frame = frames[f]
        same = True
        for i in range(3):
            same &= translations[frame, body, i] == translations[first, body, i]
            for j in range(3):
                same &= rotations[frame, body, i, j] == rotations[first, body, i, j]
        if not same:
            return False
    return True


@kernel
def copy_poses(
    rotations: FloatArray, translations: FloatArray, body: int, frames: NDArray[np.int64], entries: FloatArray,
    stride: int,
) -> None:  # fmt: skip
    """Fill the first twelve rows of ``entries`` for the chosen frames, ends repeated."""
    count = len(frames)
    for f in range(stride):
        frame = frames[min(f, count - 1)]
        for i in range(3):
            for j in range(3):
                entries[(3 * i + j) * stride + f] = rotations[frame, body, i, j]
            entries[(9 + i) * stride + f] = translations[frame, body, i]


@kernel
def place_centres(entries: FloatArray, stride: int, centre: FloatArray) -> tuple[float, float]:
    """Fill the last three rows; returns the largest squared translation and squared skew, infinity if not finite."""
    x, y, z = centre[0], centre[1], centre[2]
    far, skew = splat8(0.0), splat8(0.0)
    unknown = 0
    for f in range(0, stride, LANES):
        away, off = splat8(0.0), splat8(0.0)
        for i in range(3):
            p, q = load8(entries, 3 * i * stride + f), load8(entries, (3 * i + 1) * stride + f)
            r, t = load8(entries, (3 * i + 2) * stride + f), load8(entries, (9 + i) * stride + f)
            store(entries, (12 + i) * stride + f, moved(t, x, y, z, p, q, r))
            away = fused(t, t, away)
            for j in range(i, 3):
                u, v, w = (
                    load8(entries, i * stride + f),
                    load8(entries, (3 + i) * stride + f),
                    load8(entries, (6 + i) * stride + f),
                )
                p, q, r = (
                    load8(entries, j * stride + f),
                    load8(entries, (3 + j) * stride + f),
                    load8(entries, (6 + j) * stride + f),
                )
                product = dot(u, v, w, p, q, r)
                if i == j:
                    product = minus(product, 1.0)
                    off = fused(product, product, off)
                else:
                    off = fused(times(2.0, product), product, off)
        far, skew = most(away, far), most(off, skew)
        # a comparison with NaN gives no bit
        unknown |= 255 ^ above(np.inf, plus(away, off))
    largest, worst = 0.0, 0.0
    scratch = np.empty(2 * LANES)
    store(scratch, 0, far)
    store(scratch, LANES, skew)
    for k in range(LANES):
        largest, worst = max(largest, scratch[k]), max(worst, scratch[LANES + k])
    if unknown != 0:
        return np.inf, np.inf
    return largest, worst


@kernel
def fill_path(  # noqa: C901 - vector loop, then sum
    entries: FloatArray, stride: int, count: int, radius: float, size: float, path: FloatArray
) -> bool:
    """Fill ``path`` (count,) for a root box of this half diagonal and a body of this size, distance included.

    Returns whether the pose changes in every frame.
    """
    steps = np.empty(stride)
    reach, slack, grown = radius * (1.0 + 1e-12), STEP_ULPS * ROUNDOFF * size, 1.0 + 1e-12
    for f in range(0, stride - LANES, LANES):
        turn, move = splat8(0.0), splat8(0.0)
        for k in range(ROWS):
            if k < 9 or k >= 12:
                change = minus(load8(entries, k * stride + f + 1), load8(entries, k * stride + f))
                if k < 9:
                    turn = fused(change, change, turn)
                else:
                    move = fused(change, change, move)
        step = plus(fused(root(turn), reach, times(root(move), grown)), slack)
        store(steps, f, step)
        if above(plus(turn, move), 0.0) != 255:
            for k in range(LANES):
                if not moves(entries, stride, f + k):
                    steps[f + k] = 0.0
    total, restless = 0.0, True
    path[0] = 0.0
    for f in range(1, count):
        # rounding of the sum so far is below 2 u of it: growing by 4 u keeps every difference an upper bound
        if steps[f - 1] > 0.0:
            total = total * (1.0 + 4.0 * ROUNDOFF) + steps[f - 1]
        else:
            restless = False
        path[f] = total
    return restless


@hot_kernel
def moves(entries: FloatArray, stride: int, frame: int) -> bool:
    """Whether the pose of the following frame differs at all."""
    different = False
    for k in range(ROWS):
        different |= entries[k * stride + frame] != entries[k * stride + frame + 1]
    return different


def pose_lanes(
    rotations: FloatArray, translations: FloatArray, body: int, frames: NDArray[np.int64], root_box: FloatArray,
    reach: float,
) -> PoseLanes:  # fmt: skip
    """Poses of one body at these frames, for a root box (16,) and corners within ``reach`` of the origin."""
    still = bool(stays_put(rotations, translations, body, frames))
    if still:
        frames = frames[:1]
    count = len(frames)
    stride = (count + 3 * LANES - 2) // LANES * LANES
    entries, path = np.empty(ROWS * stride), np.zeros(count)
    copy_poses(rotations, translations, body, frames, entries, stride)
    far, skew = place_centres(entries, stride, root_box)
    size = float(np.sqrt(far)) * (1 + 1e-12)
    restless = False
    if not still:
        restless = fill_path(entries, stride, count, float(root_box[15]), size + reach, path)
    ranges = np.empty(6 * span_count(count))
    fill_ranges(entries, stride, count, ranges)
    step, skewed = 0 if still else 1, float(np.sqrt(skew)) + 16 * ROUNDOFF
    row = row_of([entries, stride, step, path, ranges, count])
    return PoseLanes(entries, stride, step, path, ranges, count, restless, size, skewed, row)
