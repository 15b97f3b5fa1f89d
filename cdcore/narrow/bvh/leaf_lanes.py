"""The faces of two leaves in eight frames: the slabs of a leaf's box, certain signs; the rest is asked in the world."""

from __future__ import annotations

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel, runtime_int
from cdcore.kernels.memory import Memory
from cdcore.kernels.simd import above, dot, least3, load8, most3, moved, store
from cdcore.narrow.bvh.bounds import EDGE_SLACK
from cdcore.narrow.bvh.face_lanes import certain_lanes
from cdcore.narrow.bvh.tree_memory import Pair, Scratch


@hot_kernel
def enter_box_frame(box: Memory, b: int, relative: Memory, turned: Memory) -> None:
    """The rotation of A as seen in box b, in ``turned`` (72,)."""
    become_part_of_caller()
    for i in range(3):
        row = 16 * b + 3 + i
        x, y, z = box[row], box[row + 3], box[row + 6]
        for j in range(3):
            p, q, r = load8(relative, 8 * j), load8(relative, 24 + 8 * j), load8(relative, 48 + 8 * j)
            store(turned, 24 * i + 8 * j, dot(x, y, z, p, q, r))


@hot_kernel
def move_face(corners: Memory, face: int, turned: Memory, offset: Memory, placed: Memory) -> None:
    """Corners of a face of A's leaf in the box frame, (72,)."""
    become_part_of_caller()
    for c in range(3):
        at = 9 * face + 3 * c
        x, y, z = corners[at], corners[at + 1], corners[at + 2]
        for k in range(3):
            p, q, r = load8(turned, 24 * k), load8(turned, 24 * k + 8), load8(turned, 24 * k + 16)
            store(placed, 24 * c + 8 * k, moved(load8(offset, 8 * k), x, y, z, p, q, r))


@hot_kernel
def lanes_in_box(placed: Memory, box: Memory, b: int, pad: float, mask: int, span: Memory) -> int:
    """Lanes in which the moved face is not certainly outside one of the box's slabs; its own go to ``span`` (48,)."""
    become_part_of_caller()
    for k in range(3):
        half = box[16 * b + 12 + k] + pad
        x, y, z = load8(placed, 8 * k), load8(placed, 24 + 8 * k), load8(placed, 48 + 8 * k)
        low, high = least3(x, y, z), most3(x, y, z)
        mask &= ~(above(low, half) | above(-half, high))
        store(span, 16 * k, low)
        store(span, 16 * k + 8, high)
    return mask


@hot_kernel
def lanes_in_span(span: Memory, spans: Memory, face: int, pad: float, mask: int) -> int:
    """Lanes in which the moved face's slabs and those of a fixed face are not certainly disjoint."""
    become_part_of_caller()
    for k in range(3):
        mask &= ~above(load8(span, 16 * k), spans[6 * face + 2 * k + 1] + pad)
        mask &= ~above(spans[6 * face + 2 * k] - pad, load8(span, 16 * k + 8))
    return mask


@hot_kernel
def survivors_of_leaves(pair: Pair, a: int, b: int, pad: float, mask: int, scratch: Scratch) -> int:
    """Write face pairs of two leaf nodes that are not certainly apart to ``scratch.found``; returns how many.

    As face, face, lanes in which the world's points are to be asked, and lanes in which they certainly meet.
    """
    become_part_of_caller()
    tree_a, tree_b, placed, span = pair.tree_a, pair.tree_b, scratch.moved, scratch.span
    found = scratch.found
    enter_box_frame(tree_b.boxes, b, scratch.relative, scratch.turned)
    row_a, row_b = 2 * runtime_int(tree_a.links[2 * a + 1]), 2 * runtime_int(tree_b.links[2 * b + 1])
    first_a, first_b = runtime_int(tree_a.leaves[row_a]), runtime_int(tree_b.leaves[row_b])
    stop_a, stop_b = first_a + runtime_int(tree_a.leaves[row_a + 1]), first_b + runtime_int(tree_b.leaves[row_b + 1])
    # a face of A that overlaps the box in every slab has no corner further out than by the size of its own box
    size, count = tree_b.boxes[16 * b + 15] + 2.0 * (tree_a.boxes[16 * a + 15] * EDGE_SLACK + 2.0 * pad), 0
    for face_a in range(first_a, stop_a):
        move_face(tree_a.corners, face_a, scratch.turned, scratch.offset, placed)
        inside = lanes_in_box(placed, tree_b.boxes, b, pad, mask, span)
        if inside == 0:
            continue
        for face_b in range(first_b, stop_b):
            left = lanes_in_span(span, tree_b.spans, face_b, pad, inside)
            if left == 0:
                continue
            certain = certain_lanes(placed, tree_b.boxed, face_b, size, pad, left)
            left &= ~(certain >> 8)
            found[4 * count], found[4 * count + 1] = face_a, face_b
            found[4 * count + 2], found[4 * count + 3] = left & ~certain, left & certain
            count += left != 0
    return count
