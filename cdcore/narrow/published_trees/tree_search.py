"""Published searches of two box trees, pose by pose. They differ in their test of two boxes and in what opens.

- ``aabb``: boxes along the world's axes, placed where the descent reaches them; the one with the longer side opens. A
  world box around a node's own box is a little larger than that of its faces, and takes no pass over them: fitting all
  those of two bodies of 5,000 faces took 250 microseconds a pose (2026-11).
- ``obb``: fifteen axes; both open.
- ``rapid-style``: fifteen axes; the larger opens.
- ``solid-style``: six axes; the larger opens; two faces are asked with GJK, then in exact arithmetic.

Source: S. Gottschalk, M. C. Lin, D. Manocha, OBBTree: a hierarchical structure for rapid interference detection (1996),
sections 4 and 5; G. van den Bergen, Efficient collision detection of complex deformable models using AABB trees (1997);
Collision detection in interactive 3D environments (2003).
"""

from typing import Final, NamedTuple

import numpy as np

from cdcore.kernels.box_against_box import relative_box, separated_on_all_axes, separated_on_face_axes
from cdcore.kernels.compiling import always_inlined, hot_kernel, kernel
from cdcore.kernels.memory import integers_of
from cdcore.narrow.descent import CLOSED, DESCENT_STATES, FIRST, SECOND, STOP, descend, start_at
from cdcore.narrow.published_trees.gjk import MEETING, steps_to_separate
from cdcore.narrow.tree_builder import BoxNodes
from cdcore.narrow.tree_kinds import BOTH, LARGER_IN_WORLD, SIX_AXES, WORLD_BOXES, Traversal
from cdcore.numerics import ByteArray, FloatArray, IntArray
from cdcore.poses.kernels import place_face, relative_pose
from cdcore.triangles.decide import UNDECIDED, placed_pair_meets

CUT_SHORT: Final = 1
"""How a search ended that its budget stopped."""
FIRST_HITS: Final = 64
"""Rows of the list of faces that meet, before it grows."""
KNOWN, STATES = range(DESCENT_STATES, DESCENT_STATES + 2)
"""Place behind those of the descent's state: face pairs known to meet; length of it."""


class PairPoses(NamedTuple):
    """K poses of two bodies, (K, 3, 3) and (K, 3) each, and by how much two volumes must be apart in each, (K,),
    infinite: only all pairs of faces can tell."""

    rotation_a: FloatArray
    move_a: FloatArray
    rotation_b: FloatArray
    move_b: FloatArray
    pad: FloatArray


class Room(NamedTuple):
    """Memory of a search.

    ``rotation``, ``move``: B's pose in A's frame; ``m``, ``d`` two boxes as ``relative_box`` fills them; ``box_a``,
    ``box_b`` (6,) world boxes; ``corners`` (18,) of two faces; ``simplex``, ``axis`` of GJK, whose axis is that of the
    faces before; ``digits`` of exact sums; ``state`` of the descent, then ``KNOWN``.
    """

    rotation: FloatArray
    move: FloatArray
    m: FloatArray
    d: FloatArray
    box_a: FloatArray
    box_b: FloatArray
    corners: FloatArray
    simplex: FloatArray
    axis: FloatArray
    digits: IntArray
    state: IntArray


class PoseQuery(NamedTuple):
    """Two trees in the poses of a row: which faces meet, ``every`` one or the first, within ``budget`` tests.

    ``pad``: by how much two volumes must be apart; ``hits`` (n, 3): row, face of A, face of B; ``counts`` of the row
    and ``ended`` as of ``search_rows``.
    """

    traversal: Traversal
    tree_a: BoxNodes
    tree_b: BoxNodes
    rotation_a: FloatArray
    move_a: FloatArray
    rotation_b: FloatArray
    move_b: FloatArray
    pad: float
    row: int
    every: bool
    budget: int
    hits: IntArray
    counts: IntArray
    ended: ByteArray
    room: Room


@hot_kernel
def put_side(
    centre: FloatArray, half: FloatArray, rotation: FloatArray, move: FloatArray, k: int, box: FloatArray
) -> None:
    """Fill entries ``k`` and ``3 + k`` of ``box`` (6,), least and largest x, y, z of the world box around a node's."""
    always_inlined()
    middle, reach = move[k], 0.0
    for i in range(3):
        middle += rotation[k, i] * centre[i]
        reach += abs(rotation[k, i]) * half[i]
    box[k], box[3 + k] = middle - reach, middle + reach


@hot_kernel
def world_boxes_separated(query: PoseQuery, a: int, b: int) -> bool:
    """Whether the world boxes of two nodes are further apart than the pad along an axis; if not, both are filled."""
    always_inlined()
    tree_a, tree_b, box_a, box_b = query.tree_a, query.tree_b, query.room.box_a, query.room.box_b
    for k in range(3):
        put_side(tree_a.centre[a], tree_a.half[a], query.rotation_a, query.move_a, k, box_a)
        put_side(tree_b.centre[b], tree_b.half[b], query.rotation_b, query.move_b, k, box_b)
        if box_a[k] > box_b[3 + k] + query.pad or box_b[k] > box_a[3 + k] + query.pad:
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
def spend_test(counts: IntArray, column: int, budget: int, ended: ByteArray, row: int) -> bool:
    """Count a node test, column 0, or a leaf test, column 1; False where none is left: the row is then cut short."""
    always_inlined()
    if counts[0] + counts[1] == budget:
        ended[row] = CUT_SHORT
        return False
    counts[column] += 1
    return True


@hot_kernel
def boxes_may_meet(query: PoseQuery, a: int, b: int, lanes: int) -> int:
    """The lane, unless the boxes of two nodes are apart by the pad or the budget is spent."""
    always_inlined()
    if not spend_test(query.counts, 0, query.budget, query.ended, query.row):
        return 0
    tree_a, tree_b, room = query.tree_a, query.tree_b, query.room
    if query.traversal.box_test == WORLD_BOXES:
        separated = world_boxes_separated(query, a, b)
    elif query.traversal.box_test == SIX_AXES:
        offset_of_centres(tree_a.centre[a], tree_b.centre[b], room.rotation, room.move, room.d)
        separated = separated_on_face_axes(room.rotation, room.d, tree_a.half[a], tree_b.half[b], query.pad)
    else:
        axes_a, axes_b = tree_a.axes[a], tree_b.axes[b]
        relative_box(tree_a.centre[a], axes_a, tree_b.centre[b], axes_b, room.rotation, room.move, room.m, room.d)
        separated = separated_on_all_axes(room.m, room.d, tree_a.half[a], tree_b.half[b], query.pad)
    return 0 if separated else lanes


@hot_kernel
def nodes_opened(query: PoseQuery, a: int, b: int) -> tuple[int, int]:
    """First children of the nodes that open, by the rule of the traversal; a leaf does not."""
    always_inlined()
    child_a, child_b, opens = query.tree_a.child[a], query.tree_b.child[b], query.traversal.opens
    if child_a < 0 or child_b < 0 or opens == BOTH:
        return child_a, child_b
    size_a, size_b = query.tree_a.size[a], query.tree_b.size[b]
    if opens == LARGER_IN_WORLD:
        size_a, size_b = longest_side(query.room.box_a), longest_side(query.room.box_b)
    if size_a > size_b or (size_a == size_b and query.traversal.equal_opens_a):
        return child_a, CLOSED
    return CLOSED, child_b


@hot_kernel
def separated_by_gjk(room: Room, pad: float, counts: IntArray) -> bool:
    """Whether GJK keeps the two placed faces apart; counts its steps."""
    always_inlined()
    steps = steps_to_separate(room.corners, room.axis, pad, room.simplex)
    if steps == MEETING:
        counts[4] += 1
        return False
    counts[2] += 1 if steps == 0 else 0
    counts[3] += steps
    return True


@hot_kernel
def ask_leaves(query: PoseQuery, a: int, b: int, lanes: int) -> int:
    """Ask the faces of two leaves; returns the lane where nothing is left to ask, ``STOP`` where hits have no room."""
    always_inlined()
    tree_a, tree_b, row, room = query.tree_a, query.tree_b, query.row, query.room
    hits, known = query.hits, room.state[KNOWN]
    if known + (tree_a.stop[a] - tree_a.start[a]) * (tree_b.stop[b] - tree_b.start[b]) > len(hits):
        return STOP
    for face_a in range(tree_a.start[a], tree_a.stop[a]):
        for face_b in range(tree_b.start[b], tree_b.stop[b]):
            if not spend_test(query.counts, 1, query.budget, query.ended, row):
                return lanes
            place_face(tree_a.corners, face_a, query.rotation_a, query.move_a, room.corners, 0)
            place_face(tree_b.corners, face_b, query.rotation_b, query.move_b, room.corners, 9)
            if query.traversal.gjk and separated_by_gjk(room, query.pad, query.counts):
                continue
            answer = placed_pair_meets(room.corners, room.digits)
            if answer == UNDECIDED:
                query.ended[row] = UNDECIDED
                return lanes
            if answer == 1:
                hits[known, 0], hits[known, 1], hits[known, 2] = row, tree_a.number[face_a], tree_b.number[face_b]
                known += 1
                room.state[KNOWN] = known
                if not query.every:
                    return lanes
    return 0


@kernel
def twice_as_long(hits: IntArray) -> IntArray:
    """The rows of an array (n, 3), and n more."""
    always_inlined()
    longer = np.empty((2 * len(hits), 3), dtype=np.int64)
    for k in range(len(hits)):  # assigning a slice compiles its error message, some four seconds
        for column in range(3):
            longer[k, column] = hits[k, column]
    return longer


@kernel
def search_rows(
    traversal: Traversal,
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

    ``counts`` (K, 2): node tests, leaf tests; with GJK (K, 5), also leaf tests that the cached axis ended, steps of
    GJK, exact face tests.
    """
    boxes = np.empty((3, 3)), np.empty(3), np.empty((3, 3)), np.empty(3), np.empty(6), np.empty(6)
    state, axis = np.zeros(STATES, dtype=np.int64), np.array([1.0, 0.0, 0.0])
    room = Room(*boxes, np.empty(18), np.empty(36), axis, digits, state)
    hits, next_child = np.empty((FIRST_HITS, 3), dtype=np.int64), SECOND if traversal.opens == BOTH else FIRST
    pairs, states = integers_of(stack), integers_of(state)
    for row in range(len(poses.pad)):
        pad, of_row = poses.pad[row], counts[row]
        if pad == np.inf:
            ended[row] = UNDECIDED
            continue
        pose_a, pose_b = (poses.rotation_a[row], poses.move_a[row]), (poses.rotation_b[row], poses.move_b[row])
        relative_pose(*pose_a, *pose_b, room.rotation, room.move)
        start_at(0, 0, 1, pairs, states)
        done = False
        while not done:
            query = PoseQuery(
                traversal, tree_a, tree_b, *pose_a, *pose_b, pad, row, every, budget, hits, of_row, ended, room
            )
            done = descend(query, pairs, states, boxes_may_meet, nodes_opened, ask_leaves, next_child)
            if not done:
                # The nodes at which it stopped will be tested again.
                of_row[0] -= 1
                hits = twice_as_long(hits)
    return hits[: states[KNOWN]]
