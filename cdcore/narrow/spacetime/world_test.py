"""Two faces at the reference vertices: a certain yes, a certain no, or left to exact arithmetic.

Four lanes hold the corners of a face (the first one twice), so that the fifteen signs of a face pair take three vector
determinants for the edges and two for the planes.
"""

from __future__ import annotations

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel, stay_one_function
from cdcore.kernels.memory import Memory
from cdcore.narrow.spacetime.bounds import DETERMINANT_ULPS, ROUNDOFF, TINY
from cdcore.narrow.spacetime.memory import Pair
from cdcore.narrow.spacetime.simd import (
    Lanes,
    above,
    first4,
    following4,
    load4,
    minus,
    most3,
    plus,
    second4,
    size,
    store,
    third4,
    times,
    triple,
)

UNDECIDED = 2


@hot_kernel
def place_face(placed: Memory, face: int, entries: Memory, stride: int, frame: int) -> tuple[Lanes, Lanes, Lanes]:
    """World x, y and z of a face's corners (0, 1, 2, 0), rounded as the reference vertices: no fused multiply-add."""
    become_part_of_caller()
    row = 12 * face
    x, y, z = load4(placed, row), load4(placed, row + 4), load4(placed, row + 8)
    a, b, c = entries[frame], entries[frame + stride], entries[frame + 2 * stride]
    wx = plus(plus(plus(times(a, x), times(b, y)), times(c, z)), entries[frame + 9 * stride])
    a, b, c = entries[frame + 3 * stride], entries[frame + 4 * stride], entries[frame + 5 * stride]
    wy = plus(plus(plus(times(a, x), times(b, y)), times(c, z)), entries[frame + 10 * stride])
    a, b, c = entries[frame + 6 * stride], entries[frame + 7 * stride], entries[frame + 8 * stride]
    wz = plus(plus(plus(times(a, x), times(b, y)), times(c, z)), entries[frame + 11 * stride])
    return wx, wy, wz


@hot_kernel
def plane_signs(
    x: Lanes, y: Lanes, z: Lanes, px: Lanes, py: Lanes, pz: Lanes, ex: Lanes, ey: Lanes, ez: Lanes, bound: float
) -> int:
    """Certain sides of corners x, y, z at the plane of a face with corners p and edges e: bits 0-2 above, 3-5 below."""
    become_part_of_caller()
    d = triple(
        minus(x, first4(px)), minus(y, first4(py)), minus(z, first4(pz)),
        first4(ex), first4(ey), first4(ez), second4(ex), second4(ey), second4(ez),
    )  # fmt: skip
    return (above(d, bound) & 7) | ((above(-bound, d) & 7) << 3)


@hot_kernel
def edge_signs(
    px: Lanes, py: Lanes, pz: Lanes, ex: Lanes, ey: Lanes, ez: Lanes, qx: Lanes, qy: Lanes, qz: Lanes, fx: Lanes,
    fy: Lanes, fz: Lanes, bound: float,
) -> int:  # fmt: skip
    """Certain turns of one edge (corner p, vector e, in every lane) against three others: bits 0-2 left, 3-5 right."""
    become_part_of_caller()
    d = triple(minus(qx, px), minus(qy, py), minus(qz, pz), ex, ey, ez, fx, fy, fz)
    return (above(d, bound) & 7) | ((above(-bound, d) & 7) << 3)


@hot_kernel
def largest(x: Lanes, y: Lanes, z: Lanes, scratch: Memory) -> float:
    """Largest absolute value in the lanes."""
    become_part_of_caller()
    store(scratch, 0, most3(size(x), size(y), size(z)))
    most_: float = max(max(scratch[0], scratch[1]), max(scratch[2], scratch[3]))
    return most_


@hot_kernel
def crossing(sides: int) -> int:
    """From certain sides of three corners, the edges (bits 0-2) whose ends lie certainly on different sides."""
    become_part_of_caller()
    up, down = sides & 7, sides >> 3
    return (up & ((down >> 1) | (down << 2)) | down & ((up >> 1) | (up << 2))) & 7


@hot_kernel
def filtered_answer(
    ax: Lanes, ay: Lanes, az: Lanes, bx: Lanes, by: Lanes, bz: Lanes, edge_a: float, edge_b: float, scratch: Memory
) -> int:
    """0, 1 or UNDECIDED for two faces given by their corners; ``edge_a`` and ``edge_b`` bound their edges."""
    become_part_of_caller()
    apart = largest(minus(first4(bx), ax), minus(first4(by), ay), minus(first4(bz), az), scratch)
    scale = DETERMINANT_ULPS * ROUNDOFF * (apart + edge_a + edge_b)
    ex, ey, ez = minus(following4(ax), ax), minus(following4(ay), ay), minus(following4(az), az)
    fx, fy, fz = minus(following4(bx), bx), minus(following4(by), by), minus(following4(bz), bz)
    a = plane_signs(ax, ay, az, bx, by, bz, fx, fy, fz, scale * edge_b * edge_b + TINY)
    if (a & 7) == 7 or (a >> 3) == 7:
        return 0
    b = plane_signs(bx, by, bz, ax, ay, az, ex, ey, ez, scale * edge_a * edge_a + TINY)
    if (b & 7) == 7 or (b >> 3) == 7:
        return 0
    bound = scale * edge_a * edge_b + TINY
    u = edge_signs(
        first4(ax), first4(ay), first4(az), first4(ex), first4(ey), first4(ez), bx, by, bz, fx, fy, fz, bound
    )
    v = edge_signs(
        second4(ax), second4(ay), second4(az), second4(ex), second4(ey), second4(ez), bx, by, bz, fx, fy, fz, bound
    )
    w = edge_signs(
        third4(ax), third4(ay), third4(az), third4(ex), third4(ey), third4(ez), bx, by, bz, fx, fy, fz, bound
    )
    # an edge of A passes B inside when it turns one way about all of B's edges; edge j of B likewise, bit by bit
    inside = int((u & 7) == 7 or (u >> 3) == 7)
    inside |= int((v & 7) == 7 or (v >> 3) == 7) << 1
    inside |= int((w & 7) == 7 or (w >> 3) == 7) << 2
    turns = u & v & w
    if (crossing(a) & inside) | (crossing(b) & (turns | (turns >> 3))):
        return 1
    known = (a | (a >> 3)) & (b | (b >> 3)) & (u | (u >> 3)) & (v | (v >> 3)) & (w | (w >> 3)) & 7
    return 0 if known == 7 else UNDECIDED


@hot_kernel
def faces_meet(pair: Pair, face_a: int, edge_a: float, face_b: int, edge_b: float, frame: int, scratch: Memory) -> int:
    """Whether two faces meet in a frame, placed: 0, 1, or UNDECIDED where only exact arithmetic can tell.

    ``edge_a`` and ``edge_b`` bound their edges; ``scratch`` (4,).
    """
    stay_one_function()
    pose_a, pose_b = pair.pose_a, pair.pose_b
    ax, ay, az = place_face(pair.tree_a.placed, face_a, pose_a.entries, pose_a.stride, frame * pose_a.step)
    bx, by, bz = place_face(pair.tree_b.placed, face_b, pose_b.entries, pose_b.stride, frame * pose_b.step)
    return filtered_answer(ax, ay, az, bx, by, bz, edge_a, edge_b, scratch)
