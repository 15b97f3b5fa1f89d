"""Which pair-frames are asked about containment at all: those in which a box of one body may hold the other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cdcore.kernels.compiling import hot_kernel, kernel, runtime_int, stay_one_function
from cdcore.kernels.memory import Memory, doubles_of
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


class NestingArrays(NamedTuple):
    """The nestings of P pairs: those of pair p are rows ``first[p]`` to ``first[p + 1]``.

    ``rows`` (n, 6): inner and outer body, where its points and boxes begin, how many there are of both; ``points``
    (E, 3), ``boxes`` (B, 2, 3) and ``sizes`` (n,) of all.
    """

    first: IntArray
    rows: IntArray
    points: FloatArray
    boxes: FloatArray
    sizes: FloatArray


class NestingBoxes:
    """The nestings of P pairs, asked in one call for all pair-frames."""

    def __init__(self, nestings: Sequence[Sequence[Nesting]]) -> None:
        rows, none = [one for two in nestings for one in two], (0, 3)
        ends = np.cumsum([[0, 0], *((len(one.points), len(one.boxes)) for one in rows)], axis=0)
        bodies = np.array([one[:2] for one in rows], dtype=np.int64).reshape(-1, 2)
        self._arrays = NestingArrays(
            np.cumsum([0, *map(len, nestings)]),
            np.concatenate([bodies, ends[:-1], np.diff(ends, axis=0)], axis=1),
            np.concatenate([np.empty(none), *(one.points for one in rows)]),
            np.concatenate([np.empty((0, 2, 3)), *(one.boxes for one in rows)]),
            np.array([one.size for one in rows], dtype=np.float64),
        )

    def may_hold(self, motion: Motion, frames: IntArray, columns: IntArray, pad: float) -> BoolArray:
        """Whether one body of a pair may hold a part of the other, (K,) for K pair-frames.

        ``pad``: the margin of a box, as a share of the bodies' size and distance from the origin.
        """
        may = np.empty(len(frames), dtype=np.bool_)
        any_may_hold(motion.rotations, motion.translations, frames, columns, self._arrays, pad, may)
        return may


class PoseMemory(NamedTuple):
    """Rotations (9,) and translations (3,) of all bodies, frame after frame."""

    turns: Memory
    places: Memory


@hot_kernel
def way_to_point(points: Memory, e: int, poses: PoseMemory, a: int, b: int) -> tuple[float, float, float]:
    """The way from the origin of pose ``b`` to point ``e`` of a body in pose ``a``, in the world."""
    p, q, r = points[3 * e], points[3 * e + 1], points[3 * e + 2]
    turns, places, t = poses.turns, poses.places, 9 * a
    x = turns[t] * p + turns[t + 1] * q + turns[t + 2] * r + (places[3 * a] - places[3 * b])
    y = turns[t + 3] * p + turns[t + 4] * q + turns[t + 5] * r + (places[3 * a + 1] - places[3 * b + 1])
    z = turns[t + 6] * p + turns[t + 7] * q + turns[t + 8] * r + (places[3 * a + 2] - places[3 * b + 2])
    return x, y, z


@hot_kernel
def largest_of(places: Memory, pose: int) -> float:
    """Largest absolute coordinate of a place."""
    x, y, z = abs(places[3 * pose]), abs(places[3 * pose + 1]), abs(places[3 * pose + 2])
    largest: float = max(max(x, y), z)
    return largest


@hot_kernel
def box_holds(
    boxes: Memory, box: int, points: Memory, first: int, stop: int, poses: PoseMemory, a: int, b: int, margin: float
) -> bool:
    """Whether all points of a body in pose ``a`` may lie in a box, (6,) low and high, of one in pose ``b``."""
    stay_one_function()
    for e in range(first, stop):
        x, y, z = way_to_point(points, e, poses, a, b)
        for k in range(3):
            at = 9 * b + k
            seen = poses.turns[at] * x + poses.turns[at + 3] * y + poses.turns[at + 6] * z
            if seen < boxes[6 * box + k] - margin or seen > boxes[6 * box + 3 + k] + margin:
                return False
    return True


class NestingMemory(NamedTuple):
    """A ``Nesting`` as kernels see it: where its points and its boxes begin and end, and the size of both bodies."""

    points: Memory
    first_point: int
    stop_point: int
    boxes: Memory
    first_box: int
    stop_box: int
    size: float


@hot_kernel
def boxes_hold(nesting: NestingMemory, poses: PoseMemory, a: int, b: int, pad: float) -> bool:
    """Whether the first of some boxes may hold all points and, if there are more, one of those too."""
    stay_one_function()
    points, first, stop, boxes, box, stop_box, size = nesting
    margin = pad * (size + (largest_of(poses.places, a) + largest_of(poses.places, b)))
    if not box_holds(boxes, box, points, first, stop, poses, a, b, margin):
        return False
    for other in range(box + 1, stop_box):
        if box_holds(boxes, other, points, first, stop, poses, a, b, margin):
            return True
    return stop_box == box + 1


@kernel
def any_may_hold(
    rotations: FloatArray, translations: FloatArray, frames: IntArray, columns: IntArray, nestings: NestingArrays,
    pad: float, may: BoolArray,
) -> None:  # fmt: skip
    """Fill ``may`` (K,): whether any nesting of a pair may hold, in K pair-frames."""
    poses, bodies = PoseMemory(doubles_of(rotations), doubles_of(translations)), rotations.shape[1]
    points, boxes = doubles_of(nestings.points), doubles_of(nestings.boxes)
    for k in range(len(frames)):
        may[k] = False
        for row in range(nestings.first[columns[k]], nestings.first[columns[k] + 1]):
            inner, outer, point, box, point_count, box_count = nestings.rows[row]
            nesting = NestingMemory(
                points, point, point + point_count, boxes, box, box + box_count, nestings.sizes[row]
            )
            a, b = frames[k] * bodies + inner, frames[k] * bodies + outer
            may[k] = may[k] or boxes_hold(nesting, poses, a, b, pad)


@kernel
def may_be_inside(
    rotation: FloatArray, translation: FloatArray, frames: IntArray, inner: int, outer: int, extremes: FloatArray,
    boxes: FloatArray, size: float, pad: float, may: BoolArray,
) -> None:  # fmt: skip
    """Fill ``may`` (K,) for one ``Nesting`` and poses (F, n, 3, 3) and (F, n, 3), n bodies, at frames (K,)."""
    poses, bodies, first = PoseMemory(doubles_of(rotation), doubles_of(translation)), rotation.shape[1], runtime_int(0)
    points, ends = doubles_of(extremes), doubles_of(boxes)
    nesting = NestingMemory(points, first, len(extremes), ends, first, len(boxes), size)
    for k in range(len(frames)):
        may[k] = boxes_hold(nesting, poses, frames[k] * bodies + inner, frames[k] * bodies + outer, pad)
