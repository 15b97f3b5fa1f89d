"""The first contact of two meshes on one segment. It is halved until each part is proven clear or a contact is found.

Parts are taken in order of time. Pairs of nodes that stay apart in a part are dropped; the others go on into both of
its halves. In the shortest parts the faces left are tested exactly, at the middle and the end.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from cdcore.kernels.compiling import always_inlined, hot_kernel, kernel, never_inlined
from cdcore.kernels.memory import (
    Doubles,
    Integers,
    Integers64,
    Memory,
    doubles_of,
    integers_of,
    integers_of_rows,
    memory_from,
    reader,
    row_of,
)
from cdcore.narrow.bvh.box_tree import BoxTree
from cdcore.narrow.bvh.tree_memory import TreeMemory
from cdcore.narrow.continuous.motion_segments import LEG_WIDTH, pose_at
from cdcore.narrow.continuous.swept import CORNERS, angle_between, boxes_stay_separated, faces_stay_separated
from cdcore.narrow.descent import CLOSED, DESCENT_STATES, SECOND, WIDTH, descend, start_at
from cdcore.numerics import ByteArray, FloatArray, Int32Array, IntArray
from cdcore.poses.kernels import placed_by_row, relative_row
from cdcore.triangles.decide import new_digits, pair_meets

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
"""Places of the counters in ``Room.work``."""
COUNTERS: Final = 4

END, STATES = range(DESCENT_STATES, DESCENT_STATES + 2)
"""Place of ``Room.state`` behind those of the descent: how many items there are, -1 if too many; length of it."""


class Room(NamedTuple):
    """Memory that searches between two trees work in, either way round.

    ``items`` (n, 3) kind, A, B; ``stack`` (n,) and ``state`` (STATES,) of the descent;
    ``intervals`` (MOST_INTERVALS, 2) start and end of parts still to be tested; ``spans`` (MOST_INTERVALS, 2) their
    first item and the one after their last; ``poses`` (6, 12) A seen from B at start and end, A and B at the instant
    that is tested, two to build them; ``corners`` (27,), ``pair`` (18,) and ``digits``: scratch; ``impacts`` (4,) lo,
    hi, and the faces (leaf order) that meet, or that are too close to prove apart; ``work`` (COUNTERS,).
    """

    items: Int32Array
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

    def search_row(self, tree_a: BoxTree, tree_b: BoxTree) -> IntArray:
        """The row (1, words) of a ``Search`` between two trees, which are to outlive it as this room is."""
        sides = {"tree_a": tree_a.memory_row, "tree_b": tree_b.memory_row}
        return integers_of_rows(row_of(Search, **sides, **self._asdict(), most_items=len(self.items)))


class Search(NamedTuple):
    """Two trees and the ``Room`` in which they are searched, as kernels see them; ``most_items`` have room."""

    tree_a: TreeMemory
    tree_b: TreeMemory
    items: Integers
    stack: Integers64
    state: Integers64
    intervals: Doubles
    spans: Integers64
    poses: Doubles
    corners: Doubles
    pair: Doubles
    digits: Integers64
    impacts: Doubles
    work: Integers64
    most_items: int


search_at = reader(Search)


def make_room(tree_a: BoxTree, tree_b: BoxTree, most_items: int = MOST_ITEMS) -> Room:
    """Memory for searches between two trees, either way round."""
    depth = len(tree_a.boxes) + len(tree_b.boxes) + 16
    return Room(
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
def pose_of(search: Search, row: int) -> Memory:
    """A pose of ``Room.poses`` (12,)."""
    always_inlined()
    return memory_from(search.poses, 12 * row)


@hot_kernel
def keep_item(search: Search, end: int, kind: int, a: int, b: int) -> int:
    """Append an item; the new end, -1 if there is no room."""
    if end >= search.most_items:
        return -1
    items = search.items
    items[3 * end], items[3 * end + 1], items[3 * end + 2] = kind, a, b
    return end + 1


@hot_kernel
def load_corners(placed: Memory, face: int, pose: Memory, corners: Memory, at: int) -> None:
    """Corners of a face at a pose (12,) to ``corners[at:at + 9]``, rounded as ``place_points`` rounds."""
    row = 12 * face
    for k in range(3):
        corner = placed_by_row(pose, (placed[row + k], placed[row + 4 + k], placed[row + 8 + k]))
        corners[at + 3 * k], corners[at + 3 * k + 1], corners[at + 3 * k + 2] = corner


@hot_kernel
def face_pair_separated(search: Search, face_a: int, face_b: int, margin: float) -> bool:
    """Whether two faces certainly stay apart in the part whose end poses are the first two of ``poses``."""
    never_inlined()
    corners, placed_b = search.corners, search.tree_b.placed
    load_corners(search.tree_a.placed, face_a, pose_of(search, 0), corners, 0)
    load_corners(search.tree_a.placed, face_a, pose_of(search, 1), corners, 9)
    for corner in range(3):
        for k in range(3):
            corners[18 + 3 * corner + k] = placed_b[12 * face_b + 4 * k + corner]
    return bool(faces_stay_separated(corners, margin))


class Interval(NamedTuple):
    """A search in an interval at whose ends A is seen from B at the first two of ``poses``.

    ``motion``: metres that no point moves beyond; ``margin``: metres by which surfaces must be apart; ``chord``: bound
    of the norm of the difference of the rotations at both ends.
    """

    search: Search
    motion: float
    margin: float
    chord: float


@hot_kernel
def boxes_may_meet(interval: Interval, a: int, b: int, lanes: int) -> int:
    """The lane, unless the boxes of two nodes certainly stay apart."""
    always_inlined()
    search = interval.search
    box_a, box_b = memory_from(search.tree_a.boxes, 16 * a), memory_from(search.tree_b.boxes, 16 * b)
    search.work[BOX_TESTS] += 1
    before, after = pose_of(search, 0), pose_of(search, 1)
    return 0 if boxes_stay_separated(box_a, box_b, before, after, interval.chord, interval.margin) else lanes


@hot_kernel
def larger_opened(interval: Interval, a: int, b: int) -> tuple[int, int]:
    """The larger of two nodes opens; a leaf does not, nor do boxes that something outruns."""
    always_inlined()
    tree_a, tree_b = interval.search.tree_a, interval.search.tree_b
    child_a, child_b = tree_a.child[a], tree_b.child[b]
    size_a, size_b = tree_a.boxes[16 * a + 15], tree_b.boxes[16 * b + 15]
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
    search = interval.search
    tree_a, tree_b, end = search.tree_a, search.tree_b, search.state[END]
    if interval.motion > tree_a.boxes[16 * a + 15] + tree_b.boxes[16 * b + 15]:
        end = keep_item(search, end, BOXES, a, b)
    else:
        for i in range(tree_a.start[a], tree_a.stop[a]):
            for j in range(tree_b.start[b], tree_b.stop[b]):
                if end < 0:
                    break
                search.work[FACE_TESTS] += 1
                if not face_pair_separated(search, i, j, interval.margin):
                    end = keep_item(search, end, FACES, i, j)
    search.state[END] = end
    return lanes if end < 0 else 0


@hot_kernel
def nodes_left(search: Search, motion: float, margin: float, chord: float, a: int, b: int, end: int) -> int:
    """Append what may meet at or below two nodes; returns the new end of the items, -1 if too many.

    ``motion``, ``margin``, ``chord``: of an ``Interval`` between the first two poses of the room.
    """
    never_inlined()
    search.state[END] = end
    start_at(a, b, 1, search.stack, search.state)
    interval = Interval(search, motion, margin, chord)
    descend(interval, search.stack, search.state, boxes_may_meet, larger_opened, keep_nodes, SECOND)
    return search.state[END]


@hot_kernel
def items_left(search: Search, first: int, after: int, motion: float, margin: float) -> int:
    """Append what of the items ``first`` to ``after`` may meet in the part; new end or -1."""
    never_inlined()
    items, end = search.items, after
    chord = angle_between(pose_of(search, 0), pose_of(search, 1))
    for k in range(first, after):
        a, b = int(items[3 * k + 1]), int(items[3 * k + 2])
        if items[3 * k] == BOXES:
            end = nodes_left(search, motion, margin, chord, a, b, end)
        else:
            search.work[FACE_TESTS] += 1
            if not face_pair_separated(search, a, b, margin):
                end = keep_item(search, end, FACES, a, b)
        if end < 0:
            return end
    return end


@hot_kernel
def first_meeting(
    search: Search, leg_a: Memory, leg_b: Memory, start: float, stop: float, first: int, end: int
) -> float:
    """When faces of an item meet in a part that is not halved, asked in its middle and at its end; -1.0: at neither.

    Faces whose exponents lie too far apart for exact sums do not count as meeting.
    """
    never_inlined()
    items, pair = search.items, search.pair
    pose_a, pose_b = pose_of(search, 2), pose_of(search, 3)
    for fraction in (0.5 * (start + stop), stop):
        pose_at(leg_a, fraction, pose_a)
        pose_at(leg_b, fraction, pose_b)
        for k in range(first, end):
            search.work[MEETING_TESTS] += 1
            load_corners(search.tree_a.placed, items[3 * k + 1], pose_a, pair, 0)
            load_corners(search.tree_b.placed, items[3 * k + 2], pose_b, pair, 9)
            if pair_meets(pair, search.digits) == 1:
                search.impacts[2], search.impacts[3] = items[3 * k + 1], items[3 * k + 2]
                return fraction
    return -1.0


@hot_kernel
def place_ends(search: Search, leg_a: Memory, leg_b: Memory, start: float, stop: float) -> None:
    """A seen from B at both ends of a part, to the first two poses."""
    pose_a, pose_b = pose_of(search, 4), pose_of(search, 5)
    for k, fraction in enumerate((start, stop)):
        pose_at(leg_a, fraction, pose_a)
        pose_at(leg_b, fraction, pose_b)
        relative_row(pose_b, pose_a, pose_of(search, k))


@hot_kernel
def keep_interval(search: Search, depth: int, start: float, stop: float, first: int, after: int) -> int:
    """Put a part with items ``first`` to ``after`` on the stack; its new depth."""
    search.intervals[2 * depth], search.intervals[2 * depth + 1] = start, stop
    search.spans[2 * depth], search.spans[2 * depth + 1] = first, after
    return depth + 1


@hot_kernel
def first_contact(search: Search, leg_a: Memory, leg_b: Memory, bounds: Memory, tolerance: float, effort: int) -> int:
    """FREE, HIT, TOO_CLOSE or TOO_LONG for A on one leg seen from B; shares of the leg and faces in ``impacts``.

    Parts in which something moves further than ``tolerance``, metres, are always halved; ``effort``: box and face tests
    spent on the others. ``bounds`` (4,). A contact at the very start is not looked for: who asks knows it.
    """
    never_inlined()
    impacts, work = search.impacts, search.work
    depth = keep_interval(search, 0, 0.0, 1.0, 0, keep_item(search, 0, BOXES, 0, 0))
    state, spent = FREE, 0
    while depth > 0:
        depth -= 1
        start, stop = search.intervals[2 * depth], search.intervals[2 * depth + 1]
        first, after = search.spans[2 * depth], search.spans[2 * depth + 1]
        width = stop - start
        motion = bounds[SPEED] * width
        slow = motion <= tolerance
        last = width <= bounds[SHORTEST] or (slow and spent > effort)
        work[INTERVALS] += 1
        place_ends(search, leg_a, leg_b, start, stop)
        before = work[BOX_TESTS] + work[FACE_TESTS]
        margin = bounds[PAD] + 0.125 * width * width * bounds[ACCELERATION]
        end = items_left(search, first, after, 0.0 if last else motion, margin)
        if slow:
            spent += work[BOX_TESTS] + work[FACE_TESTS] - before
        if end == after:
            continue
        if end >= 0 and not last:
            middle = 0.5 * (start + stop)
            depth = keep_interval(search, depth, middle, stop, after, end)
            depth = keep_interval(search, depth, start, middle, after, end)
            continue
        fraction = first_meeting(search, leg_a, leg_b, start, stop, after, end) if end >= 0 else -1.0
        if state == FREE:
            impacts[0] = start
        if fraction >= 0.0:
            impacts[1] = fraction
            return HIT
        impacts[1] = stop
        if end >= 0:
            impacts[2], impacts[3] = search.items[3 * after + 1], search.items[3 * after + 2]
        state = max(state, TOO_CLOSE if width <= bounds[SHORTEST] else TOO_LONG)
    return state


@kernel
def search_legs(
    search_row: IntArray,
    legs_a: FloatArray,
    legs_b: FloatArray,
    bounds: FloatArray,
    tolerance: float,
    effort: int,
    states: ByteArray,
    impacts: FloatArray,
) -> None:
    """Fill ``states`` (K,) and ``impacts`` (K, 4), as ``first_contact`` leaves it in the room unless FREE, for K legs
    (K, 28) with their ``bounds`` (K, 4).
    """
    search = search_at(integers_of(search_row), 0)
    rows_a, rows_b, bounds_rows = doubles_of(legs_a), doubles_of(legs_b), doubles_of(bounds)
    for k in range(len(bounds)):
        leg_a, leg_b = memory_from(rows_a, LEG_WIDTH * k), memory_from(rows_b, LEG_WIDTH * k)
        states[k] = first_contact(search, leg_a, leg_b, memory_from(bounds_rows, 4 * k), tolerance, effort)
        if states[k] != FREE:
            for number in range(4):
                impacts[k, number] = search.impacts[number]
