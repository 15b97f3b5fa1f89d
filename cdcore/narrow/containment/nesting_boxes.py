"""Which pair-frames are asked about containment at all: those in which a box of one body may hold the other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cdcore.kernels.compiling import hot_kernel, kernel, runtime_int, stay_one_function
from cdcore.kernels.memory import Memory, address_of, doubles_at, doubles_of
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import Motion


class Nesting(NamedTuple):
    """What may lie in what: points (E, 3) of the inner body, boxes (B, 2, 3) of the outer one, the size of both.

    The first box holds all points where anything of the inner body is inside; of several boxes one other does too.
    """

    inner: int
    outer: int
    points: FloatArray
    boxes: FloatArray
    size: float


class NestingBoxes:
    """The nestings of P pairs, asked in one call for all pair-frames."""

    def __init__(self, nestings: Sequence[Sequence[Nesting]]) -> None:
        rows, none = [one for two in nestings for one in two], (0, 3)
        ends = np.cumsum([[0, 0], *((len(one.points), len(one.boxes)) for one in rows)], axis=0)
        bodies = np.array([one[:2] for one in rows], dtype=np.int64).reshape(-1, 2)
        self._first = np.cumsum([0, *map(len, nestings)])
        self._rows = np.concatenate([bodies, ends[:-1], np.diff(ends, axis=0)], axis=1)
        self._points = np.concatenate([np.empty(none), *(one.points for one in rows)])
        self._boxes = np.concatenate([np.empty((0, 2, 3)), *(one.boxes for one in rows)])
        self._sizes = np.array([one.size for one in rows], dtype=np.float64)

    def may_hold(self, motion: Motion, frames: IntArray, columns: IntArray, pad: float) -> BoolArray:
        """Whether one body of a pair may hold a part of the other, (K,) for K pair-frames.

        ``pad``: the margin of a box, as a share of the bodies' size and distance from the origin.
        """
        may = np.empty(len(frames), dtype=np.bool_)
        any_may_hold(
            *_starts(motion), frames, columns, self._first, self._rows, self._points, self._boxes, self._sizes, pad, may
        )
        return may


def _starts(motion: Motion) -> tuple[int, int, int, IntArray]:
    """Where poses lie: addresses of rotations and translations, the step of an entry, and per body (N, 4) the places
    of both in the first frame and their steps a frame."""
    bodies, lanes = motion.body_count, motion.lanes
    body = np.arange(bodies)
    if lanes is None:
        steps = np.array([9, 3]) * np.ones((bodies, 1), dtype=np.int64)
        where = address_of(motion.rotations), address_of(motion.translations), 1
        return *where, np.concatenate([steps * body[:, None], steps * bodies], axis=1)
    stride = lanes.shape[2]
    turn, moves = 12 * stride * body, 1 - motion.still.astype(np.int64)
    return address_of(lanes), address_of(lanes), stride, np.stack([turn, turn + 9 * stride, moves, moves], axis=1)


@hot_kernel
def way_to_point(
    points: Memory, e: int, turns: Memory, places: Memory, step: int, t: int, v: int, w: int
) -> tuple[float, float, float]:  # fmt: skip
    """The way from the origin of a body at place ``w`` to point ``e`` of one with rotation ``t`` and place ``v``."""
    p, q, r = points[3 * e], points[3 * e + 1], points[3 * e + 2]
    x = turns[t] * p + turns[t + step] * q + turns[t + 2 * step] * r + (places[v] - places[w])
    v, w, t = v + step, w + step, t + 3 * step
    y = turns[t] * p + turns[t + step] * q + turns[t + 2 * step] * r + (places[v] - places[w])
    v, w, t = v + step, w + step, t + 3 * step
    z = turns[t] * p + turns[t + step] * q + turns[t + 2 * step] * r + (places[v] - places[w])
    return x, y, z


@hot_kernel
def largest_of(places: Memory, v: int, step: int) -> float:
    """Largest absolute coordinate of a place."""
    largest: float = max(max(abs(places[v]), abs(places[v + step])), abs(places[v + 2 * step]))
    return largest


@hot_kernel
def box_holds(
    boxes: Memory, box: int, points: Memory, first: int, stop: int, turns: Memory, places: Memory, step: int,
    ta: int, va: int, tb: int, vb: int, margin: float,
) -> bool:  # fmt: skip
    """Whether all points of a body with pose ``a`` may lie in a box, (6,) low and high, of one with pose ``b``."""
    stay_one_function()
    for e in range(first, stop):
        x, y, z = way_to_point(points, e, turns, places, step, ta, va, vb)
        for k in range(3):
            at = tb + k * step
            seen = turns[at] * x + turns[at + 3 * step] * y + turns[at + 6 * step] * z
            if seen < boxes[6 * box + k] - margin or seen > boxes[6 * box + 3 + k] + margin:
                return False
    return True


@hot_kernel
def boxes_hold(
    boxes: Memory, box: int, stop_box: int, points: Memory, first: int, stop: int, turns: Memory, places: Memory,
    step: int, ta: int, va: int, tb: int, vb: int, size: float, pad: float,
) -> bool:  # fmt: skip
    """Whether the first of some boxes may hold all points and, if there are more, one of those too."""
    stay_one_function()
    margin = pad * (size + (largest_of(places, va, step) + largest_of(places, vb, step)))
    if not box_holds(boxes, box, points, first, stop, turns, places, step, ta, va, tb, vb, margin):
        return False
    for other in range(box + 1, stop_box):
        if box_holds(boxes, other, points, first, stop, turns, places, step, ta, va, tb, vb, margin):
            return True
    return stop_box == box + 1


@kernel
def any_may_hold(
    rotations: int, translations: int, step: int, starts: IntArray, frames: IntArray, columns: IntArray,
    first: IntArray, rows: IntArray, points: FloatArray, boxes: FloatArray, sizes: FloatArray, pad: float,
    may: BoolArray,
) -> None:  # fmt: skip
    """Fill ``may`` (K,): whether any of the rows (n, 6) ``first[column]`` to ``first[column + 1]`` may hold."""
    turns, places = doubles_at(rotations), doubles_at(translations)
    corners, ends = doubles_of(points), doubles_of(boxes)
    for k in range(len(frames)):
        may[k] = False
        for row in range(first[columns[k]], first[columns[k] + 1]):
            a, b, point, box = rows[row, 0], rows[row, 1], rows[row, 2], rows[row, 3]
            may[k] = may[k] or boxes_hold(
                ends, box, box + rows[row, 5], corners, point, point + rows[row, 4], turns, places, step,
                starts[a, 0] + frames[k] * starts[a, 2], starts[a, 1] + frames[k] * starts[a, 3],
                starts[b, 0] + frames[k] * starts[b, 2], starts[b, 1] + frames[k] * starts[b, 3], sizes[row], pad,
            )  # fmt: skip


@kernel
def may_be_inside(
    rotation: FloatArray, translation: FloatArray, frames: IntArray, inner: int, outer: int, extremes: FloatArray,
    boxes: FloatArray, size: float, pad: float, may: BoolArray,
) -> None:  # fmt: skip
    """Fill ``may`` (K,) for one ``Nesting`` and poses (F, n, 3, 3) and (F, n, 3), n bodies, at frames (K,)."""
    turns, places, points, ends = doubles_of(rotation), doubles_of(translation), doubles_of(extremes), doubles_of(boxes)
    bodies, one, first = rotation.shape[1], runtime_int(1), runtime_int(0)
    for k in range(len(frames)):
        a, b = frames[k] * bodies + inner, frames[k] * bodies + outer
        may[k] = boxes_hold(
            ends, first, len(boxes), points, first, len(extremes), turns, places, one, 9 * a, 3 * a, 9 * b, 3 * b, size,
            pad,
        )  # fmt: skip
