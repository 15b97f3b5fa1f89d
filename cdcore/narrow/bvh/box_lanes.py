"""Two boxes in eight frames: which frames keep them apart for certain.

Centres are exact in every lane. Radii are those of the block's middle frame, widened by how far the relative rotation
strays from it; any direction separates if the widened radii say so.
"""

from __future__ import annotations

from typing import NamedTuple

from cdcore.kernels.compiling import always_inlined, hot_kernel
from cdcore.kernels.memory import Memory, reader
from cdcore.kernels.simd import (
    above,
    dot,
    excess,
    first3,
    fused,
    load4,
    load8,
    minor,
    minus,
    moved,
    outside,
    plus,
    size,
    store,
)
from cdcore.kernels.vectors import Vector
from cdcore.narrow.bvh.tree_memory import Scratch


class Box(NamedTuple):
    """A row of ``BoxTree.boxes``: an oriented box and the radius of the ball around it.

    ``axes_x``: the x components of its three axes; ``half``: half its lengths along these.
    """

    centre: Vector
    axes_x: Vector
    axes_y: Vector
    axes_z: Vector
    half: Vector
    radius: float


box_at = reader(Box)


@hot_kernel
def lanes_that_may_meet(
    boxes_a: Memory,
    a: int,
    boxes_b: Memory,
    b: int,
    chord: float,
    pad: float,
    mask: int,
    leaves: bool,
    scratch: Scratch,
) -> int:
    """Lanes of ``mask`` in which node a (of A) and node b (of B) are not certainly apart.

    ``scratch.relative`` (96,): poses of A in B's frame, ``scratch.middle`` (9,): the rotation of the middle frame.
    Leaves the centre of a in b's box frame in ``scratch.offset`` (24,). Cross products of axes are tried for two leaves
    only: at inner nodes they cost more than they cull.
    """
    always_inlined()
    relative, middle, offset = scratch.relative, scratch.middle, scratch.offset
    box_a, box_b = box_at(boxes_a, a), box_at(boxes_b, b)
    (cx, cy, cz), (ha0, ha1, ha2), radius_a = box_a.centre, box_a.half, box_a.radius
    (bx, by, bz), (hb0, hb1, hb2) = box_b.centre, box_b.half
    (b00, b10, b20), (b01, b11, b21), (b02, b12, b22) = box_b.axes_x, box_b.axes_y, box_b.axes_z
    x = moved(minus(load8(relative, 72), bx), cx, cy, cz, load8(relative, 0), load8(relative, 8), load8(relative, 16))
    y = moved(minus(load8(relative, 80), by), cx, cy, cz, load8(relative, 24), load8(relative, 32), load8(relative, 40))
    z = moved(minus(load8(relative, 88), bz), cx, cy, cz, load8(relative, 48), load8(relative, 56), load8(relative, 64))
    t0, t1, t2 = dot(b00, b01, b02, x, y, z), dot(b10, b11, b12, x, y, z), dot(b20, b21, b22, x, y, z)
    e0, e1, e2 = excess(t0, hb0), excess(t1, hb1), excess(t2, hb2)
    radius = radius_a + pad
    mask &= ~above(dot(e0, e1, e2, e0, e1, e2), radius * radius)
    if mask == 0:
        return 0
    # entry j (the fourth is not read): axis j of A in the middle frame, then its component along each axis of B
    p, q, r = load4(boxes_a, 16 * a + 3), load4(boxes_a, 16 * a + 6), load4(boxes_a, 16 * a + 9)
    in_b_x = dot(middle[0], middle[1], middle[2], p, q, r)
    in_b_y = dot(middle[3], middle[4], middle[5], p, q, r)
    in_b_z = dot(middle[6], middle[7], middle[8], p, q, r)
    p = dot(b00, b01, b02, in_b_x, in_b_y, in_b_z)
    q = dot(b10, b11, b12, in_b_x, in_b_y, in_b_z)
    r = dot(b20, b21, b22, in_b_x, in_b_y, in_b_z)
    widening = fused(chord, radius_a, pad)
    (u00, u01, u02), (u10, u11, u12), (u20, u21, u22) = first3(p), first3(q), first3(r)
    p, q, r = size(p), size(q), size(r)
    (f00, f01, f02), (f10, f11, f12), (f20, f21, f22) = first3(p), first3(q), first3(r)
    mask &= ~outside(t0, hb0 + widening + dot(f00, f01, f02, ha0, ha1, ha2))
    mask &= ~outside(t1, hb1 + widening + dot(f10, f11, f12, ha0, ha1, ha2))
    mask &= ~outside(t2, hb2 + widening + dot(f20, f21, f22, ha0, ha1, ha2))
    if mask == 0:
        return 0
    r0, r1, r2 = first3(moved(plus(load4(boxes_a, 16 * a + 12), widening), hb0, hb1, hb2, p, q, r))
    mask &= ~outside(dot(t0, t1, t2, u00, u10, u20), r0)
    mask &= ~outside(dot(t0, t1, t2, u01, u11, u21), r1)
    mask &= ~outside(dot(t0, t1, t2, u02, u12, u22), r2)
    if mask == 0 or not leaves:
        return mask
    store(offset, 0, t0)
    store(offset, 8, t1)
    store(offset, 16, t2)
    # direction e_i x a_j: radii of B from its other two axes, of A from its other two, both at the middle frame
    mask &= ~outside(minor(t2, u10, t1, u20), widening + hb1 * f20 + hb2 * f10 + ha1 * f02 + ha2 * f01)
    mask &= ~outside(minor(t2, u11, t1, u21), widening + hb1 * f21 + hb2 * f11 + ha2 * f00 + ha0 * f02)
    mask &= ~outside(minor(t2, u12, t1, u22), widening + hb1 * f22 + hb2 * f12 + ha0 * f01 + ha1 * f00)
    mask &= ~outside(minor(t0, u20, t2, u00), widening + hb2 * f00 + hb0 * f20 + ha1 * f12 + ha2 * f11)
    mask &= ~outside(minor(t0, u21, t2, u01), widening + hb2 * f01 + hb0 * f21 + ha2 * f10 + ha0 * f12)
    mask &= ~outside(minor(t0, u22, t2, u02), widening + hb2 * f02 + hb0 * f22 + ha0 * f11 + ha1 * f10)
    mask &= ~outside(minor(t1, u00, t0, u10), widening + hb0 * f10 + hb1 * f00 + ha1 * f22 + ha2 * f21)
    mask &= ~outside(minor(t1, u01, t0, u11), widening + hb0 * f11 + hb1 * f01 + ha2 * f20 + ha0 * f22)
    mask &= ~outside(minor(t1, u02, t0, u12), widening + hb0 * f12 + hb1 * f02 + ha0 * f21 + ha1 * f20)
    return mask
