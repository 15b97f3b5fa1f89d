"""Two faces in eight frames at once: the lanes in which they certainly meet, and those in which they certainly do not.

The signs are those of ``cdcore.narrow.triangles.filter``, taken in the frame of a leaf's box and counted only where
they are larger than the kernels' distance from the reference vertices allows (``bounds``, certain signs).
"""

from __future__ import annotations

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel, stay_one_function
from cdcore.kernels.memory import Memory
from cdcore.kernels.simd import Lanes, above, dot, load8, minus, moved, plus, store, turn
from cdcore.narrow.bvh.bounds import ROUNDOFF, SIGN_PADS, SIGN_ULPS, TINY

MOVED_EDGES = 176
"""Doubles of a moved face, eight of each: its edges and their moments about the origin, its plane and where that is;
then the same of a fixed face, one of each."""


@hot_kernel
def move_edges(placed: Memory, p: int, q: int, r: int, out: Memory) -> None:
    """Fill the first part of ``out`` (EDGE_ROOM,) for a face with corners at ``placed[p]``, ``q`` and ``r``."""
    stay_one_function()
    for edge in range(3):
        start, stop = (p if edge == 0 else q if edge == 1 else r), (q if edge == 0 else r if edge == 1 else p)
        x, y, z = load8(placed, start), load8(placed, start + 8), load8(placed, start + 16)
        u, v, w = minus(load8(placed, stop), x), minus(load8(placed, stop + 8), y), minus(load8(placed, stop + 16), z)
        at = 48 * edge
        store(out, at, u)
        store(out, at + 8, v)
        store(out, at + 16, w)
        store(out, at + 24, turn(y, w, z, v))
        store(out, at + 32, turn(z, u, x, w))
        store(out, at + 40, turn(x, v, y, u))
    a, b, c = load8(out, 0), load8(out, 8), load8(out, 16)
    d, e, f = load8(out, 48), load8(out, 56), load8(out, 64)
    x, y, z = turn(b, f, c, e), turn(c, d, a, f), turn(a, e, b, d)
    store(out, 144, x)
    store(out, 152, y)
    store(out, 160, z)
    store(out, 168, dot(x, y, z, load8(placed, p), load8(placed, p + 8), load8(placed, p + 16)))


@hot_kernel
def fix_plane(p: Memory, first: int, out: Memory) -> None:
    """Fill the last four numbers of ``out`` for a face with corners ``p[first : first + 9]``."""
    become_part_of_caller()
    a, b, c = p[first + 3] - p[first], p[first + 4] - p[first + 1], p[first + 5] - p[first + 2]
    d, e, f = p[first + 6] - p[first + 3], p[first + 7] - p[first + 4], p[first + 8] - p[first + 5]
    x, y, z, at = b * f - c * e, c * d - a * f, a * e - b * d, MOVED_EDGES + 18
    out[at], out[at + 1], out[at + 2] = x, y, z
    out[at + 3] = x * p[first] + y * p[first + 1] + z * p[first + 2]


@hot_kernel
def fix_edges(p: Memory, first: int, out: Memory) -> None:
    """Fill the edges of ``out`` for a face with corners ``p[first : first + 9]``."""
    become_part_of_caller()
    for edge in range(3):
        start, stop, at = first + 3 * edge, first + (3 * edge + 3) % 9, MOVED_EDGES + 6 * edge
        x, y, z = p[start], p[start + 1], p[start + 2]
        u, v, w = p[stop] - x, p[stop + 1] - y, p[stop + 2] - z
        out[at], out[at + 1], out[at + 2] = u, v, w
        out[at + 3], out[at + 4], out[at + 5] = y * w - z * v, z * u - x * w, x * v - y * u


@hot_kernel
def edges_turn(u: Lanes, v: Lanes, w: Lanes, x: Lanes, y: Lanes, z: Lanes, edges: Memory, at: int) -> Lanes:
    """The volume that an edge, given with its moment, and a fixed edge span."""
    become_part_of_caller()
    return plus(
        dot(edges[at + 3], edges[at + 4], edges[at + 5], u, v, w), dot(edges[at], edges[at + 1], edges[at + 2], x, y, z)
    )


@hot_kernel
def moved_corner(placed: Memory, corner: int, edges: Memory) -> Lanes:
    """Which side of the fixed face's plane a moved corner is on."""
    become_part_of_caller()
    at = MOVED_EDGES + 18
    x, y, z = load8(placed, corner), load8(placed, corner + 8), load8(placed, corner + 16)
    return moved(-edges[at + 3], edges[at], edges[at + 1], edges[at + 2], x, y, z)


@hot_kernel
def fixed_corner(boxed: Memory, corner: int, edges: Memory) -> Lanes:
    """Which side of the moved face's plane a fixed corner is on."""
    become_part_of_caller()
    x, y, z = load8(edges, 144), load8(edges, 152), load8(edges, 160)
    return minus(dot(boxed[corner], boxed[corner + 1], boxed[corner + 2], x, y, z), load8(edges, 168))


@hot_kernel
def signs_of(first: Lanes, second: Lanes, third: Lanes, bound: float) -> tuple[int, int, int, int, int, int]:
    """Lanes in which each of three values is certainly above zero, then those below."""
    become_part_of_caller()
    return (
        above(first, bound), above(second, bound), above(third, bound),
        above(-bound, first), above(-bound, second), above(-bound, third),
    )  # fmt: skip


@hot_kernel
def certain_lanes(
    placed: Memory, p: int, q: int, r: int, boxed: Memory, face: int, edges: Memory, size: float, pad: float, mask: int
) -> int:  # fmt: skip
    """Of ``mask`` the lanes in which two faces certainly meet, plus 256 times those in which they certainly do not.

    ``edges``: of the moved face. ``size``: no corner of either is further from the origin, in the lanes of ``mask``.
    """
    stay_one_function()
    fix_plane(boxed, 9 * face, edges)
    reach = 2.0 * size + pad
    bound = reach * reach * (SIGN_PADS * pad + SIGN_ULPS * ROUNDOFF * reach) + TINY
    row, at = 9 * face, MOVED_EDGES
    a0, a1, a2, b0, b1, b2 = signs_of(
        moved_corner(placed, p, edges), moved_corner(placed, q, edges), moved_corner(placed, r, edges), bound
    )
    c0, c1, c2, d0, d1, d2 = signs_of(
        fixed_corner(boxed, row, edges), fixed_corner(boxed, row + 3, edges), fixed_corner(boxed, row + 6, edges), bound
    )
    apart = ((a0 & a1 & a2) | (b0 & b1 & b2) | (c0 & c1 & c2) | (d0 & d1 & d2)) & mask
    if apart == mask:
        return apart << 8
    fix_edges(boxed, row, edges)
    known = (a0 | b0) & (a1 | b1) & (a2 | b2) & (c0 | d0) & (c1 | d1) & (c2 | d2)
    meet, u0, u1, u2, v0, v1, v2 = 0, 255, 255, 255, 255, 255, 255
    for edge in range(3):
        k = 48 * edge
        u, v, w = load8(edges, k), load8(edges, k + 8), load8(edges, k + 16)
        x, y, z = load8(edges, k + 24), load8(edges, k + 32), load8(edges, k + 40)
        e0, e1, e2, f0, f1, f2 = signs_of(
            edges_turn(u, v, w, x, y, z, edges, at), edges_turn(u, v, w, x, y, z, edges, at + 6),
            edges_turn(u, v, w, x, y, z, edges, at + 12), bound,
        )  # fmt: skip
        # an edge whose ends lie on both sides passes inside where it turns one way about all edges of the other face
        ends = (a0 & b1) | (b0 & a1) if edge == 0 else (a1 & b2) | (b1 & a2) if edge == 1 else (a2 & b0) | (b2 & a0)
        meet |= ends & ((e0 & e1 & e2) | (f0 & f1 & f2))
        u0, u1, u2, v0, v1, v2 = u0 & e0, u1 & e1, u2 & e2, v0 & f0, v1 & f1, v2 & f2
        known &= (e0 | f0) & (e1 | f1) & (e2 | f2)
    meet |= ((c0 & d1) | (d0 & c1)) & (u0 | v0)
    meet |= ((c1 & d2) | (d1 & c2)) & (u1 | v1)
    meet |= ((c2 & d0) | (d2 & c0)) & (u2 | v2)
    return (meet & mask) | ((apart | (known & ~meet)) & mask) << 8
