"""Pairs of bodies over their frames: repeats, path-length skips, then blocks of eight through both trees.

A kernel takes one row of integers a pair: addresses of arrays, and numbers. It stops where a list is full or a pair is
done and left something; the caller takes what the lists hold, has the rest decided exactly, and the kernel goes on from
the same place. So memory does not grow with what a pair leaves open.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel, kernel, runtime_int, stay_one_function
from cdcore.kernels.memory import Memory, row_of
from cdcore.kernels.simd import LANES, dot, fused, load8, minus, splat8, store
from cdcore.narrow.bvh.block import BLOCKS, GAP_TESTS, REUSED, SKIPPED, search_block
from cdcore.narrow.bvh.bounds import (
    CHORD_SLACK,
    LARGEST_SIZE,
    LARGEST_SKEW,
    POSITION_ULPS,
    ROUNDOFF,
    SKEW_FACTOR,
    SMALLEST_SIZE,
)
from cdcore.narrow.bvh.box_tree import BoxTree
from cdcore.narrow.bvh.motion_bounds import first_unsafe, root_gap
from cdcore.narrow.bvh.tree_memory import (
    ALIVE,
    AT_FRAME,
    BEYOND,
    DEPTH,
    DOUBLES,
    EVERY,
    LANES_NOW,
    LATER_END,
    MOST_AT_ONCE,
    START,
    STATES,
    STOP,
    Pair,
    PoseMemory,
    Question,
    Scratch,
    pair_memory,
    question_memory,
    scratch_memory,
)
from cdcore.narrow.bvh.undecided import settled
from cdcore.numerics import IntArray

SHORTEST_SKIP: Final = 4
"""Frames: a shorter skip saves less than the half-used block after it costs."""
ALIKE: Final = 4.0
"""Frames of one block keep one distance, in the largest of their sizes: none is larger than another by this factor."""
LIST: Final = 4096
"""Face pairs that a list holds before it is emptied."""
FEW: Final = 16
"""The same of face pairs left open, where a frame is done at the first that meets."""


@hot_kernel
def size_at(pair: Pair, frame: int) -> float:
    """The size S of ``cdcore.narrow.bvh.bounds`` in a frame."""
    become_part_of_caller()
    a, b = pair.pose_a, pair.pose_b
    size: float = a.facts[1] + b.facts[1] + a.away[frame * a.step] + b.away[frame * b.step]
    return size


@hot_kernel
def poses_repeat(pose: PoseMemory, frame: int) -> bool:
    """Whether a pose is that of the frame before."""
    become_part_of_caller()
    return bool(pose.changed[frame * pose.step] == 0)


@hot_kernel
def frames_left_out(pair: Pair, frame: int, pad: float, question: Question, work: Memory) -> int:
    """The next frame that is to be searched: marks frames that repeat the one before, or lie beyond the kernels.

    Bodies are certainly apart in the others that it passes. ``pad``: as a share of the size.
    """
    stay_one_function()
    a, b, boxes_a, boxes_b = pair.pose_a, pair.pose_b, pair.tree_a.boxes, pair.tree_b.boxes
    if frame > question.start and poses_repeat(a, frame) and poses_repeat(b, frame):
        question.repeats[frame] = 1
        work[REUSED] += 1
        return frame + 1
    size = size_at(pair, frame)
    # asked this way round, a size that is not a number is beyond them
    if not (size >= SMALLEST_SIZE and size <= LARGEST_SIZE and a.facts[0] + b.facts[0] <= LARGEST_SKEW):
        question.volumes[frame] = BEYOND
        return frame + 1
    following = frame
    work[GAP_TESTS] += 1
    gap = root_gap(boxes_a, a, boxes_b, b, frame, pad * size)
    if gap > 0.0:
        # sizes, and what a dismissal keeps, grow by no more than the bodies move
        following = first_unsafe(a, b, frame, question.stop, gap * (1.0 - 2.0 * pad))
        if following - frame < SHORTEST_SKIP and following < question.stop:
            following = frame
    work[SKIPPED] += following - frame
    return following


@hot_kernel
def frames_alike(pair: Pair, frame: int, most: int) -> int:
    """How many frames from this one on have sizes so alike that one block takes them; repeats at the end are left."""
    stay_one_function()
    size, count = size_at(pair, frame), 1
    for k in range(1, most):
        other = size_at(pair, frame + k)
        if not (other <= ALIKE * size and size <= ALIKE * other):
            return count
        if not (poses_repeat(pair.pose_a, frame + k) and poses_repeat(pair.pose_b, frame + k)):
            count = k + 1
    return count


@hot_kernel
def fill_relative(pose_a: PoseMemory, pose_b: PoseMemory, frame: int, relative: Memory) -> None:
    """Poses of A in B's frame for eight frames, (96,): rotation by rows, then translation."""
    stay_one_function()
    a, n, f_a = pose_a.entries, pose_a.stride, frame * pose_a.step
    b, m, f_b = pose_b.entries, pose_b.stride, frame * pose_b.step
    x = minus(load8(a, 9 * n + f_a), load8(b, 9 * m + f_b))
    y = minus(load8(a, 10 * n + f_a), load8(b, 10 * m + f_b))
    z = minus(load8(a, 11 * n + f_a), load8(b, 11 * m + f_b))
    for i in range(3):
        p, q, r = load8(b, i * m + f_b), load8(b, (3 + i) * m + f_b), load8(b, (6 + i) * m + f_b)
        for j in range(3):
            u, v, w = load8(a, j * n + f_a), load8(a, (3 + j) * n + f_a), load8(a, (6 + j) * n + f_a)
            store(relative, 24 * i + 8 * j, dot(p, q, r, u, v, w))
        store(relative, 72 + 8 * i, dot(p, q, r, x, y, z))


@hot_kernel
def largest_chord(relative: Memory, lane: int, lanes: int, middle: Memory, squares: Memory) -> float:
    """Write one lane's rotation to ``middle`` (9,); returns how far any lane's lies from it, spectral norm."""
    stay_one_function()
    total = splat8(0.0)
    for k in range(9):
        middle[k] = relative[8 * k + lane]
        change = minus(load8(relative, 8 * k), middle[k])
        total = fused(change, change, total)
    store(squares, 0, total)
    largest = 0.0
    for k in range(lanes):
        largest = max(largest, squares[k])
    chord: float = np.sqrt(0.5 * largest) * CHORD_SLACK
    return chord


@hot_kernel
def search_frames(pair: Pair, question: Question, scratch: Scratch) -> bool:
    """Decide the frames of a question; False when it stopped because a list was full."""
    stay_one_function()
    state, stop = scratch.state, question.stop
    # position_pad of a unit of size
    pad = POSITION_ULPS * ROUNDOFF + SKEW_FACTOR * (pair.pose_a.facts[0] + pair.pose_b.facts[0])
    f = state[AT_FRAME]
    while f < stop:
        lanes = state[LANES_NOW]
        if lanes == 0:
            following = frames_left_out(pair, f, pad, question, scratch.work)
            if following > f:
                f = following
                continue
            lanes = frames_alike(pair, f, min(runtime_int(LANES), stop - f))
            fill_relative(pair.pose_a, pair.pose_b, f, scratch.relative)
            scratch.work[BLOCKS] += 1
            scratch.stack[0], scratch.stack[1], scratch.stack[2] = 0, 0, (1 << lanes) - 1
            state[DEPTH], state[ALIVE], state[LANES_NOW] = 3, (1 << lanes) - 1, lanes
        largest = 0.0
        for k in range(lanes):
            largest = max(largest, size_at(pair, f + k))
            if question.hits[f + k] != 0 and not question.every:
                state[ALIVE] &= ~(1 << k)
        chord = largest_chord(scratch.relative, lanes // 2, lanes, scratch.middle, scratch.span)
        if not search_block(pair, f, chord, pad * largest, question, scratch):
            state[AT_FRAME] = f
            return False
        state[LANES_NOW] = 0
        f += lanes
    state[AT_FRAME] = stop
    return True


@kernel
def search_pairs(rows: IntArray, room: IntArray, first: int) -> int:
    """Decide one row's question after the other from ``first`` on, whose state the caller has made ready.

    Stops at a row that leaves something in the lists or fills one, and returns its number; else that of all rows.
    """
    scratch = scratch_memory(room)
    for number in range(first, len(rows)):
        pair, question = pair_memory(rows[number]), question_memory(rows[number])
        if number > first:
            for k in range(STATES):
                scratch.state[k] = 0
            scratch.state[AT_FRAME] = question.start
        done = search_frames(pair, question, scratch)
        if not done or scratch.keys[0] + scratch.later[0] > 0:
            return number
    return len(rows)


class Workspace:
    """Memory for one search after another; one a thread. ``work`` (COUNTERS,) is added to."""

    def __init__(self, trees: Sequence[BoxTree], work: IntArray) -> None:
        self.work = work
        depth = 6 * (max((len(tree.links) for tree in trees), default=0) + 1)
        lengths = depth, 4 * 64, STATES, LIST + MOST_AT_ONCE, LIST + MOST_AT_ONCE
        self._kept = [np.empty(length) for length in DOUBLES], [np.zeros(length, dtype=np.int64) for length in lengths]
        stack, found, self._state, self._keys, self._later = self._kept[1]
        lists = self._keys, len(self._keys), self._later, len(self._later)
        self._room = row_of([*self._kept[0], stack, found, self._state, *lists, work])

    def search(self, rows: IntArray) -> list[tuple[int, IntArray]]:
        """Decide the questions of P rows (P, PAIR_WORDS), all of which ask for every face pair or none does.

        Returns the numbers of rows with face pairs that meet, if these are asked for, and the pairs, packed.
        """
        every, parts = bool(rows[0, EVERY]), dict[int, list[IntArray]]()
        self._room[LATER_END] = MOST_AT_ONCE + (LIST if every else FEW)
        row, done = 0, True
        while row < len(rows):
            if done:
                self._state[:] = 0
                self._state[AT_FRAME] = rows[row, START]
            # a row that ends with nothing in the lists is followed by the next one, inside the kernel
            row = int(search_pairs(rows, self._room, row))
            if row == len(rows):
                break
            meeting = [self._keys[1 : self._keys[0] + 1].copy()]
            if self._later[0]:
                meeting.append(settled(rows[row], self._later[1 : self._later[0] + 1], self.work))
            self._keys[0] = self._later[0] = 0
            if every:
                parts.setdefault(row, []).extend(meeting)
            done = bool(self._state[AT_FRAME] == rows[row, STOP])
            row += done
        return [(row, np.concatenate(some)) for row, some in parts.items()]
