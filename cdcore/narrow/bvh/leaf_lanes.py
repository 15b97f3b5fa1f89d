"""The faces of two leaves in eight frames: the slabs of a leaf's box, certain signs; the rest is asked in the world."""

from __future__ import annotations

from cdcore.kernels.compiling import always_inlined, hot_kernel
from cdcore.kernels.memory import Memory
from cdcore.kernels.simd import above, dot, least3, load8, minus, most3, moved, plus, store
from cdcore.kernels.vectors import vector_at
from cdcore.narrow.bvh.bounds import EDGE_SLACK
from cdcore.narrow.bvh.face_lanes import certain_lanes
from cdcore.narrow.bvh.tree_memory import Pair, Scratch, TreeMemory


@hot_kernel
def faces_of_leaf(tree: TreeMemory, node: int) -> tuple[int, int]:
    """The first face of a leaf node, and the one after its last."""
    always_inlined()
    row = 2 * tree.links[2 * node + 1]
    first = tree.leaves[row]
    return first, first + tree.leaves[row + 1]


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
        x = moved(away, *vector_at(corners, 9 * face), p, q, r)
        y = moved(away, *vector_at(corners, 9 * face + 3), p, q, r)
        z = moved(away, *vector_at(corners, 9 * face + 6), p, q, r)
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
def survivors_of_leaves(pair: Pair, a: int, b: int, pad: float, mask: int, scratch: Scratch) -> int:
    """Write face pairs of two leaf nodes that are not certainly apart to ``scratch.candidates``; returns how many.

    As face, face, lanes in which the world's points are to be asked, and lanes in which they certainly meet.
    """
    always_inlined()
    tree_a, tree_b, candidates, near = pair.tree_a, pair.tree_b, scratch.candidates, scratch.near
    enter_box_frame(tree_b.boxes, b, scratch.relative, scratch.rotated)
    first_b, stop_b = faces_of_leaf(tree_b, b)
    # a face of A that overlaps the box in every slab has no corner further out than by the size of its own box
    size, count = tree_b.boxes[16 * b + 15] + 2.0 * (tree_a.boxes[16 * a + 15] * EDGE_SLACK + 2.0 * pad), 0
    for face_a in range(*faces_of_leaf(tree_a, a)):
        inside = lanes_in_box(tree_a.corners, face_a, tree_b.boxes, b, pad, mask, scratch)
        if inside == 0:
            continue
        for row in range(near_faces(scratch.span, tree_b.spans, first_b, stop_b, inside, near)):
            face_b, left = near[row] >> 8, near[row] & 255
            certain = certain_lanes(scratch.moved, tree_b.boxed, face_b, size, pad, left)
            left &= ~(certain >> 8)
            candidates[4 * count], candidates[4 * count + 1] = face_a, face_b
            candidates[4 * count + 2], candidates[4 * count + 3] = left & ~certain, left & certain
            count += left != 0
    return count
