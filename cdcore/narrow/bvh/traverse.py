"""Pairs of bodies over their frames: repeats, path-length skips, then blocks of eight frames depth first through both
trees, in which lanes drop out as soon as they are decided.

A kernel takes one row of words a pair. It stops where a list is full or a pair is done and left something; the caller
takes what the lists hold, has the rest decided exactly, and the kernel goes on from the same place. So memory does not
grow with what a pair leaves open.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from cdcore.kernels.compiling import always_inlined, hot_kernel, kernel, never_inlined
from cdcore.kernels.memory import Memory, doubles_of, fetch_early, integers_of
from cdcore.kernels.simd import LANES, dot, first3, fused, load4, load8, minus, splat8, store
from cdcore.narrow.bvh.bounds import CHORD_SLACK, POSITION_ULPS, ROUNDOFF, SKEW_FACTOR
from cdcore.narrow.bvh.boxes_and_faces_of_eight_frames import box_lanes_that_may_meet, survivors_of_leaves
from cdcore.narrow.bvh.frame_skips import next_frame_to_search, poses_repeat, size_at
from cdcore.narrow.bvh.tree_memory import (
    AT_FRAME,
    BLOCKS,
    EXACT_TESTS,
    FACE_PAIRS,
    GOES_ON,
    LANES_NOW,
    LEAF_PAIRS,
    NEAR,
    NODE_TESTS,
    WORLD_TESTS,
    Block,
    Pair,
    PoseMemory,
    Scratch,
    TreeMemory,
    pair_at,
    scratch_at,
)
from cdcore.narrow.descent import ALIVE, CLOSED, SECOND, STOP, descend, start_at
from cdcore.numerics import ByteArray, FloatArray, IntArray
from cdcore.poses.kernels import place_coordinate
from cdcore.triangles.decide import UNDECIDED, Corners, corners_meet, undecided_pair_meets

MOST_AT_ONCE: Final = 512
"""Face pairs that two leaves may add to a list: eight faces against eight in eight frames."""

MEETS, NOT_TESTED, NOTED = 1, 3, 4
"""Answers of ``answer_faces`` beside 0 (apart) and ``UNDECIDED``; noted: its frame is marked, it is among the keys."""

SIMILAR_SIZE_RATIO: Final = 4.0
"""Frames of one block keep one distance, in the largest of their sizes: none is larger than another by this factor."""


@hot_kernel
def append(rows: Memory, key: int) -> None:
    """One more face pair on a list that has room."""
    always_inlined()
    rows[0] += 1
    rows[rows[0]] = key


@hot_kernel
def key_of(pair: Pair, frame: int, face_a: int, face_b: int) -> int:
    """A face pair of a frame as one number."""
    always_inlined()
    return ((frame << pair.bits_a | face_a) << pair.bits_b) | face_b


@hot_kernel
def place_face(placed: Memory, face: int, pose: PoseMemory, frame: int) -> Corners:
    """World corners of a face, rounded as the reference vertices: no fused multiply-add."""
    always_inlined()
    row, entries, stride, at = 12 * face, pose.entries, pose.stride, frame * pose.step
    point = load4(placed, row), load4(placed, row + 4), load4(placed, row + 8)
    a, b, c = entries[at], entries[at + stride], entries[at + 2 * stride]
    wx = place_coordinate((a, b, c), entries[at + 9 * stride], point)
    a, b, c = entries[at + 3 * stride], entries[at + 4 * stride], entries[at + 5 * stride]
    wy = place_coordinate((a, b, c), entries[at + 10 * stride], point)
    a, b, c = entries[at + 6 * stride], entries[at + 7 * stride], entries[at + 8 * stride]
    wz = place_coordinate((a, b, c), entries[at + 11 * stride], point)
    return Corners(wx, wy, wz)


@hot_kernel
def faces_meet(pair: Pair, face_a: int, face_b: int, frame: int) -> int:
    """Whether two faces meet at the reference vertices of a frame: 0, 1, or UNDECIDED for exact arithmetic."""
    never_inlined()
    first = place_face(pair.tree_a.placed, face_a, pair.pose_a, frame)
    return corners_meet(first, place_face(pair.tree_b.placed, face_b, pair.pose_b, frame))


@hot_kernel
def lanes_of_nodes(block: Block, a: int, b: int, lanes: int) -> int:
    """Lanes in which two nodes are not certainly apart; marks the frames of these where they are the roots."""
    always_inlined()
    block.scratch.work[NODE_TESTS] += 1
    lanes = box_lanes_that_may_meet(block, a, b, lanes)
    if a == 0 and b == 0:
        for lane in range(LANES):
            if lanes >> lane & 1:
                block.pair.volumes[block.frame + lane] = NEAR
    return lanes


@hot_kernel
def larger_opened(block: Block, a: int, b: int) -> tuple[int, int]:
    """The larger of two nodes opens; a leaf does not."""
    always_inlined()
    tree_a, tree_b = block.pair.tree_a, block.pair.tree_b
    child_a, child_b = tree_a.child[a], tree_b.child[b]
    if child_a < 0 and child_b < 0:
        return CLOSED, CLOSED
    if child_b < 0 or (child_a >= 0 and tree_a.boxes[16 * a + 15] > tree_b.boxes[16 * b + 15]):
        fetch_children(tree_a, child_a)
        return child_a, CLOSED
    fetch_children(tree_b, child_b)
    return CLOSED, child_b


@hot_kernel
def fetch_children(tree: TreeMemory, child: int) -> None:
    """Ask memory early for two siblings."""
    always_inlined()
    fetch_early(tree.child, child)
    for k in range(16 * child, 16 * child + 32, 8):
        fetch_early(tree.boxes, k)


@hot_kernel
def ask_leaves(block: Block, a: int, b: int, lanes: int) -> int:
    """Ask the faces of two leaf nodes; returns the lanes that are decided, ``STOP`` where a list is full."""
    never_inlined()
    pair, scratch = block.pair, block.scratch
    if scratch.keys[0] >= scratch.keys_end or scratch.later[0] >= scratch.later_end:
        return STOP
    candidates, work, decided = scratch.candidates, scratch.work, 0
    count = survivors_of_leaves(block, a, b, lanes)
    work[LEAF_PAIRS] += 1
    work[FACE_PAIRS] += count
    for row in range(0, 4 * count, 4):
        face_a, face_b = candidates[row], candidates[row + 1]
        queried, meet = candidates[row + 2] & ~decided, candidates[row + 3] & ~decided
        for lane in range(LANES):
            if not (queried | meet) >> lane & 1:
                continue
            frame, answer = block.frame + lane, 1
            if queried >> lane & 1:
                work[WORLD_TESTS] += 1
                answer = faces_meet(pair, face_a, face_b, frame)
            if answer == UNDECIDED:
                append(scratch.later, key_of(pair, frame, face_a, face_b))
            elif answer == 1:
                pair.hits[frame] = 1
                if pair.every:
                    append(scratch.keys, key_of(pair, frame, pair.tree_a.faces[face_a], pair.tree_b.faces[face_b]))
                else:
                    decided |= 1 << lane
    return decided


@hot_kernel
def frames_alike(pair: Pair, frame: int, most: int) -> int:
    """How many frames from this one on have sizes so alike that one block takes them; repeats at the end are left."""
    never_inlined()
    size, count = size_at(pair, frame), 1
    for k in range(1, most):
        other = size_at(pair, frame + k)
        if not (other <= SIMILAR_SIZE_RATIO * size and size <= SIMILAR_SIZE_RATIO * other):
            return count
        if not poses_repeat(pair, frame + k):
            count = k + 1
    return count


@hot_kernel
def fill_relative(pair: Pair, frame: int, lanes: int, scratch: Scratch) -> float:
    """Write poses of A in B's frame, of eight frames, and the rotation of the middle one of the first ``lanes``.

    To ``scratch.relative`` (96,), rotation by rows, then translation, and ``scratch.middle`` (9,). Returns how far the
    rotation of any of the lanes lies from that of the middle, spectral norm.
    """
    never_inlined()
    relative, middle, squares = scratch.relative, scratch.middle, scratch.span
    a, n, f_a = pair.pose_a.entries, pair.pose_a.stride, frame * pair.pose_a.step
    b, m, f_b = pair.pose_b.entries, pair.pose_b.stride, frame * pair.pose_b.step
    x = minus(load8(a, 9 * n + f_a), load8(b, 9 * m + f_b))
    y = minus(load8(a, 10 * n + f_a), load8(b, 10 * m + f_b))
    z = minus(load8(a, 11 * n + f_a), load8(b, 11 * m + f_b))
    total = splat8(0.0)
    for i in range(3):
        p, q, r = load8(b, i * m + f_b), load8(b, (3 + i) * m + f_b), load8(b, (6 + i) * m + f_b)
        store(relative, 72 + 8 * i, dot(p, q, r, x, y, z))
        for j in range(3):
            u, v, w = load8(a, j * n + f_a), load8(a, (3 + j) * n + f_a), load8(a, (6 + j) * n + f_a)
            k, entry = 3 * i + j, dot(p, q, r, u, v, w)
            store(relative, 8 * k, entry)
            middle[k] = relative[8 * k + lanes // 2]
            change = minus(entry, middle[k])
            total = fused(change, change, total)
    store(squares, 0, total)
    largest = 0.0
    for k in range(lanes):
        largest = max(largest, squares[k])
    chord: float = np.sqrt(0.5 * largest) * CHORD_SLACK
    return chord


@hot_kernel
def search_block(pair: Pair, frame: int, lanes: int, pad: float, scratch: Scratch) -> bool:
    """Decide a block of so many frames, going on from ``scratch.state``; False when it stopped because a list was full.

    ``pad``: as a share of the size.
    """
    never_inlined()
    largest = 0.0
    for k in range(lanes):
        largest = max(largest, size_at(pair, frame + k))
        if pair.hits[frame + k] != 0 and not pair.every:
            scratch.state[ALIVE] &= ~(1 << k)
    block = Block(pair, frame, fill_relative(pair, frame, lanes, scratch), pad * largest, scratch)
    done = descend(block, scratch.stack, scratch.state, lanes_of_nodes, larger_opened, ask_leaves, SECOND)
    if not done:
        # The nodes at which it stopped will be tested again.
        scratch.work[NODE_TESTS] -= 1
    return done


@kernel
def search_pairs(rows: IntArray, room: IntArray, first: int) -> int:
    """Decide one ``Pair`` of the rows (P, words) after the other from ``first`` on, frame by frame.

    Stops at a row that leaves something in the lists or fills one, and returns its number; else that of all rows.
    """
    scratch = scratch_at(integers_of(room), 0)
    state = scratch.state
    for number in range(first, len(rows)):
        pair = pair_at(integers_of(rows), number)
        if state[GOES_ON] == 0:
            state[AT_FRAME], state[LANES_NOW] = 0, 0
        state[GOES_ON] = 0
        # position_pad of a unit of size
        pad = POSITION_ULPS * ROUNDOFF + SKEW_FACTOR * (pair.pose_a.facts[0] + pair.pose_b.facts[0])
        f = state[AT_FRAME]
        while f < pair.stop:
            if state[LANES_NOW] == 0:
                following = next_frame_to_search(pair, f, pad, scratch.work)
                if following > f:
                    f = following
                    continue
                state[LANES_NOW] = frames_alike(pair, f, min(LANES, pair.stop - f))
                start_at(0, 0, (1 << state[LANES_NOW]) - 1, scratch.stack, state)
                scratch.work[BLOCKS] += 1
            if not search_block(pair, f, state[LANES_NOW], pad, scratch):
                state[AT_FRAME], state[GOES_ON] = f, 1
                return number
            f += state[LANES_NOW]
            state[LANES_NOW] = 0
        if scratch.keys[0] + scratch.later[0] > 0:
            return number
    return len(rows)


@hot_kernel
def write_corners(corners: Corners, pair: Memory, first: int) -> None:
    """The three corners to nine numbers from ``pair[first]`` on."""
    never_inlined()
    p = pair
    p[first], p[first + 3], p[first + 6] = first3(corners.x)
    p[first + 1], p[first + 4], p[first + 7] = first3(corners.y)
    p[first + 2], p[first + 5], p[first + 8] = first3(corners.z)


@kernel
def answer_faces(row: IntArray, room: IntArray, points: FloatArray, digits: IntArray, answers: ByteArray) -> int:
    """Answer the face pairs of ``Scratch.later`` that are ``NOT_TESTED``, and note those that meet.

    Returns how many only integers can decide; ``points`` (n, 18) hold the corners of each face pair. Where any contact
    is asked for, a frame in contact already is tested no more.
    """
    pair, scratch, sums = pair_at(integers_of(row), 0), scratch_at(integers_of(room), 0), integers_of(digits)
    undecided = 0
    for k in range(scratch.later[0]):
        key = scratch.later[k + 1]
        frame = key >> (pair.bits_a + pair.bits_b)
        face_a, face_b = (key >> pair.bits_b) & ((1 << pair.bits_a) - 1), key & ((1 << pair.bits_b) - 1)
        if answers[k] == NOT_TESTED:
            answers[k] = 0
            if pair.hits[frame] == 0 or pair.every:
                corners = doubles_of(points[k])
                write_corners(place_face(pair.tree_a.placed, face_a, pair.pose_a, frame), corners, 0)
                write_corners(place_face(pair.tree_b.placed, face_b, pair.pose_b, frame), corners, 9)
                answers[k] = undecided_pair_meets(corners, sums)
                if answers[k] == UNDECIDED:
                    undecided += 1
                else:
                    scratch.work[EXACT_TESTS] += 1
        if answers[k] == MEETS:
            answers[k] = NOTED
            pair.hits[frame] = 1
            if pair.every:
                append(scratch.keys, key_of(pair, frame, pair.tree_a.faces[face_a], pair.tree_b.faces[face_b]))
    return undecided
