"""Two faces in eight frames at once: the lanes in which they certainly meet, and those in which they certainly do not.

The signs are those of ``cdcore.triangles.filter``, taken in the frame of a leaf's box and counted only where
they are larger than the kernels' distance from the reference vertices allows (``bounds``, certain signs).
"""

from __future__ import annotations

from cdcore.kernels.compiling import always_inlined, hot_kernel, never_inlined
from cdcore.kernels.memory import Memory
from cdcore.kernels.simd import Lanes, above, dot, load8, minor, minus, triple
from cdcore.kernels.vectors import Vector, between, cross, vector_at
from cdcore.narrow.bvh.bounds import ROUNDOFF, SIGN_PADS, SIGN_ULPS, TINY

Point = tuple[Lanes, Lanes, Lanes]
"""A point or a way in eight frames; one that is fixed is a ``Vector``."""
Signs = tuple[int, int]
"""Lanes in which a value is certainly above zero, and those in which it is certainly below."""


@hot_kernel
def corner_at(placed: Memory, k: int) -> Point:
    """A moved corner."""
    always_inlined()
    return load8(placed, k), load8(placed, k + 8), load8(placed, k + 16)


@hot_kernel
def difference_of(a: Point, b: Point) -> Point:
    """a - b, of which one may be fixed."""
    always_inlined()
    return minus(a[0], b[0]), minus(a[1], b[1]), minus(a[2], b[2])


@hot_kernel
def normal_of(e: Point, f: Point) -> Point:
    """e x f."""
    always_inlined()
    return minor(e[1], f[2], e[2], f[1]), minor(e[2], f[0], e[0], f[2]), minor(e[0], f[1], e[1], f[0])


@hot_kernel
def side(normal: Point, offset: Point, bound: float) -> Signs:
    """On which side of a plane a way from one of its points leads."""
    always_inlined()
    distance = dot(normal[0], normal[1], normal[2], offset[0], offset[1], offset[2])
    return above(distance, bound), above(-bound, distance)


@hot_kernel
def orientation(offset: Point, e: Point, f: Vector, bound: float) -> Signs:
    """Signs of the volume that an edge, a fixed edge and the offset between them span: the orientation of the edges."""
    always_inlined()
    volume = triple(offset[0], offset[1], offset[2], e[0], e[1], e[2], f[0], f[1], f[2])
    return above(volume, bound), above(-bound, volume)


@hot_kernel
def certain_lanes(placed: Memory, boxed: Memory, face: int, size: float, pad: float, mask: int) -> int:
    """Lanes of ``mask`` in which two faces certainly meet, plus 256 times those in which they certainly do not.

    ``placed`` (72,): the moved face. ``size``: no corner of either is further from the origin in the lanes of ``mask``.
    """
    never_inlined()
    reach = 2.0 * size + pad
    bound = reach * reach * (SIGN_PADS * pad + SIGN_ULPS * ROUNDOFF * reach) + TINY
    fixed = vector_at(boxed, 9 * face), vector_at(boxed, 9 * face + 3), vector_at(boxed, 9 * face + 6)
    fixed_edges = between(fixed[0], fixed[1]), between(fixed[1], fixed[2]), between(fixed[2], fixed[0])
    corners = corner_at(placed, 0), corner_at(placed, 24), corner_at(placed, 48)
    normal = cross(fixed_edges[0], fixed_edges[1])
    above_0, below_0 = side(normal, difference_of(corners[0], fixed[0]), bound)
    above_1, below_1 = side(normal, difference_of(corners[1], fixed[0]), bound)
    above_2, below_2 = side(normal, difference_of(corners[2], fixed[0]), bound)
    separated = ((above_0 & above_1 & above_2) | (below_0 & below_1 & below_2)) & mask
    if separated == mask:
        return separated << 8
    edges = (
        difference_of(corners[1], corners[0]),
        difference_of(corners[2], corners[1]),
        difference_of(corners[0], corners[2]),
    )
    plane = normal_of(edges[0], edges[1])
    fixed_above_0, fixed_below_0 = side(plane, difference_of(fixed[0], corners[0]), bound)
    fixed_above_1, fixed_below_1 = side(plane, difference_of(fixed[1], corners[0]), bound)
    fixed_above_2, fixed_below_2 = side(plane, difference_of(fixed[2], corners[0]), bound)
    separated |= (
        (fixed_above_0 & fixed_above_1 & fixed_above_2) | (fixed_below_0 & fixed_below_1 & fixed_below_2)
    ) & mask
    if separated == mask:
        return separated << 8
    known = (above_0 | below_0) & (above_1 | below_1) & (above_2 | below_2)
    known &= (fixed_above_0 | fixed_below_0) & (fixed_above_1 | fixed_below_1) & (fixed_above_2 | fixed_below_2)
    # an edge whose ends lie on both sides passes inside where it turns one way about all edges of the other face
    crosses = (
        (above_0 & below_1) | (below_0 & above_1),
        (above_1 & below_2) | (below_1 & above_2),
        (above_2 & below_0) | (below_2 & above_0),
    )
    meet = 0
    all_positive_0, all_positive_1, all_positive_2 = 255, 255, 255
    all_negative_0, all_negative_1, all_negative_2 = 255, 255, 255
    for k in range(3):
        positive_0, negative_0 = orientation(difference_of(fixed[0], corners[k]), edges[k], fixed_edges[0], bound)
        positive_1, negative_1 = orientation(difference_of(fixed[1], corners[k]), edges[k], fixed_edges[1], bound)
        positive_2, negative_2 = orientation(difference_of(fixed[2], corners[k]), edges[k], fixed_edges[2], bound)
        meet |= crosses[k] & ((positive_0 & positive_1 & positive_2) | (negative_0 & negative_1 & negative_2))
        all_positive_0 &= positive_0
        all_positive_1 &= positive_1
        all_positive_2 &= positive_2
        all_negative_0 &= negative_0
        all_negative_1 &= negative_1
        all_negative_2 &= negative_2
        known &= (positive_0 | negative_0) & (positive_1 | negative_1) & (positive_2 | negative_2)
    meet |= ((fixed_above_0 & fixed_below_1) | (fixed_below_0 & fixed_above_1)) & (all_positive_0 | all_negative_0)
    meet |= ((fixed_above_1 & fixed_below_2) | (fixed_below_1 & fixed_above_2)) & (all_positive_1 | all_negative_1)
    meet |= ((fixed_above_2 & fixed_below_0) | (fixed_below_2 & fixed_above_0)) & (all_positive_2 | all_negative_2)
    return (meet & mask) | ((separated | (known & ~meet)) & mask) << 8
