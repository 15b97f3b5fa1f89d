"""Two boxes, two leaves and two faces in eight frames at once: in which they are apart, or meet, for certain.

Two boxes in one pose are tested by ``cdcore.kernels.box_against_box``.

**Boxes.** Centres are exact in every lane. Radii are those of the block's middle frame, widened by how far the relative
rotation strays from it; any direction separates if the widened radii say so.

**Faces.** The slabs of boxes first, then certain signs: those of ``cdcore.triangles.filter``, taken in the frame of a
leaf's box and counted only where they are larger than the kernels' distance from the reference vertices allows
(``bounds``, certain signs). Only the rest is asked at the reference vertices.
"""

from __future__ import annotations

from typing import NamedTuple

from cdcore.kernels.compiling import always_inlined, hot_kernel, never_inlined
from cdcore.kernels.memory import Memory, reader
from cdcore.kernels.simd import (
    Lanes,
    above,
    dot,
    excess,
    first3,
    fused,
    least3,
    load3,
    load4,
    load8,
    minor,
    minus,
    most3,
    moved,
    outside,
    plus,
    size,
    store,
)
from cdcore.kernels.vectors import Vector
from cdcore.narrow.bvh.bounds import EDGE_SLACK, ROUNDOFF, SIGN_PADS, SIGN_ULPS, TINY
from cdcore.narrow.bvh.tree_memory import Block, Scratch

Point = tuple[Lanes, Lanes, Lanes]
"""A point or a difference of points in eight frames; one that is fixed is a ``Vector``."""
Signs = tuple[int, int]
"""Lanes in which a value is certainly above zero, and those in which it is certainly below."""


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
def box_lanes_that_may_meet(block: Block, a: int, b: int, lanes: int) -> int:
    """Those of the lanes in which node a (of A) and node b (of B) are not certainly apart.

    Leaves the centre of a in b's box frame in ``scratch.offset`` (24,). Cross products of axes are tried for two leaves
    only: at inner nodes they cost more than they cull.
    """
    always_inlined()
    tree_a, tree_b, scratch, pad = block.pair.tree_a, block.pair.tree_b, block.scratch, block.pad
    relative, middle, offset, boxes_a = scratch.relative, scratch.middle, scratch.offset, tree_a.boxes
    box_a, box_b = box_at(boxes_a, a), box_at(tree_b.boxes, b)
    (cx, cy, cz), (ha0, ha1, ha2), radius_a = box_a.centre, box_a.half, box_a.radius
    (bx, by, bz), (hb0, hb1, hb2) = box_b.centre, box_b.half
    (b00, b10, b20), (b01, b11, b21), (b02, b12, b22) = box_b.axes_x, box_b.axes_y, box_b.axes_z
    x = moved(minus(load8(relative, 72), bx), cx, cy, cz, load8(relative, 0), load8(relative, 8), load8(relative, 16))
    y = moved(minus(load8(relative, 80), by), cx, cy, cz, load8(relative, 24), load8(relative, 32), load8(relative, 40))
    z = moved(minus(load8(relative, 88), bz), cx, cy, cz, load8(relative, 48), load8(relative, 56), load8(relative, 64))
    t0, t1, t2 = dot(b00, b01, b02, x, y, z), dot(b10, b11, b12, x, y, z), dot(b20, b21, b22, x, y, z)
    e0, e1, e2 = excess(t0, hb0), excess(t1, hb1), excess(t2, hb2)
    radius = radius_a + pad
    lanes &= ~above(dot(e0, e1, e2, e0, e1, e2), radius * radius)
    if lanes == 0:
        return 0
    # entry j (the fourth is not read): axis j of A in the middle frame, then its component along each axis of B
    p, q, r = load4(boxes_a, 16 * a + 3), load4(boxes_a, 16 * a + 6), load4(boxes_a, 16 * a + 9)
    in_b_x = dot(middle[0], middle[1], middle[2], p, q, r)
    in_b_y = dot(middle[3], middle[4], middle[5], p, q, r)
    in_b_z = dot(middle[6], middle[7], middle[8], p, q, r)
    p = dot(b00, b01, b02, in_b_x, in_b_y, in_b_z)
    q = dot(b10, b11, b12, in_b_x, in_b_y, in_b_z)
    r = dot(b20, b21, b22, in_b_x, in_b_y, in_b_z)
    widening = fused(block.chord, radius_a, pad)
    (u00, u01, u02), (u10, u11, u12), (u20, u21, u22) = first3(p), first3(q), first3(r)
    p, q, r = size(p), size(q), size(r)
    (f00, f01, f02), (f10, f11, f12), (f20, f21, f22) = first3(p), first3(q), first3(r)
    lanes &= ~outside(t0, hb0 + widening + dot(f00, f01, f02, ha0, ha1, ha2))
    lanes &= ~outside(t1, hb1 + widening + dot(f10, f11, f12, ha0, ha1, ha2))
    lanes &= ~outside(t2, hb2 + widening + dot(f20, f21, f22, ha0, ha1, ha2))
    if lanes == 0:
        return 0
    r0, r1, r2 = first3(moved(plus(load4(boxes_a, 16 * a + 12), widening), hb0, hb1, hb2, p, q, r))
    lanes &= ~outside(dot(t0, t1, t2, u00, u10, u20), r0)
    lanes &= ~outside(dot(t0, t1, t2, u01, u11, u21), r1)
    lanes &= ~outside(dot(t0, t1, t2, u02, u12, u22), r2)
    if lanes == 0 or tree_a.child[a] >= 0 or tree_b.child[b] >= 0:
        return lanes
    store(offset, 0, t0)
    store(offset, 8, t1)
    store(offset, 16, t2)
    # direction e_i x a_j: radii of B from its other two axes, of A from its other two, both at the middle frame
    lanes &= ~outside(minor(t2, u10, t1, u20), widening + hb1 * f20 + hb2 * f10 + ha1 * f02 + ha2 * f01)
    lanes &= ~outside(minor(t2, u11, t1, u21), widening + hb1 * f21 + hb2 * f11 + ha2 * f00 + ha0 * f02)
    lanes &= ~outside(minor(t2, u12, t1, u22), widening + hb1 * f22 + hb2 * f12 + ha0 * f01 + ha1 * f00)
    lanes &= ~outside(minor(t0, u20, t2, u00), widening + hb2 * f00 + hb0 * f20 + ha1 * f12 + ha2 * f11)
    lanes &= ~outside(minor(t0, u21, t2, u01), widening + hb2 * f01 + hb0 * f21 + ha2 * f10 + ha0 * f12)
    lanes &= ~outside(minor(t0, u22, t2, u02), widening + hb2 * f02 + hb0 * f22 + ha0 * f11 + ha1 * f10)
    lanes &= ~outside(minor(t1, u00, t0, u10), widening + hb0 * f10 + hb1 * f00 + ha1 * f22 + ha2 * f21)
    lanes &= ~outside(minor(t1, u01, t0, u11), widening + hb0 * f11 + hb1 * f01 + ha2 * f20 + ha0 * f22)
    lanes &= ~outside(minor(t1, u02, t0, u12), widening + hb0 * f12 + hb1 * f02 + ha0 * f21 + ha1 * f20)
    return lanes


@hot_kernel
def corner_at(placed: Memory, k: int) -> Point:
    """A moved corner."""
    always_inlined()
    return load8(placed, k), load8(placed, k + 8), load8(placed, k + 16)


@hot_kernel
def difference_of(a: Point, b: Point) -> Point:
    """a - b, each moved or fixed."""
    always_inlined()
    ax, ay, az = a
    bx, by, bz = b
    return minus(ax, bx), minus(ay, by), minus(az, bz)


@hot_kernel
def normal_of(e: Point, f: Point) -> Point:
    """e x f."""
    always_inlined()
    ex, ey, ez = e
    fx, fy, fz = f
    return minor(ey, fz, ez, fy), minor(ez, fx, ex, fz), minor(ex, fy, ey, fx)


@hot_kernel
def side(normal: Point, offset: Point, bound: float) -> Signs:
    """On which side of a plane an offset from one of its points leads."""
    always_inlined()
    distance = dot(*normal, *offset)
    return above(distance, bound), above(-bound, distance)


@hot_kernel
def certain_lanes(placed: Memory, boxed: Memory, face: int, furthest: float, pad: float, mask: int) -> int:
    """Lanes of ``mask`` in which two faces certainly meet, plus 256 times those in which they certainly do not.

    ``placed`` (72,): the moved face. ``furthest``: no corner of either is further from the origin in any of
    the lanes.
    """
    never_inlined()
    reach = 2.0 * furthest + pad
    bound = reach * reach * (SIGN_PADS * pad + SIGN_ULPS * ROUNDOFF * reach) + TINY
    fixed_0, fixed_1, fixed_2 = load3(boxed, 9 * face), load3(boxed, 9 * face + 3), load3(boxed, 9 * face + 6)
    fixed_edge_0 = difference_of(fixed_1, fixed_0)
    fixed_edge_1 = difference_of(fixed_2, fixed_1)
    fixed_edge_2 = difference_of(fixed_0, fixed_2)
    corner_0, corner_1, corner_2 = corner_at(placed, 0), corner_at(placed, 24), corner_at(placed, 48)
    normal = normal_of(fixed_edge_0, fixed_edge_1)
    above_0, below_0 = side(normal, difference_of(corner_0, fixed_0), bound)
    above_1, below_1 = side(normal, difference_of(corner_1, fixed_0), bound)
    above_2, below_2 = side(normal, difference_of(corner_2, fixed_0), bound)
    separated = ((above_0 & above_1 & above_2) | (below_0 & below_1 & below_2)) & mask
    if separated == mask:
        return separated << 8
    edge_0 = difference_of(corner_1, corner_0)
    edge_1 = difference_of(corner_2, corner_1)
    edge_2 = difference_of(corner_0, corner_2)
    plane = normal_of(edge_0, edge_1)
    fixed_above_0, fixed_below_0 = side(plane, difference_of(fixed_0, corner_0), bound)
    fixed_above_1, fixed_below_1 = side(plane, difference_of(fixed_1, corner_0), bound)
    fixed_above_2, fixed_below_2 = side(plane, difference_of(fixed_2, corner_0), bound)
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
    corners, edges = (corner_0, corner_1, corner_2), (edge_0, edge_1, edge_2)
    for k in range(3):
        corner, edge = corners[k], edges[k]
        # orientation of two edges: the side of the plane along both to which the offset between them leads
        positive_0, negative_0 = side(normal_of(edge, fixed_edge_0), difference_of(fixed_0, corner), bound)
        positive_1, negative_1 = side(normal_of(edge, fixed_edge_1), difference_of(fixed_1, corner), bound)
        positive_2, negative_2 = side(normal_of(edge, fixed_edge_2), difference_of(fixed_2, corner), bound)
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


@hot_kernel
def enter_box_frame(box: Memory, b: int, relative: Memory, rotated: Memory) -> None:
    """The rotation of A as seen in box b, in ``rotated`` (72,)."""
    always_inlined()
    for i in range(3):
        row = 16 * b + 3 + i
        x, y, z = box[row], box[row + 3], box[row + 6]
        for j in range(3):
            p, q, r = load8(relative, 8 * j), load8(relative, 24 + 8 * j), load8(relative, 48 + 8 * j)
            store(rotated, 24 * i + 8 * j, dot(x, y, z, p, q, r))


@hot_kernel
def lanes_in_box(corners: Memory, face: int, box: Memory, b: int, pad: float, mask: int, scratch: Scratch) -> int:
    """Lanes of ``mask`` in which a face of A's leaf is not certainly outside one of the slabs of box b.

    Its corners in the box frame go to ``scratch.moved``, its own slabs, wider by the pad, to ``scratch.span``.
    """
    always_inlined()
    rotated, placed, span = scratch.rotated, scratch.moved, scratch.span
    # The last axis first: of most leaves it is the shortest by far, so that most faces outside are outside there.
    for k in range(2, -1, -1):
        p, q, r = load8(rotated, 24 * k), load8(rotated, 24 * k + 8), load8(rotated, 24 * k + 16)
        away, half = load8(scratch.offset, 8 * k), box[16 * b + 12 + k]
        x = moved(away, *load3(corners, 9 * face), p, q, r)
        y = moved(away, *load3(corners, 9 * face + 3), p, q, r)
        z = moved(away, *load3(corners, 9 * face + 6), p, q, r)
        lower, upper = minus(least3(x, y, z), pad), plus(most3(x, y, z), pad)
        mask &= ~(above(lower, half) | above(-half, upper))
        if mask == 0:
            return 0
        store(placed, 8 * k, x)
        store(placed, 24 + 8 * k, y)
        store(placed, 48 + 8 * k, z)
        store(span, 16 * k, lower)
        store(span, 16 * k + 8, upper)
    return mask


@hot_kernel
def near_faces(span: Memory, spans: Memory, first: int, stop: int, mask: int, near: Memory) -> int:
    """Write which faces of B's leaf have slabs that the moved face may overlap; returns how many.

    ``near``: 256 times the number of such a face, plus its lanes. None is decided in between, because the machine
    guesses wrong which face is near: the loop without a branch takes less time.
    """
    always_inlined()
    count = 0
    for face in range(first, stop):
        left = mask
        for k in range(3):
            left &= ~above(load8(span, 16 * k), spans[6 * face + 2 * k + 1])
            left &= ~above(spans[6 * face + 2 * k], load8(span, 16 * k + 8))
        near[count] = face << 8 | left
        count += left != 0
    return count


@hot_kernel
def survivors_of_leaves(block: Block, a: int, b: int, lanes: int) -> int:
    """Write face pairs of two leaf nodes that are not certainly apart to ``scratch.candidates``; returns how many.

    As face, face, lanes in which the world's points are to be asked, and lanes in which they certainly meet.
    """
    always_inlined()
    tree_a, tree_b, pad, scratch = block.pair.tree_a, block.pair.tree_b, block.pad, block.scratch
    candidates, near = scratch.candidates, scratch.near
    enter_box_frame(tree_b.boxes, b, scratch.relative, scratch.rotated)
    # a face of A that overlaps the box in every slab has no corner further out than by the size of its own box
    furthest = tree_b.boxes[16 * b + 15] + 2.0 * (tree_a.boxes[16 * a + 15] * EDGE_SLACK + 2.0 * pad)
    count = 0
    for face_a in range(tree_a.start[a], tree_a.stop[a]):
        inside = lanes_in_box(tree_a.corners, face_a, tree_b.boxes, b, pad, lanes, scratch)
        if inside == 0:
            continue
        for row in range(near_faces(scratch.span, tree_b.spans, tree_b.start[b], tree_b.stop[b], inside, near)):
            face_b, left = near[row] >> 8, near[row] & 255
            certain = certain_lanes(scratch.moved, tree_b.boxed, face_b, furthest, pad, left)
            left &= ~(certain >> 8)
            candidates[4 * count], candidates[4 * count + 1] = face_a, face_b
            candidates[4 * count + 2], candidates[4 * count + 3] = left & ~certain, left & certain
            count += left != 0
    return count
