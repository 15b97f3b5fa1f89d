"""Poses of one body, equal entries of consecutive frames side by side as kernels load them, and its path length.

The path bounds how far any point of the body moves between two frames; it errs upwards only.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from cdcore.kernels.compiling import hot_kernel, kernel, runtime_int, stay_one_function
from cdcore.kernels.memory import Memory, address_of, bytes_at, doubles_at, doubles_of, fetch_early
from cdcore.narrow.spacetime.bounds import ROUNDOFF
from cdcore.narrow.spacetime.box_tree import BoxTree
from cdcore.narrow.spacetime.memory import POSE_WORDS
from cdcore.narrow.spacetime.simd import (
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
from cdcore.numerics import ONE_POSE, BoolArray, FloatArray, IntArray, row_length

STEP_ULPS = 32.0
"""Placing two centres rounds each by at most 7 u of the body's size and distance; taken twice."""
ROWS, CENTRES = 12, 3
"""Rotation row by row, translation; world centre of the root box."""
AHEAD: Final = 24
"""Frames by which memory is asked early: the poses of one body lie too far apart for the machine to guess the next."""


TRACK_WORDS: Final = POSE_WORDS + 1
"""Words of a track as a kernel reads it, and the address of ``changed``."""


class PoseLanes(NamedTuple):
    """One body over F frames, or one pose for all of them.

    ``entries`` (12 stride,): rotation row by row, translation; ``centres`` (3 stride,): world centre of the root box.
    Every row is followed by copies of its last frame, so that eight can be loaded anywhere. ``step``: 1, or 0 for a
    body that keeps one pose throughout; frame f is read at ``f * step``. ``path`` (F,): metres, not decreasing; no
    point moves further between f and h than path[h] - path[f]. ``changed`` (F,): whether the pose differs at all from
    that of the frame before. ``ranges`` (6 n,): where the root centre stays in spans of frames, as
    ``cdcore.narrow.spacetime.time_spans`` orders them. ``frames``: F, or 1. ``restless``: the pose changes in every
    frame. ``size``: largest distance of a translation from the origin. ``skew``: largest Frobenius norm of R^T R -
    I. ``row`` (7,): addresses and numbers as the kernels take them, ``memory.PoseMemory``.
    """

    entries: FloatArray
    centres: FloatArray
    stride: int
    step: int
    path: FloatArray
    changed: BoolArray
    ranges: FloatArray
    frames: int
    restless: bool
    size: float
    skew: float
    row: IntArray


@hot_kernel
def stays_put(turns: Memory, places: Memory, bodies: int, body: int, frames: IntArray) -> bool:
    """Whether a body has one pose at all these frames; ``turns`` and ``places``: of all bodies, frame after frame."""
    stay_one_function()
    first = frames[0] * bodies + body
    for f in range(1, len(frames)):
        other = frames[f] * bodies + body
        same = True
        for k in range(9):
            same &= turns[9 * other + k] == turns[9 * first + k]
        for k in range(3):
            same &= places[3 * other + k] == places[3 * first + k]
        if not same:
            return False
    return True


@hot_kernel
def copy_poses(
    turns: Memory, places: Memory, bodies: int, body: int, frames: IntArray, count: int, entries: Memory,
    stride: int,
) -> None:  # fmt: skip
    """Fill the first twelve rows of ``entries`` for the first ``count`` chosen frames, ends repeated."""
    stay_one_function()
    for f in range(stride):
        later = frames[min(f + AHEAD, count - 1)] * bodies + body
        fetch_early(turns, 9 * later)
        fetch_early(turns, 9 * later + 8)
        fetch_early(places, 3 * later)
        pose = frames[min(f, count - 1)] * bodies + body
        for k in range(9):
            entries[k * stride + f] = turns[9 * pose + k]
        for k in range(3):
            entries[(9 + k) * stride + f] = places[3 * pose + k]


@hot_kernel
def place_centres(
    entries: Memory, centres: Memory, stride: int, length: int, x: float, y: float, z: float, lanes: Memory
) -> tuple[float, float]:
    """Fill the centres of a root box centred there; returns the largest squared translation and squared skew.

    Both are infinity if a number is not finite. ``lanes`` (2 LANES,) is scratch.
    """
    stay_one_function()
    far, skew = splat8(0.0), splat8(0.0)
    unknown = 0
    for f in range(0, length, LANES):
        away, off = splat8(0.0), splat8(0.0)
        for i in range(3):
            p, q = load8(entries, 3 * i * stride + f), load8(entries, (3 * i + 1) * stride + f)
            r, t = load8(entries, (3 * i + 2) * stride + f), load8(entries, (9 + i) * stride + f)
            store(centres, i * stride + f, moved(t, x, y, z, p, q, r))
            away = fused(t, t, away)
            for j in range(i, 3):
                u, v = load8(entries, i * stride + f), load8(entries, (3 + i) * stride + f)
                w, p = load8(entries, (6 + i) * stride + f), load8(entries, j * stride + f)
                q, r = load8(entries, (3 + j) * stride + f), load8(entries, (6 + j) * stride + f)
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
    store(lanes, 0, far)
    store(lanes, LANES, skew)
    for k in range(LANES):
        largest, worst = max(largest, lanes[k]), max(worst, lanes[LANES + k])
    if unknown != 0:
        return np.inf, np.inf
    return largest, worst


@hot_kernel
def fill_path(
    entries: Memory,
    centres: Memory,
    stride: int,
    count: int,
    radius: float,
    size: float,
    path: Memory,
    changed: Memory,
) -> bool:
    """Fill ``path`` and ``changed`` (count,) for a root box of this half diagonal and a body of this size.

    The size includes its distance from the origin. The memory of ``path`` has room for ``stride`` numbers. Returns
    whether the pose changes in every frame.
    """
    stay_one_function()
    reach, slack, grown = radius * (1.0 + 1e-12), STEP_ULPS * ROUNDOFF * size, 1.0 + 1e-12
    for f in range(0, stride - LANES, LANES):
        turn, move = splat8(0.0), splat8(0.0)
        for k in range(9):
            change = minus(load8(entries, k * stride + f + 1), load8(entries, k * stride + f))
            turn = fused(change, change, turn)
        for k in range(CENTRES):
            change = minus(load8(centres, k * stride + f + 1), load8(centres, k * stride + f))
            move = fused(change, change, move)
        store(path, f + 1, plus(fused(root(turn), reach, times(root(move), grown)), slack))
        if above(plus(turn, move), 0.0) != 255:
            for k in range(LANES):
                if not moves(entries, stride, f + k):
                    path[f + k + 1] = 0.0
    total, restless = 0.0, True
    path[0] = 0.0
    for f in range(1, count):
        # rounding of the sum so far is below 2 u of it: growing by 4 u keeps every difference an upper bound
        changed[f] = 1
        if path[f] > 0.0:
            total = total * (1.0 + 4.0 * ROUNDOFF) + path[f]
        else:
            changed[f], restless = 0, False
        path[f] = total
    return restless


@hot_kernel
def moves(entries: Memory, stride: int, frame: int) -> bool:
    """Whether the pose of the following frame differs at all."""
    different = False
    for k in range(ROWS):
        different |= entries[k * stride + frame] != entries[k * stride + frame + 1]
    return different


@kernel
def fill_tracks(
    rotations: FloatArray, translations: FloatArray, bodies: IntArray, frames: IntArray, rows: IntArray,
    ends: FloatArray, lanes: FloatArray, found: FloatArray,
) -> None:  # fmt: skip
    """Fill the memory that ``rows`` (n, TRACK_WORDS) name for these bodies, and ``found`` (n, 3): size, skew, restless.

    ``ends`` (n, 17): root box and reach; ``lanes`` (2 LANES,) is scratch. The row of a body that stays put changes
    to one pose.
    """
    turns, places, scratch = doubles_of(rotations), doubles_of(translations), doubles_of(lanes)
    for k in range(len(bodies)):
        row, body, many = rows[k], bodies[k], rotations.shape[1]
        if row[5] > 1 and stays_put(turns, places, many, body, frames):
            row[1], row[2], row[5] = ONE_POSE, 0, 1
        entries, path, centres = doubles_at(row[0]), doubles_at(row[3]), doubles_at(row[6])
        stride, count = row[1], row[5]
        length = stride if count > 1 else runtime_int(ONE_POSE)
        copy_poses(turns, places, many, body, frames, count, entries, stride)
        far, skew = place_centres(entries, centres, stride, length, ends[k, 0], ends[k, 1], ends[k, 2], scratch)
        size = np.sqrt(far) * (1.0 + 1e-12)
        path[0], found[k, 0], found[k, 1], found[k, 2] = 0.0, size, np.sqrt(skew) + 16.0 * ROUNDOFF, 0.0
        if count > 1:
            wide, changed = size + ends[k, 16], bytes_at(row[7])
            found[k, 2] = fill_path(entries, centres, stride, count, ends[k, 15], wide, path, changed)
        fill_ranges(centres, stride, count, doubles_at(row[4]), scratch)


class Tracks:
    """The poses of some bodies at some frames, laid out by one call in one block of memory.

    ``bodies`` (n,) ascending; ``ends`` (n, 17): root box, and how far corners reach from the origin; ``still`` (n,):
    bodies known to keep one pose. ``rows`` (n, POSE_WORDS) and ``found`` (n, 3), size, skew and restless, of each.
    """

    def __init__(
        self, rotations: FloatArray, translations: FloatArray, bodies: IntArray, frames: IntArray, ends: FloatArray,
        still: BoolArray | None = None,
    ) -> None:  # fmt: skip
        count = np.full(len(bodies), len(frames))
        if still is not None:
            count[still] = 1
        stride = row_length(count)
        parts = ROWS * stride, CENTRES * stride, stride, 6 * np.where(count > 1, span_count(len(frames)), 1)
        borders = np.cumsum(np.stack(parts, axis=1)).reshape(-1, 4)
        self.bodies, self.ends, self._borders, self._starts = bodies, ends, borders, borders[:, 0] - ROWS * stride
        self._room, self._changed = np.empty(borders[-1, -1]), np.ones((len(bodies), len(frames)), dtype=np.uint8)
        self._words, memory = np.empty((len(bodies), TRACK_WORDS), dtype=np.int64), address_of(self._room) + 8 * borders
        entries = memory[:, 0] - 8 * ROWS * stride
        changed = address_of(self._changed) + len(frames) * np.arange(len(bodies))
        for k, word in enumerate((entries, stride, count > 1, *memory.T[1:3], count, memory[:, 0], changed)):
            self._words[:, k] = word
        self.rows, self._lanes = self._words[:, :POSE_WORDS], np.empty(2 * LANES)
        self.found: FloatArray = np.empty((len(bodies), 3))
        self.fill(np.ascontiguousarray(rotations), np.ascontiguousarray(translations), bodies, frames)

    def fill(self, rotations: FloatArray, translations: FloatArray, bodies: IntArray, frames: IntArray) -> None:
        """Lay out other poses, as many as before."""
        fill_tracks(rotations, translations, bodies, frames, self._words, self.ends, self._lanes, self.found)

    def __getitem__(self, body: int) -> PoseLanes:
        """The poses of one body of these."""
        k = int(np.searchsorted(self.bodies, body))
        (centres, path, ranges, _), (_, stride, step, _, _, count, _) = self._borders[k].tolist(), self.rows[k].tolist()
        size, skew, restless = self.found[k].tolist()
        lengths = (centres, CENTRES * stride), (path, count), (ranges, 6 * span_count(count))
        own, way, spans = (self._room[start : start + length] for start, length in lengths)
        start = int(self._starts[k])
        entries = self._room[start : start + ROWS * stride]
        return PoseLanes(
            entries, own, stride, step, way, self._changed[k].view(np.bool_), spans, count,
            restless > 0.0, size, skew, self.rows[k],
        )  # fmt: skip


def ends_of(trees: Sequence[BoxTree]) -> FloatArray:
    """Root boxes and reaches of trees as ``Tracks`` takes them."""
    ends = np.empty((len(trees), 17))
    ends[:, :16], ends[:, 16] = [tree.boxes[0] for tree in trees], [tree.reach for tree in trees]
    return ends


def pose_lanes(
    rotations: FloatArray, translations: FloatArray, body: int, frames: IntArray, root_box: FloatArray,
    reach: float,
) -> PoseLanes:  # fmt: skip
    """Poses of one body at these frames, for a root box (16,) and corners within ``reach`` of the origin."""
    ends = np.append(root_box, reach)[None]
    return Tracks(rotations, translations, np.array([body]), frames, ends)[body]
