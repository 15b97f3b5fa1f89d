"""The compiled sieve before containment: few pair-frames have all of one body within the box of the other."""

from __future__ import annotations

from cdcore.kernels.compiling import hot_kernel, kernel, stay_one_function
from cdcore.kernels.memory import Memory, doubles_of
from cdcore.numerics import BoolArray, FloatArray, IntArray


@hot_kernel
def point_in_box(
    points: Memory, e: int, turns: Memory, places: Memory, a: int, b: int, box: Memory, margin: float
) -> bool:
    """Whether point ``e`` of a body with pose ``a`` may lie in the box (6,), low and high, of one with pose ``b``."""
    stay_one_function()
    p, q, r = points[3 * e], points[3 * e + 1], points[3 * e + 2]
    t, u, v, w = 9 * a, 9 * b, 3 * a, 3 * b
    x = turns[t] * p + turns[t + 1] * q + turns[t + 2] * r + (places[v] - places[w])
    y = turns[t + 3] * p + turns[t + 4] * q + turns[t + 5] * r + (places[v + 1] - places[w + 1])
    z = turns[t + 6] * p + turns[t + 7] * q + turns[t + 8] * r + (places[v + 2] - places[w + 2])
    for k in range(3):
        seen = turns[u + k] * x + turns[u + 3 + k] * y + turns[u + 6 + k] * z
        if seen < box[k] - margin or seen > box[3 + k] + margin:
            return False
    return True


@hot_kernel
def largest_of(places: Memory, pose: int) -> float:
    """Largest absolute coordinate of the translation of one pose."""
    x, y, z = abs(places[3 * pose]), abs(places[3 * pose + 1]), abs(places[3 * pose + 2])
    largest: float = max(max(x, y), z)
    return largest


@kernel
def may_be_inside(
    rotation: FloatArray,
    translation: FloatArray,
    frames: IntArray,
    inner: int,
    outer: int,
    extremes: FloatArray,
    box: FloatArray,
    size: float,
    pad: float,
    may: BoolArray,
) -> None:
    """Fill ``may`` (K,): False where an outermost vertex of the inner body lies outside the box of the outer one.

    ``extremes`` (E, 3): vertices of the inner body; ``box`` (2, 3); the margin is ``pad`` times both bodies' size. All
    arrays are contiguous.
    """
    turns, places, points, ends = doubles_of(rotation), doubles_of(translation), doubles_of(extremes), doubles_of(box)
    bodies = rotation.shape[1]
    for k in range(len(frames)):
        a, b = frames[k] * bodies + inner, frames[k] * bodies + outer
        margin = pad * (size + (largest_of(places, a) + largest_of(places, b)))
        may[k] = True
        for e in range(len(extremes)):
            if not point_in_box(points, e, turns, places, a, b, ends, margin):
                may[k] = False
                break
