"""One way through two box trees for four published searches, which differ in their test of two nodes and in what opens.

- ``WORLD``: boxes along the world's axes, placed where the descent reaches them; the one with the longer side opens. A
  world box around a node's own box is a little larger than that of its faces, and takes no pass over them: fitting all
  those of two bodies of 5,000 faces took 250 microseconds a pose (2026-11).
- ``OBB``: fifteen axes; both open.
- ``RAPID``: fifteen axes; the larger opens, its first child first.
- ``SOLID``: six axes; the larger opens; two faces are asked with GJK, then in exact arithmetic.

Source: S. Gottschalk, M. C. Lin, D. Manocha, OBBTree: a hierarchical structure for rapid interference detection (1996),
sections 4 and 5; G. van den Bergen, Efficient collision detection of complex deformable models using AABB trees (1997);
Collision detection in interactive 3D environments (2003).
"""

from typing import NamedTuple

import numpy as np

from cdcore.kernels.box_against_box import relative_box, separated_on_all_axes, separated_on_face_axes
from cdcore.kernels.compiling import always_inlined, hot_kernel, kernel, never_inlined
from cdcore.narrow.published_trees.gjk import MEETING, steps_to_separate
from cdcore.narrow.tree_builder import BoxNodes
from cdcore.numerics import ByteArray, FloatArray, IntArray
from cdcore.poses.kernels import place_face, relative_pose
from cdcore.triangles.decide import UNDECIDED, placed_pair_meets

WORLD, OBB, RAPID, SOLID = range(4)

CUT_SHORT = 1
"""How a search ended that its budget stopped."""


class PairPoses(NamedTuple):
    """K poses of two bodies, (K, 3, 3) and (K, 3) each, and by how much two volumes must be apart in each, (K,),
    infinite: only all pairs of faces can tell."""

    rotation_a: FloatArray
    move_a: FloatArray
    rotation_b: FloatArray
    move_b: FloatArray
    pad: FloatArray


@hot_kernel
def put_side(tree: BoxNodes, node: int, rotation: FloatArray, move: FloatArray, k: int, box: FloatArray) -> None:
    """Fill entries ``k`` and ``3 + k`` of ``box`` (6,), least and largest x, y, z of the world box around a node's."""
    always_inlined()
    middle, reach = move[k], 0.0
    for i in range(3):
        middle += rotation[k, i] * tree.centre[node, i]
        reach += abs(rotation[k, i]) * tree.half[node, i]
    box[k], box[3 + k] = middle - reach, middle + reach


@hot_kernel
def world_boxes_separated(
    tree_a: BoxNodes, a: int, tree_b: BoxNodes, b: int, poses: PairPoses, row: int, box_a: FloatArray, box_b: FloatArray
) -> bool:
    """Whether the world boxes of two nodes are further apart than the pad along an axis; if not, both are filled."""
    never_inlined()
    for k in range(3):
        put_side(tree_a, a, poses.rotation_a[row], poses.move_a[row], k, box_a)
        put_side(tree_b, b, poses.rotation_b[row], poses.move_b[row], k, box_b)
        if box_a[k] > box_b[3 + k] + poses.pad[row] or box_b[k] > box_a[3 + k] + poses.pad[row]:
            return True
    return False


@hot_kernel
def longest_side(box: FloatArray) -> float:
    """The longest side of a box (6,)."""
    return max(box[3] - box[0], box[4] - box[1], box[5] - box[2])


@hot_kernel
def offset_of_centres(
    centre_a: FloatArray, centre_b: FloatArray, rotation: FloatArray, move: FloatArray, d: FloatArray
) -> None:
    """The way from A's box centre to B's, in A's frame."""
    for i in range(3):
        d[i] = (
            rotation[i, 0] * centre_b[0]
            + rotation[i, 1] * centre_b[1]
            + rotation[i, 2] * centre_b[2]
            + move[i]
            - centre_a[i]
        )


@hot_kernel
def open_nodes(
    child_a: IntArray, a: int, child_b: IntArray, b: int, both: bool, first_is_larger: bool, stack: IntArray, depth: int
) -> int:
    """Put what is below two nodes, one of them no leaf, on the stack, what is asked first on top; its new depth."""
    never_inlined()
    first_a, first_b = child_a[a], child_b[b]
    open_a = first_a >= 0 and (both or first_b < 0 or first_is_larger)
    open_b = first_b >= 0 and (both or not open_a)
    for k in range(2 if open_a else 1):
        for m in range(2 if open_b else 1):
            stack[depth, 0] = first_a + (k if both else 1 - k) if open_a else a
            stack[depth, 1] = first_b + (m if both else 1 - m) if open_b else b
            depth += 1
    return depth


@kernel
def keep_hit(hits: IntArray, count: int, row: int, face_a: int, face_b: int) -> IntArray:
    """Write entry ``count`` of ``hits`` (n, 3); the array, or one twice as long where it was full."""
    always_inlined()
    if count == hits.shape[0]:
        longer = np.empty((2 * count, 3), dtype=np.int64)
        for k in range(count):  # assigning a slice compiles its error message, some four seconds
            for column in range(3):
                longer[k, column] = hits[k, column]
        hits = longer
    hits[count, 0], hits[count, 1], hits[count, 2] = row, face_a, face_b
    return hits


@kernel
def search_rows(  # noqa: C901 - one loop with its stack
    kind: int,
    tree_a: BoxNodes,
    tree_b: BoxNodes,
    poses: PairPoses,
    every: bool,
    budget: int,
    stack: IntArray,
    digits: IntArray,
    counts: IntArray,
    ended: ByteArray,
) -> IntArray:
    """Faces that meet, (M, 3) row, face of A, face of B, in K poses; marks in ``ended`` (K,) which are CUT_SHORT, and
    which UNDECIDED, where only integers, or tests without bounds of rounding, can tell.

    ``counts`` (K, 2): node tests, leaf tests; of SOLID (K, 5), also leaf tests that the cached axis ended, steps of
    GJK, exact face tests.
    """
    rotation_a, move_a, rotation_b, move_b, pad = poses
    rotation, move, m, d = np.empty((3, 3)), np.empty(3), np.empty((3, 3)), np.empty(3)
    box_a, box_b, pair = np.empty(6), np.empty(6), np.empty(18)
    room, axis = np.empty(36), np.array([1.0, 0.0, 0.0])
    hits, known = np.empty((64, 3), dtype=np.int64), 0
    for row in range(len(pad)):
        relative_pose(rotation_a[row], move_a[row], rotation_b[row], move_b[row], rotation, move)
        tests, depth, done = 0, 1, pad[row] == np.inf
        if done:
            ended[row] = UNDECIDED
        stack[0, 0], stack[0, 1] = 0, 0
        while depth > 0 and not done:
            if tests == budget:
                ended[row] = CUT_SHORT
                break
            depth -= 1
            a, b = stack[depth, 0], stack[depth, 1]
            tests += 1
            counts[row, 0] += 1
            if kind == WORLD:
                separated = world_boxes_separated(tree_a, a, tree_b, b, poses, row, box_a, box_b)
            elif kind == SOLID:
                offset_of_centres(tree_a.centre[a], tree_b.centre[b], rotation, move, d)
                separated = separated_on_face_axes(rotation, d, tree_a.half[a], tree_b.half[b], pad[row])
            else:
                relative_box(tree_a.centre[a], tree_a.axes[a], tree_b.centre[b], tree_b.axes[b], rotation, move, m, d)
                separated = separated_on_all_axes(m, d, tree_a.half[a], tree_b.half[b], pad[row])
            if separated:
                continue
            if tree_a.child[a] >= 0 or tree_b.child[b] >= 0:
                size_a, size_b = tree_a.size[a], tree_b.size[b]
                if kind == WORLD:
                    size_a, size_b = longest_side(box_a), longest_side(box_b)
                first_is_larger = size_a > size_b or (size_a == size_b and kind != RAPID)
                depth = open_nodes(tree_a.child, a, tree_b.child, b, kind == OBB, first_is_larger, stack, depth)
                continue
            for face_a in range(tree_a.start[a], tree_a.stop[a]):
                for face_b in range(tree_b.start[b], tree_b.stop[b]):
                    if done:
                        break
                    if tests == budget:
                        ended[row], done = CUT_SHORT, True
                        break
                    tests += 1
                    counts[row, 1] += 1
                    place_face(tree_a.corners, face_a, rotation_a[row], move_a[row], pair, 0)
                    place_face(tree_b.corners, face_b, rotation_b[row], move_b[row], pair, 9)
                    if kind == SOLID:
                        steps = steps_to_separate(pair, axis, pad[row], room)
                        if steps != MEETING:
                            counts[row, 2] += 1 if steps == 0 else 0
                            counts[row, 3] += steps
                            continue
                        counts[row, 4] += 1
                    answer = placed_pair_meets(pair, digits)
                    if answer == UNDECIDED:
                        ended[row], done = UNDECIDED, True
                    elif answer == 1:
                        hits = keep_hit(hits, known, row, tree_a.number[face_a], tree_b.number[face_b])
                        known += 1
                        done = not every
    return hits[:known]
