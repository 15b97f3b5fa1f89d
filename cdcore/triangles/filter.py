"""Decides nearly all triangle pairs in plain float64 and never wrongly: yes, no, or undecided.

Undecided are pairs within rounding of touching, coplanar ones and needles: 0 % of ordinary geometry, nearly all of
resting contact. Four lanes hold the corners of a face (the first one twice), so that the fifteen signs of a face pair
take three vector determinants for the edges and two for the planes.

**Bound.** With edges and differences of corners, each rounded once, the determinant w . (e x f) errs by at most 8.1 u
times its permanent, which is at most 6 |w| |e| |f| in largest components: 49 u |w| |e| |f|.
"""

from typing import Final, NamedTuple

from cdcore.kernels.compiling import always_inlined, hot_kernel, never_inlined
from cdcore.kernels.memory import Memory
from cdcore.kernels.simd import Lanes, above, corners4, dot, first3, first4, following4, minor, minus, size
from cdcore.triangles.exact_pairs import boxes_separated

UNDECIDED: Final = 2
DETERMINANT_BOUND: Final = 64.0 * 2.0**-53
"""Above 49 u."""
UNDERFLOW_GUARD: Final = 1e-250
"""A determinant that small may have lost terms to underflow: undecided."""
LARGEST_FILTERED: Final = 1e70
"""Distances of corners up to this keep every product finite, and what it may lose to underflow below the guard."""


class Corners(NamedTuple):
    """World coordinates of a face's corners 0, 1, 2, 0, or of its edges from these."""

    x: Lanes
    y: Lanes
    z: Lanes


@hot_kernel
def corner_differences(a: Corners, b: Corners) -> Corners:
    """a - b, lane by lane."""
    always_inlined()
    return Corners(minus(a.x, b.x), minus(a.y, b.y), minus(a.z, b.z))


@hot_kernel
def first_of(a: Corners) -> Corners:
    """The first corner in every lane."""
    always_inlined()
    return Corners(first4(a.x), first4(a.y), first4(a.z))


@hot_kernel
def following_corners(a: Corners) -> Corners:
    """In each lane the corner that follows around the face."""
    always_inlined()
    return Corners(following4(a.x), following4(a.y), following4(a.z))


@hot_kernel
def largest(a: Corners) -> float:
    """Largest absolute coordinate."""
    always_inlined()
    (x, y, z), (u, v, w), (p, q, r) = first3(size(a.x)), first3(size(a.y)), first3(size(a.z))
    return max(max(max(max(x, y), max(z, u)), max(max(v, w), max(p, q))), r)


@hot_kernel
def signs(w: Corners, e: Corners, f: Corners, bound: float) -> int:
    """Certain signs of w . (e x f): bits 0-2 above zero, 3-5 below."""
    always_inlined()
    normal = minor(e.y, f.z, e.z, f.y), minor(e.z, f.x, e.x, f.z), minor(e.x, f.y, e.y, f.x)
    d = dot(w.x, w.y, w.z, *normal)
    return (above(d, bound) & 7) | ((above(-bound, d) & 7) << 3)


@hot_kernel
def same_signs(sides: int) -> bool:
    """Three certain and equal signs."""
    always_inlined()
    return (sides & 7) == 7 or (sides >> 3) == 7


@hot_kernel
def crossing_edges(sides: int) -> int:
    """From certain sides of three corners, the edges (bits 0-2) whose ends lie certainly on different sides."""
    always_inlined()
    up, down = sides & 7, sides >> 3
    return (up & ((down >> 1) | (down << 2)) | down & ((up >> 1) | (up << 2))) & 7


@hot_kernel
def corners_meet(a: Corners, b: Corners) -> int:
    """0 no, 1 yes, or UNDECIDED for two faces."""
    always_inlined()
    e, f = corner_differences(following_corners(a), a), corner_differences(following_corners(b), b)
    edge_a, edge_b = largest(e), largest(f)
    reach = largest(corner_differences(first_of(b), a)) + edge_a + edge_b
    # asked this way round, what is not a number is undecided
    if not reach <= LARGEST_FILTERED:
        return UNDECIDED
    scale = DETERMINANT_BOUND * reach
    bound = scale * edge_b * edge_b + UNDERFLOW_GUARD
    sides_a = signs(corner_differences(a, first_of(b)), first_of(f), first_of(following_corners(f)), bound)
    if same_signs(sides_a):
        return 0
    bound = scale * edge_a * edge_a + UNDERFLOW_GUARD
    sides_b = signs(corner_differences(b, first_of(a)), first_of(e), first_of(following_corners(e)), bound)
    if same_signs(sides_b):
        return 0
    bound = scale * edge_a * edge_b + UNDERFLOW_GUARD
    # turns of each edge of A about the edges of B
    u = signs(corner_differences(b, first_of(a)), first_of(e), f, bound)
    a, e = following_corners(a), following_corners(e)
    v = signs(corner_differences(b, first_of(a)), first_of(e), f, bound)
    a, e = following_corners(a), following_corners(e)
    w = signs(corner_differences(b, first_of(a)), first_of(e), f, bound)
    # an edge of A passes B inside when it turns one way about all of B's edges; edge j of B likewise, bit by bit
    inside = int(same_signs(u)) | int(same_signs(v)) << 1 | int(same_signs(w)) << 2
    oriented = u & v & w
    if (crossing_edges(sides_a) & inside) | (crossing_edges(sides_b) & (oriented | (oriented >> 3))):
        return 1
    known = 7
    for side_bits in (sides_a, sides_b, u, v, w):
        known &= side_bits | (side_bits >> 3)
    return 0 if known == 7 else UNDECIDED


@hot_kernel
def pair_meets_filtered(p: Memory) -> int:
    """0 no, 1 yes, or UNDECIDED for rows 0-2 against rows 3-5 of p (6, 3)."""
    never_inlined()
    if boxes_separated(p):
        return 0
    first = Corners(corners4(p, 0), corners4(p, 1), corners4(p, 2))
    second = Corners(corners4(p, 9), corners4(p, 10), corners4(p, 11))
    return corners_meet(first, second)
