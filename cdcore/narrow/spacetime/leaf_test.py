"""The faces of two leaves in eight frames: slabs of the leaf's box, both planes, and what survives goes to the
world test.
"""

from __future__ import annotations

from cdcore.narrow.compiling import become_part_of_caller, hot_kernel
from cdcore.narrow.spacetime.box_tree import BoxTree
from cdcore.narrow.spacetime.lanes import above, dot, fused, least3, load8, most3, moved, plus, splat8, store
from cdcore.numerics import FloatArray, IntArray


@hot_kernel
def enter_box_frame(box: FloatArray, b: int, relative: FloatArray, turned: FloatArray) -> None:
    """The rotation of A as seen in box b, in ``turned`` (72,)."""
    become_part_of_caller()
    for i in range(3):
        x, y, z = box[b, 3 + 3 * i], box[b, 4 + 3 * i], box[b, 5 + 3 * i]
        for j in range(3):
            p, q, r = load8(relative, 8 * j), load8(relative, 24 + 8 * j), load8(relative, 48 + 8 * j)
            store(turned, 24 * i + 8 * j, dot(x, y, z, p, q, r))


@hot_kernel
def move_corners(
    corners: FloatArray, first: int, count: int, turned: FloatArray, offset: FloatArray, placed: FloatArray
) -> None:
    """Corners of A's leaf in the box frame, (24 count,)."""
    become_part_of_caller()
    for c in range(count):
        x, y, z = corners[first + c, 0], corners[first + c, 1], corners[first + c, 2]
        for k in range(3):
            p, q, r = load8(turned, 24 * k), load8(turned, 24 * k + 8), load8(turned, 24 * k + 16)
            store(placed, 24 * c + 8 * k, moved(load8(offset, 8 * k), x, y, z, p, q, r))


@hot_kernel
def lanes_in_box(
    placed: FloatArray, p: int, q: int, r: int, box: FloatArray, b: int, pad: float, mask: int, span: FloatArray
) -> int:
    """Lanes in which the moved face is not certainly outside one of the box's slabs; its own go to ``span`` (48,)."""
    become_part_of_caller()
    for k in range(3):
        half = box[b, 12 + k] + pad
        x, y, z = load8(placed, p + 8 * k), load8(placed, q + 8 * k), load8(placed, r + 8 * k)
        low, high = least3(x, y, z), most3(x, y, z)
        mask &= ~(above(low, half) | above(-half, high))
        store(span, 16 * k, low)
        store(span, 16 * k + 8, high)
    return mask


@hot_kernel
def lanes_in_span(span: FloatArray, spans: FloatArray, face: int, pad: float, mask: int) -> int:
    """Lanes in which the moved face's slabs and those of a fixed face are not certainly disjoint."""
    become_part_of_caller()
    for k in range(3):
        mask &= ~above(load8(span, 16 * k), spans[face, 2 * k + 1] + pad)
        mask &= ~above(spans[face, 2 * k] - pad, load8(span, 16 * k + 8))
    return mask


@hot_kernel
def lanes_at_plane(
    placed: FloatArray, p: int, q: int, r: int, planes: FloatArray, face: int, pad: float, mask: int
) -> int:
    """Lanes in which the moved face is not certainly on one side of a fixed face's plane."""
    become_part_of_caller()
    x, y, z = planes[face, 0], planes[face, 1], planes[face, 2]
    d = dot(x, y, z, load8(placed, p), load8(placed, p + 8), load8(placed, p + 16))
    e = dot(x, y, z, load8(placed, q), load8(placed, q + 8), load8(placed, q + 16))
    f = dot(x, y, z, load8(placed, r), load8(placed, r + 8), load8(placed, r + 16))
    mask &= ~above(least3(d, e, f), planes[face, 4] + pad)
    return mask & ~above(planes[face, 3] - pad, most3(d, e, f))


@hot_kernel
def move_plane(planes: FloatArray, face: int, turned: FloatArray, offset: FloatArray, out: FloatArray) -> None:
    """The plane of a face of A in the box frame: direction (24,), then the shift of its values (8,)."""
    become_part_of_caller()
    x, y, z = planes[face, 5], planes[face, 6], planes[face, 7]
    shift = splat8(0.0)
    for k in range(3):
        entry = dot(x, y, z, load8(turned, 24 * k), load8(turned, 24 * k + 8), load8(turned, 24 * k + 16))
        store(out, 8 * k, entry)
        shift = fused(entry, load8(offset, 8 * k), shift)
    store(out, 24, shift)


@hot_kernel
def lanes_at_moved_plane(
    plane: FloatArray, low: float, high: float, boxed: FloatArray, face: int, pad: float, mask: int
) -> int:
    """Lanes in which a fixed face is not certainly on one side of the moved face's plane."""
    become_part_of_caller()
    x, y, z, shift = load8(plane, 0), load8(plane, 8), load8(plane, 16), load8(plane, 24)
    d = dot(x, y, z, boxed[face, 0], boxed[face, 1], boxed[face, 2])
    e = dot(x, y, z, boxed[face, 3], boxed[face, 4], boxed[face, 5])
    f = dot(x, y, z, boxed[face, 6], boxed[face, 7], boxed[face, 8])
    mask &= ~above(least3(d, e, f), plus(shift, high + pad))
    return mask & ~above(plus(shift, low - pad), most3(d, e, f))


@hot_kernel
def survivors_of_leaves(
    tree_a: BoxTree, leaf_a: int, tree_b: BoxTree, b: int, leaf_b: int, relative: FloatArray, offset: FloatArray, pad:
    float, mask: int, turned: FloatArray, placed: FloatArray, plane: FloatArray, span: FloatArray, found: IntArray,
) -> int:  # fmt: skip
    """Face pairs that no box or plane dismisses: three numbers (face, face, lanes) each in ``found``; returns how
    many.
    """
    become_part_of_caller()
    enter_box_frame(tree_b.boxes, b, relative, turned)
    move_corners(tree_a.corners, tree_a.leaves[leaf_a, 2], tree_a.leaves[leaf_a, 3], turned, offset, placed)
    first_a, first_b = tree_a.leaves[leaf_a, 0], tree_b.leaves[leaf_b, 0]
    count = 0
    for face_a in range(first_a, first_a + tree_a.leaves[leaf_a, 1]):
        p, q, r = 24 * tree_a.picks[face_a, 0], 24 * tree_a.picks[face_a, 1], 24 * tree_a.picks[face_a, 2]
        inside = lanes_in_box(placed, p, q, r, tree_b.boxes, b, pad, mask, span)
        if inside == 0:
            continue
        plane_is_moved = False
        for face_b in range(first_b, first_b + tree_b.leaves[leaf_b, 1]):
            left = lanes_in_span(span, tree_b.spans, face_b, pad, inside)
            if left == 0:
                continue
            left = lanes_at_plane(placed, p, q, r, tree_b.planes, face_b, pad, left)
            if left == 0:
                continue
            if not plane_is_moved:
                move_plane(tree_a.planes, face_a, turned, offset, plane)
                plane_is_moved = True
            low, high = tree_a.planes[face_a, 8], tree_a.planes[face_a, 9]
            left = lanes_at_moved_plane(plane, low, high, tree_b.boxed, face_b, pad, left)
            if left != 0:
                found[3 * count], found[3 * count + 1], found[3 * count + 2] = face_a, face_b, left
                count += 1
    return count
