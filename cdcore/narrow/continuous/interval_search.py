"""The first contact of two meshes on one segment. It is halved until each part is proven clear or a contact is found.

Parts are taken in order of time. Pairs of nodes that stay apart in a part are dropped; the others go on into both of
its halves. In the shortest parts the faces left are tested exactly, at the middle and the end.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdcore.kernels.compiling import always_inlined, hot_kernel, kernel, never_inlined
from cdcore.kernels.memory import integers_of
from cdcore.narrow.bvh.box_tree import BoxTree
from cdcore.narrow.continuous.motion_segments import pose_at
from cdcore.narrow.continuous.swept import CORNERS, angle_between, boxes_stay_separated, faces_stay_separated
from cdcore.narrow.descent import CLOSED, DESCENT_STATES, SECOND, WIDTH, descend, start_at
from cdcore.numerics import ByteArray, FloatArray, Int32Array, IntArray
from cdcore.poses.kernels import placed_by_row, relative_row
from cdcore.triangles.decide import new_digits, placed_pair_meets

Items = NDArray[np.int32]

FREE: Final = 0
"""Proven apart all the way."""
HIT: Final = 1
"""A contact was seen: clear by proof up to the lower end of the interval, seen at its upper end."""
TOO_CLOSE: Final = 2
"""Apart or not by less than the shortest parts can tell."""
TOO_LONG: Final = 3
"""Closer than the tolerance, and the effort ended."""

BOXES, FACES = 0, 1
"""Kinds of items."""
MOST_ITEMS: Final = 1 << 17
"""Pairs kept at a time, 1.5 MB; more than that end the effort for the part."""
MOST_INTERVALS: Final = 256
"""Depth of the halving is at most 60 (a double has 53 bits), two parts waiting at each."""

SPEED, ACCELERATION, PAD, SHORTEST = range(4)
"""Places of what bounds one leg of A seen from B, per unit of the leg; parts as short as the last are never halved."""

BOX_TESTS, FACE_TESTS, MEETING_TESTS, INTERVALS = range(4)
"""Places of the counters in ``Scratch.work``."""
COUNTERS: Final = 4

END: Final = DESCENT_STATES
"""Place of ``Scratch.state`` behind those of the descent: how many items there are, -1 if too many."""
STATES: Final = DESCENT_STATES + 1


class Scratch(NamedTuple):
    """Memory that a search works in, made once for a pair.

    ``items`` (n, 3) kind, A, B; ``stack`` (n,) and ``state`` (STATES,) of the descent;
    ``intervals`` (MOST_PARTS, 2) start and end of parts still to be tested; ``spans`` (MOST_PARTS, 2) their first item
    and the one after their last; ``poses`` (6, 12) A seen from B at start and end, A and B at the instant that is
    tested, two to build them; ``corners`` (27,), ``pair`` (18,) and ``digits``: scratch; ``impacts`` (4,) lo, hi, and
    the faces (leaf order) that meet, or that are too close to prove apart; ``work`` (COUNTERS,).
    """

    items: Items
    stack: IntArray
    state: IntArray
    intervals: FloatArray
    spans: IntArray
    poses: FloatArray
    corners: FloatArray
    pair: FloatArray
    digits: IntArray
    impacts: FloatArray
    work: IntArray


def make_room(tree_a: BoxTree, tree_b: BoxTree, most_items: int = MOST_ITEMS) -> Scratch:
    """Memory for searches between two trees, either way round."""
    depth = len(tree_a.boxes) + len(tree_b.boxes) + 16
    return Scratch(
        np.empty((most_items, 3), dtype=np.int32),
        np.empty(WIDTH * depth, dtype=np.int64),
        np.zeros(STATES, dtype=np.int64),
        np.empty((MOST_INTERVALS, 2)),
        np.empty((MOST_INTERVALS, 2), dtype=np.int64),
        np.empty((6, 12)),
        np.empty(CORNERS),
        np.empty(18),
        new_digits(),
        np.zeros(4),
        np.zeros(COUNTERS, dtype=np.int64),
    )


@hot_kernel
def keep_item(items: Items, end: int, kind: int, a: int, b: int) -> int:
    """Append an item; the new end, -1 if there is no room."""
    if end >= len(items):
        return -1
    items[end, 0], items[end, 1], items[end, 2] = kind, a, b
    return end + 1


@hot_kernel
def load_corners(faces: FloatArray, face: int, pose: FloatArray, corners: FloatArray, at: int) -> None:
    """Corners of a face at a pose (12,) to ``corners[at:at + 9]``, rounded as ``place_points`` rounds."""
    for k in range(3):
        corner = placed_by_row(pose, (faces[face, k], faces[face, 4 + k], faces[face, 8 + k]))
        corners[at + 3 * k], corners[at + 3 * k + 1], corners[at + 3 * k + 2] = corner


@hot_kernel
def face_pair_separated(
    placed_a: FloatArray,
    face_a: int,
    placed_b: FloatArray,
    face_b: int,
    margin: float,
    poses: FloatArray,
    corners: FloatArray,
) -> bool:
    """Whether two faces certainly stay apart in the part whose end poses are the first two of ``poses``."""
    # Not the whole room: eighty numbers a call took a sixth of the search (2026-11).
    never_inlined()
    load_corners(placed_a, face_a, poses[0], corners, 0)
    load_corners(placed_a, face_a, poses[1], corners, 9)
    for corner in range(3):
        for k in range(3):
            corners[18 + 3 * corner + k] = placed_b[face_b, 4 * k + corner]
    return bool(faces_stay_separated(corners, margin))


class Interval(NamedTuple):
    """Two trees in an interval at whose ends A is seen from B at the first two of ``poses``.

    ``motion``: metres that no point moves beyond; ``margin``: metres by which surfaces must be apart; ``chord``: bound
    of the norm of the difference of the rotations at both ends. The rest is that of the trees and of ``Scratch``.
    """

    boxes_a: FloatArray
    child_a: Int32Array
    start_a: Int32Array
    stop_a: Int32Array
    placed_a: FloatArray
    boxes_b: FloatArray
    child_b: Int32Array
    start_b: Int32Array
    stop_b: Int32Array
    placed_b: FloatArray
    motion: float
    margin: float
    chord: float
    items: Items
    state: IntArray
    poses: FloatArray
    corners: FloatArray
    work: IntArray


@hot_kernel
def boxes_may_meet(interval: Interval, a: int, b: int, lanes: int) -> int:
    """The lane, unless the boxes of two nodes certainly stay apart."""
    always_inlined()
    before, after, box_a, box_b = interval.poses[0], interval.poses[1], interval.boxes_a[a], interval.boxes_b[b]
    interval.work[BOX_TESTS] += 1
    return 0 if boxes_stay_separated(box_a, box_b, before, after, interval.chord, interval.margin) else lanes


@hot_kernel
def larger_opened(interval: Interval, a: int, b: int) -> tuple[int, int]:
    """The larger of two nodes opens; a leaf does not, nor do boxes that something outruns."""
    always_inlined()
    child_a, child_b = interval.child_a[a], interval.child_b[b]
    size_a, size_b = interval.boxes_a[a, 15], interval.boxes_b[b, 15]
    if (child_a < 0 and child_b < 0) or interval.motion > size_a + size_b:
        return CLOSED, CLOSED
    if child_b < 0 or (child_a >= 0 and size_a > size_b):
        return child_a, CLOSED
    return CLOSED, child_b


@hot_kernel
def keep_nodes(interval: Interval, a: int, b: int, lanes: int) -> int:
    """Append two nodes that are not opened, or the face pairs of two leaves that may meet; the lane if too many.

    Where something moves further than the boxes are large, the pair of boxes is kept for a shorter interval instead.
    """
    always_inlined()
    items, poses, corners, end = interval.items, interval.poses, interval.corners, interval.state[END]
    if interval.motion > interval.boxes_a[a, 15] + interval.boxes_b[b, 15]:
        end = keep_item(items, end, BOXES, a, b)
    else:
        for i in range(interval.start_a[a], interval.stop_a[a]):
            for j in range(interval.start_b[b], interval.stop_b[b]):
                if end < 0:
                    break
                interval.work[FACE_TESTS] += 1
                if not face_pair_separated(interval.placed_a, i, interval.placed_b, j, interval.margin, poses, corners):
                    end = keep_item(items, end, FACES, i, j)
    interval.state[END] = end
    return lanes if end < 0 else 0


@hot_kernel
def nodes_left(
    tree_a: BoxTree,
    tree_b: BoxTree,
    motion: float,
    margin: float,
    chord: float,
    room: Scratch,
    a: int,
    b: int,
    end: int,
) -> int:
    """Append what may meet at or below two nodes; returns the new end of the items, -1 if too many.

    ``motion``, ``margin``, ``chord``: of an ``Interval`` between the first two poses of the room.
    """
    never_inlined()
    side_a = tree_a.boxes, tree_a.child, tree_a.start, tree_a.stop, tree_a.placed
    side_b = tree_b.boxes, tree_b.child, tree_b.start, tree_b.stop, tree_b.placed
    items, states, poses, corners, work = room.items, room.state, room.poses, room.corners, room.work
    interval = Interval(*side_a, *side_b, motion, margin, chord, items, states, poses, corners, work)
    pairs, state = integers_of(room.stack), integers_of(states)
    state[END] = end
    start_at(a, b, 1, pairs, state)
    descend(interval, pairs, state, boxes_may_meet, larger_opened, keep_nodes, SECOND)
    return state[END]


@hot_kernel
def items_left(
    tree_a: BoxTree, tree_b: BoxTree, first: int, after: int, motion: float, margin: float, room: Scratch
) -> int:
    """Append what of the items ``first`` to ``after`` may meet in the part; new end or -1."""
    never_inlined()
    items, end = room.items, after
    chord = angle_between(room.poses[0], room.poses[1])
    for k in range(first, after):
        a, b = int(items[k, 1]), int(items[k, 2])
        if items[k, 0] == BOXES:
            end = nodes_left(tree_a, tree_b, motion, margin, chord, room, a, b, end)
        else:
            room.work[FACE_TESTS] += 1
            placed_a, placed_b = tree_a.placed, tree_b.placed
            if not face_pair_separated(placed_a, a, placed_b, b, margin, room.poses, room.corners):
                end = keep_item(items, end, FACES, a, b)
        if end < 0:
            return end
    return end


@hot_kernel
def first_meeting(
    tree_a: BoxTree,
    leg_a: FloatArray,
    tree_b: BoxTree,
    leg_b: FloatArray,
    start: float,
    stop: float,
    first: int,
    end: int,
    room: Scratch,
) -> float:
    """When faces of an item meet in a part that is not halved, asked in its middle and at its end; -1.0: at neither.

    Faces whose exponents lie too far apart for exact sums do not count as meeting.
    """
    never_inlined()
    for fraction in (0.5 * (start + stop), stop):
        pose_at(leg_a, fraction, room.poses[2])
        pose_at(leg_b, fraction, room.poses[3])
        for k in range(first, end):
            room.work[MEETING_TESTS] += 1
            load_corners(tree_a.placed, int(room.items[k, 1]), room.poses[2], room.pair, 0)
            load_corners(tree_b.placed, int(room.items[k, 2]), room.poses[3], room.pair, 9)
            if placed_pair_meets(room.pair, room.digits) == 1:
                room.impacts[2], room.impacts[3] = room.items[k, 1], room.items[k, 2]
                return fraction
    return -1.0


@hot_kernel
def place_ends(leg_a: FloatArray, leg_b: FloatArray, start: float, stop: float, room: Scratch) -> None:
    """A seen from B at both ends of a part, to the first two rows of ``room.poses``."""
    for k, fraction in enumerate((start, stop)):
        pose_at(leg_a, fraction, room.poses[4])
        pose_at(leg_b, fraction, room.poses[5])
        relative_row(room.poses[5], room.poses[4], room.poses[k])


@hot_kernel
def keep_interval(room: Scratch, depth: int, start: float, stop: float, first: int, after: int) -> int:
    """Put a part with items ``first`` to ``after`` on the stack; its new depth."""
    room.intervals[depth, 0], room.intervals[depth, 1] = start, stop
    room.spans[depth, 0], room.spans[depth, 1] = first, after
    return depth + 1


@hot_kernel
def first_contact(
    tree_a: BoxTree,
    leg_a: FloatArray,
    tree_b: BoxTree,
    leg_b: FloatArray,
    bounds: FloatArray,
    tolerance: float,
    effort: int,
    room: Scratch,
) -> int:
    """FREE, HIT, TOO_CLOSE or TOO_LONG for A on one leg seen from B; shares of the leg and faces in ``room.impacts``.

    Parts in which something moves further than ``tolerance``, metres, are always halved; ``effort``: box and face tests
    spent on the others. ``bounds`` (4,). A contact at the very start is not looked for: who asks knows it.
    """
    never_inlined()
    items, impacts = room.items, room.impacts
    depth = keep_interval(room, 0, 0.0, 1.0, 0, keep_item(items, 0, BOXES, 0, 0))
    state, spent = FREE, 0
    while depth > 0:
        depth -= 1
        start, stop, first, after = (
            room.intervals[depth, 0],
            room.intervals[depth, 1],
            room.spans[depth, 0],
            room.spans[depth, 1],
        )
        width = stop - start
        motion = bounds[SPEED] * width
        slow = motion <= tolerance
        last = width <= bounds[SHORTEST] or (slow and spent > effort)
        room.work[INTERVALS] += 1
        place_ends(leg_a, leg_b, start, stop, room)
        before = room.work[BOX_TESTS] + room.work[FACE_TESTS]
        margin = bounds[PAD] + 0.125 * width * width * bounds[ACCELERATION]
        end = items_left(tree_a, tree_b, first, after, 0.0 if last else motion, margin, room)
        if slow:
            spent += room.work[BOX_TESTS] + room.work[FACE_TESTS] - before
        if end == after:
            continue
        if end >= 0 and not last:
            middle = 0.5 * (start + stop)
            depth = keep_interval(room, depth, middle, stop, after, end)
            depth = keep_interval(room, depth, start, middle, after, end)
            continue
        fraction = first_meeting(tree_a, leg_a, tree_b, leg_b, start, stop, after, end, room) if end >= 0 else -1.0
        if state == FREE:
            impacts[0] = start
        if fraction >= 0.0:
            impacts[1] = fraction
            return HIT
        impacts[1] = stop
        if end >= 0:
            impacts[2], impacts[3] = items[after, 1], items[after, 2]
        state = max(state, TOO_CLOSE if width <= bounds[SHORTEST] else TOO_LONG)
    return state


@kernel
def search_legs(
    tree_a: BoxTree,
    legs_a: FloatArray,
    tree_b: BoxTree,
    legs_b: FloatArray,
    bounds: FloatArray,
    tolerance: float,
    effort: int,
    room: Scratch,
    states: ByteArray,
    impacts: FloatArray,
) -> None:
    """Fill ``states`` (K,) and ``impacts`` (K, 4), as ``first_contact`` leaves it in the room unless FREE, for K legs
    with their ``bounds`` (K, 4).
    """
    for k in range(len(bounds)):
        states[k] = first_contact(tree_a, legs_a[k], tree_b, legs_b[k], bounds[k], tolerance, effort, room)
        if states[k] != FREE:
            for number in range(4):
                impacts[k, number] = room.impacts[number]
