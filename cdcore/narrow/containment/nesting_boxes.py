"""Where a part of one body may be inside another at all: a box of that one may hold the part's outermost points."""

from __future__ import annotations

from typing import NamedTuple

from cdcore.kernels.compiling import hot_kernel, kernel, runtime_int, stay_one_function
from cdcore.kernels.memory import Memory, doubles_of
from cdcore.numerics import BoolArray, FloatArray, IntArray


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
    boxes: Memory, box: int, points: Memory, count: int, poses: PoseMemory, a: int, b: int, margin: float
) -> bool:
    """Whether all ``count`` points of a body in pose ``a`` may lie in a box, (6,) low and high, of one in ``b``."""
    stay_one_function()
    for e in range(count):
        x, y, z = way_to_point(points, e, poses, a, b)
        for k in range(3):
            at = 9 * b + k
            seen = poses.turns[at] * x + poses.turns[at + 3] * y + poses.turns[at + 6] * z
            if seen < boxes[6 * box + k] - margin or seen > boxes[6 * box + 3 + k] + margin:
                return False
    return True


@kernel
def may_be_inside(
    rotation: FloatArray, translation: FloatArray, frames: IntArray, inner: int, outer: int, extremes: FloatArray,
    boxes: FloatArray, size: float, pad: float, may: BoolArray,
) -> None:  # fmt: skip
    """Fill ``may`` (K,): whether the first of the outer body's boxes (B, 2, 3) may hold all points (E, 3) of the inner
    one and, if there are more, one of those too; poses (F, n, 3, 3) and (F, n, 3) of n bodies, at frames (K,).

    ``size``: of both bodies; ``pad``: the margin of a box, as a share of size and distance from the origin.
    """
    poses, bodies = PoseMemory(doubles_of(rotation), doubles_of(translation)), rotation.shape[1]
    points, count, ends, first = doubles_of(extremes), len(extremes), doubles_of(boxes), runtime_int(0)
    for k in range(len(frames)):
        a, b = frames[k] * bodies + inner, frames[k] * bodies + outer
        margin = pad * (size + (largest_of(poses.places, a) + largest_of(poses.places, b)))
        held = box_holds(ends, first, points, count, poses, a, b, margin)
        may[k] = held and len(boxes) == 1
        for box in range(1, len(boxes) if held else 1):
            may[k] = may[k] or box_holds(ends, box, points, count, poses, a, b, margin)
