"""The compiled sieve before containment: few pair-frames have all of one body within the box of the other."""

from __future__ import annotations

from cdcore.kernels.compiling import hot_kernel, kernel
from cdcore.numerics import BoolArray, FloatArray, IntArray


@hot_kernel
def point_in_box(
    point: FloatArray, ra: FloatArray, ta: FloatArray, rb: FloatArray, tb: FloatArray, box: FloatArray, margin: float
) -> bool:
    """Whether a point of body A may lie in the box (2, 3), low and high, of body B."""
    x = ra[0, 0] * point[0] + ra[0, 1] * point[1] + ra[0, 2] * point[2] + (ta[0] - tb[0])
    y = ra[1, 0] * point[0] + ra[1, 1] * point[1] + ra[1, 2] * point[2] + (ta[1] - tb[1])
    z = ra[2, 0] * point[0] + ra[2, 1] * point[1] + ra[2, 2] * point[2] + (ta[2] - tb[2])
    for k in range(3):
        seen = rb[0, k] * x + rb[1, k] * y + rb[2, k] * z
        if seen < box[0, k] - margin or seen > box[1, k] + margin:
            return False
    return True


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

    ``extremes`` (E, 3): vertices of the inner body; ``box`` (2, 3); the margin is ``pad`` times both bodies' size.
    """
    for k in range(len(frames)):
        ra, ta = rotation[frames[k], inner], translation[frames[k], inner]
        rb, tb = rotation[frames[k], outer], translation[frames[k], outer]
        far = max(abs(ta[0]), abs(ta[1]), abs(ta[2])) + max(abs(tb[0]), abs(tb[1]), abs(tb[2]))
        may[k] = True
        for e in range(len(extremes)):
            if not point_in_box(extremes[e], ra, ta, rb, tb, box, pad * (size + far)):
                may[k] = False
                break
