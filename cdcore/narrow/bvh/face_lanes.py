"""Two faces in eight frames at once: the lanes in which they certainly meet, and those in which they certainly do not.

The signs are those of ``cdcore.narrow.triangles.filter``, taken in the frame of a leaf's box and counted only where
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
def less(a: Point, b: Point) -> Point:
    """a - b, of which one may be fixed."""
    always_inlined()
    return minus(a[0], b[0]), minus(a[1], b[1]), minus(a[2], b[2])


@hot_kernel
def upright(e: Point, f: Point) -> Point:
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
    f = between(fixed[0], fixed[1]), between(fixed[1], fixed[2]), between(fixed[2], fixed[0])
    corners = corner_at(placed, 0), corner_at(placed, 24), corner_at(placed, 48)
    normal = cross(f[0], f[1])
    a0, b0 = side(normal, less(corners[0], fixed[0]), bound)
    a1, b1 = side(normal, less(corners[1], fixed[0]), bound)
    a2, b2 = side(normal, less(corners[2], fixed[0]), bound)
    separated = ((a0 & a1 & a2) | (b0 & b1 & b2)) & mask
    if separated == mask:
        return separated << 8
    e = less(corners[1], corners[0]), less(corners[2], corners[1]), less(corners[0], corners[2])
    plane = upright(e[0], e[1])
    c0, d0 = side(plane, less(fixed[0], corners[0]), bound)
    c1, d1 = side(plane, less(fixed[1], corners[0]), bound)
    c2, d2 = side(plane, less(fixed[2], corners[0]), bound)
    separated |= ((c0 & c1 & c2) | (d0 & d1 & d2)) & mask
    if separated == mask:
        return separated << 8
    known = (a0 | b0) & (a1 | b1) & (a2 | b2) & (c0 | d0) & (c1 | d1) & (c2 | d2)
    # an edge whose ends lie on both sides passes inside where it turns one way about all edges of the other face
    crosses = (a0 & b1) | (b0 & a1), (a1 & b2) | (b1 & a2), (a2 & b0) | (b2 & a0)
    meet, u0, u1, u2, v0, v1, v2 = 0, 255, 255, 255, 255, 255, 255
    for edge in range(3):
        e0, f0 = orientation(less(fixed[0], corners[edge]), e[edge], f[0], bound)
        e1, f1 = orientation(less(fixed[1], corners[edge]), e[edge], f[1], bound)
        e2, f2 = orientation(less(fixed[2], corners[edge]), e[edge], f[2], bound)
        meet |= crosses[edge] & ((e0 & e1 & e2) | (f0 & f1 & f2))
        u0, u1, u2, v0, v1, v2 = u0 & e0, u1 & e1, u2 & e2, v0 & f0, v1 & f1, v2 & f2
        known &= (e0 | f0) & (e1 | f1) & (e2 | f2)
    meet |= ((c0 & d1) | (d0 & c1)) & (u0 | v0)
    meet |= ((c1 & d2) | (d1 & c2)) & (u1 | v1)
    meet |= ((c2 & d0) | (d2 & c0)) & (u2 | v2)
    return (meet & mask) | ((separated | (known & ~meet)) & mask) << 8
