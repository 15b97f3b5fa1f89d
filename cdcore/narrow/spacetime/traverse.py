"""One pair of bodies over its frames: spans apart, path-length skips, then blocks of eight frames through both trees.

A kernel takes one row of integers: addresses of arrays, and numbers. It stops where a list is full or a face pair is
left open. The caller empties the list, and the kernel continues from the same place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from time import perf_counter
from typing import Final, TypeAlias

import numpy as np

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel, kernel, runtime_int, stay_one_function
from cdcore.kernels.memory import Memory, address_of, bytes_at, doubles_at, doubles_of, words_at, words_of
from cdcore.narrow.spacetime.block import (
    BLOCKS,
    GAP_TESTS,
    MOST_AT_ONCE,
    NEAR_LANES,
    SKIPPED_FRAMES,
    BlockQuestion,
    Lists,
    Scratch,
    have_room,
    traverse_block,
)
from cdcore.narrow.spacetime.bounds import CHORD_SLACK
from cdcore.narrow.spacetime.box_tree import BoxTree
from cdcore.narrow.spacetime.certain_test import EDGE_ROOM
from cdcore.narrow.spacetime.memory import POSE_WORDS, TREE_WORDS, PoseMemory, TreeMemory, pose_memory, tree_memory
from cdcore.narrow.spacetime.motion_bounds import first_unsafe, root_gap
from cdcore.narrow.spacetime.pose_lanes import PoseLanes
from cdcore.narrow.spacetime.simd import LANES, dot, fused, load8, minus, splat8, store
from cdcore.narrow.spacetime.time_spans import SPAN_BITS, first_near
from cdcore.narrow.spacetime.undecided import answer_later
from cdcore.narrow.triangles.sums import new_digits
from cdcore.numerics import ByteArray, FloatArray, IntArray

SHORTEST_SKIP = 4
"""Frames: a shorter skip saves less than the half-used block after it costs."""
MOST_LEAF_CORNERS = 24
"""Three for each of at most eight faces of a leaf."""

# a row of the kernel: two trees, two tracks, then these
TREE_B: Final = TREE_WORDS
POSE_A: Final = 2 * TREE_WORDS
POSE_B: Final = POSE_A + POSE_WORDS
ROOM: Final = POSE_B + POSE_WORDS
STACK, FOUND, STATE, HITS, NEAR, WORK = (ROOM + k for k in range(1, 7))
LISTS: Final = ROOM + 7
QUESTION: Final = LISTS + 4

QUESTION_WORDS: Final = 5

# doubles of the scratch memory
MIDDLE, OFFSET, TURNED, PLANE, SPAN, MOVED = 96, 112, 136, 208, 240, 288
EDGES: Final = MOVED + 24 * MOST_LEAF_CORNERS
ROOM_DOUBLES: Final = EDGES + EDGE_ROOM

AT_FRAME, IN_BLOCK, NEXT_SPAN = 3, 4, 5
"""Places of ``Scratch.state`` after the three of a block: the frame to continue from, whether that is inside its block,
and the first frame whose span is not yet tested."""
STATES: Final = 6

NOTHING: IntArray = np.zeros(0, dtype=np.int64)
Settle: TypeAlias = "Callable[[int, IntArray], IntArray]"
"""``(row, keys)``: decides face pairs in integers, sets the hits of the row, and gives the keys of those that meet."""


@hot_kernel
def scratch_memory(row: IntArray) -> Scratch:
    """The scratch memory of a row."""
    become_part_of_caller()
    room = row[ROOM]
    return Scratch(
        words_at(row[STACK]), doubles_at(room), doubles_at(room + 8 * MIDDLE), doubles_at(room + 8 * OFFSET),
        doubles_at(room + 8 * TURNED), doubles_at(room + 8 * MOVED), doubles_at(room + 8 * PLANE),
        doubles_at(room + 8 * SPAN), doubles_at(room + 8 * EDGES), words_at(row[FOUND]), words_at(row[STATE]),
    )  # fmt: skip


@hot_kernel
def skipped(
    tree_a: TreeMemory, pose_a: PoseMemory, tree_b: TreeMemory, pose_b: PoseMemory, frame: int, question: BlockQuestion,
    work: Memory, state: Memory,
) -> int:  # fmt: skip
    """Count frames in which the bodies are certainly apart; returns the next frame to test.

    Each span is tested once. Path lengths come after it, because they reach beyond the end of a span.
    """
    stay_one_function()
    stop, following = question.stop, frame
    if frame >= state[NEXT_SPAN]:
        reach = tree_a.boxes[15] + tree_b.boxes[15] + question.pad
        following = min(first_near(pose_a, pose_b, frame, reach, work), stop)
        state[NEXT_SPAN] = ((frame >> SPAN_BITS) + 1) << SPAN_BITS
    if following == frame:
        work[GAP_TESTS] += 1
        gap = root_gap(tree_a.boxes, pose_a, tree_b.boxes, pose_b, frame, question.pad)
        if gap > 0.0:
            following = first_unsafe(pose_a, pose_b, frame, stop, gap)
            if following - frame < SHORTEST_SKIP and following < stop:
                following = frame
    work[SKIPPED_FRAMES] += following - frame
    return following


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
def lists_of(row: IntArray) -> Lists:
    """The lists of a row."""
    become_part_of_caller()
    return Lists(words_at(row[LISTS]), row[LISTS + 1], words_at(row[LISTS + 2]), row[LISTS + 3])


@hot_kernel
def question_of(row: IntArray, pad: float) -> BlockQuestion:
    """The question of a row."""
    become_part_of_caller()
    return BlockQuestion(
        row[QUESTION], row[QUESTION + 1], pad, row[QUESTION + 2] != 0, row[QUESTION + 3], row[QUESTION + 4]
    )


@hot_kernel
def traverse_frames(row: IntArray, pad: float) -> bool:
    """Decide the frames of a row's question; False when it stopped for its caller, as ``traverse_block`` does."""
    stay_one_function()
    tree_a, tree_b = tree_memory(row, runtime_int(0)), tree_memory(row, runtime_int(TREE_B))
    pose_a, pose_b = pose_memory(row, runtime_int(POSE_A)), pose_memory(row, runtime_int(POSE_B))
    scratch = scratch_memory(row)
    state, hits, near, work = scratch.state, bytes_at(row[HITS]), bytes_at(row[NEAR]), words_at(row[WORK])
    lists, question = lists_of(row), question_of(row, pad)
    stop = question.stop
    f = state[AT_FRAME]
    while f < stop:
        if not have_room(lists):
            state[AT_FRAME] = f
            return False
        lanes = min(runtime_int(LANES), stop - f)
        if state[IN_BLOCK] == 0:
            following = skipped(tree_a, pose_a, tree_b, pose_b, f, question, work, state)
            if following > f:
                f = following
                continue
            fill_relative(pose_a, pose_b, f, scratch.relative)
            work[BLOCKS] += 1
            scratch.stack[0], scratch.stack[1], scratch.stack[2] = 0, 0, (1 << lanes) - 1
            state[0], state[1], state[IN_BLOCK] = 3, (1 << lanes) - 1, 1
        elif not question.faces:
            for k in range(lanes):
                state[1] &= ~(runtime_int(hits[f + k]) << k)
        chord = largest_chord(scratch.relative, lanes // 2, lanes, scratch.middle, scratch.plane)
        if not traverse_block(tree_a, pose_a, tree_b, pose_b, f, chord, question, lists, hits, work, scratch):
            state[AT_FRAME] = f
            return False
        for k in range(lanes):
            near[f + k] = state[NEAR_LANES] >> k & 1
        state[IN_BLOCK] = 0
        f += lanes
    state[AT_FRAME] = stop
    return True


@kernel
def traverse_pairs(rows: IntArray, pads: FloatArray, first: int) -> int:
    """Decide one row's question after the other from ``first`` on, whose state the caller has made ready.

    Stops at a row that needs its caller or leaves something in the lists, and returns its number; else that of all
    rows.
    """
    for pair in range(first, len(rows)):
        row = rows[pair]
        if pair > first:
            state = words_at(row[STATE])
            for k in range(STATES):
                state[k] = 0
            state[AT_FRAME] = row[QUESTION]
        done, held = traverse_frames(row, pads[pair]), runtime_int(0)
        for k in range(LISTS, QUESTION, 2):
            held += words_at(row[k])[0]
        if not done or held > 0:
            return pair
    return len(rows)


@kernel
def answer_later_of(row: IntArray, pair: FloatArray, digits: IntArray) -> int:
    """Decide what a row leaves open in exact sums; returns how many face pairs only integers can tell."""
    return answer_later(
        tree_memory(row, runtime_int(0)), pose_memory(row, runtime_int(POSE_A)),
        tree_memory(row, runtime_int(TREE_B)), pose_memory(row, runtime_int(POSE_B)),
        question_of(row, 0.0), lists_of(row), bytes_at(row[HITS]), words_at(row[WORK]), doubles_of(pair),
        words_of(digits),
    )  # fmt: skip


class Workspace:
    """Memory for one traversal after another, so that each sets up a row of integers only; one a thread."""

    def __init__(self) -> None:
        self._room, self._found = np.empty(ROOM_DOUBLES), np.empty(4 * 64, dtype=np.int64)
        self._state, self._stack = np.zeros(STATES, dtype=np.int64), np.empty(0, dtype=np.int64)
        self._keys, self._later = (np.zeros(length, dtype=np.int64) for length in (4096, 4096))
        self._row, self._pad = np.zeros(QUESTION + QUESTION_WORDS, dtype=np.int64), np.empty(1)
        self._row[ROOM], self._row[FOUND], self._row[STATE] = map(address_of, (self._room, self._found, self._state))
        self._pair, self._digits = np.empty(18), new_digits()
        self.exact_seconds = 0.0
        """Seconds spent on what was left open, of all traversals."""
        self._place_lists()

    def traverse(
        self, tree_a: BoxTree, pose_a: PoseLanes, tree_b: BoxTree, pose_b: PoseLanes, question: BlockQuestion,
        settle: Settle, marks: ByteArray, work: IntArray,
    ) -> IntArray:  # fmt: skip
        """Decide the frames of a question about one pair; ``work`` is added to, ``marks`` (2, n) as in ``rows_of``.

        Returns the face pairs that meet, as ``traverse_all`` yields them.
        """
        self.make_room((tree_a, tree_b))
        rows = self.rows_of((tree_a.row, tree_b.row), (pose_a.row, pose_b.row), question, marks[None], work)
        return next((keys for _, keys in self.traverse_all(rows, np.array([question.pad]), settle)), NOTHING)

    def traverse_all(self, rows: IntArray, pads: FloatArray, settle: Settle) -> Iterator[tuple[int, IntArray]]:
        """Decide the questions of P rows; what a row leaves open is settled as it comes, some hundred pairs at a time.

        Yields the number of a row in which faces are asked for and meet, and the keys of these. They hold until the
        next row.
        """
        first = 0
        while first < len(rows):
            self._start(rows[first, QUESTION])
            while (first := traverse_pairs(rows, pads, first)) < len(rows):
                self._empty_later(rows, first, settle)
                if self._state[AT_FRAME] == rows[first, QUESTION + 1]:
                    break
                self._make_room_for_keys(rows, 0)
            if first < len(rows) and self._keys[0]:
                yield first, self._keys[1 : self._keys[0] + 1]
            first += 1

    def _empty_later(self, rows: IntArray, row: int, settle: Settle) -> None:
        """Have the pairs left open decided; those that meet join the keys if faces are asked for."""
        count = int(self._later[0])
        if not count:
            return
        begin = perf_counter()
        self._make_room_for_keys(rows, count)
        left = answer_later_of(rows[row], self._pair, self._digits)
        if left:
            meeting = settle(row, self._later[1 : left + 1])
            self._later[0] = 0
            if rows[row, QUESTION + 2]:
                start = int(self._keys[0]) + 1
                self._keys[start : start + len(meeting)] = meeting
                self._keys[0] += len(meeting)
        self.exact_seconds += perf_counter() - begin

    def _make_room_for_keys(self, rows: IntArray, more: int) -> None:
        """Lengthen the list of keys where it has no room for so many and one step more."""
        needed = int(self._keys[0]) + more + 2 * MOST_AT_ONCE
        if len(self._keys) <= needed:
            longer = np.empty(2 * needed, dtype=np.int64)
            longer[: self._keys[0] + 1] = self._keys[: self._keys[0] + 1]
            self._keys = longer
            self._place_lists()
            rows[:, LISTS:QUESTION] = self._row[LISTS:QUESTION]

    def make_room(self, trees: Sequence[BoxTree]) -> None:
        """Make the stack long enough for any two of some trees; a longer one has another address."""
        nodes = 6 * (max(len(tree.links) for tree in trees) + 1)
        if len(self._stack) < nodes:
            self._stack = np.empty(nodes, dtype=np.int64)
            self._row[STACK] = address_of(self._stack)

    def rows_of(
        self, trees: tuple[IntArray, IntArray], poses: tuple[IntArray, IntArray], question: BlockQuestion,
        marks: ByteArray, work: IntArray,
    ) -> IntArray:  # fmt: skip
        """The kernel's rows of P pairs, which hold until more room is made; ``work`` is added to.

        ``trees`` and ``poses``: rows (P, n) of A and of B. A word of the question may stand for all pairs.

        ``marks`` (P, 2, n) are set to 1 where there is contact, and where no bounding volume keeps the bodies apart.
        """
        rows = np.empty((len(marks), QUESTION + QUESTION_WORDS), dtype=np.int64)
        rows[:] = self._row
        rows[:, :TREE_B], rows[:, TREE_B:POSE_A] = trees
        rows[:, POSE_A:POSE_B], rows[:, POSE_B:ROOM] = poses
        rows[:, HITS] = address_of(marks) + 2 * marks.shape[2] * np.arange(len(marks))
        rows[:, NEAR], rows[:, WORK] = rows[:, HITS] + marks.shape[2], address_of(work)
        start, stop, _, *rest = question
        for word, value in enumerate((start, stop, *rest), QUESTION):
            rows[:, word] = value
        return rows

    def _start(self, frame: int) -> None:
        """Make ready for a traversal that begins at this frame."""
        self._state[:] = 0
        self._state[AT_FRAME] = frame
        self._keys[0] = self._later[0] = 0

    def traverse_one(self, row: IntArray, pad: float, settle: Settle) -> None:
        """Decide the one frame of a row (1, n) that asks whether there is contact; no list needs more room for that."""
        self._start(0)
        self._pad[0] = pad
        while traverse_pairs(row, self._pad, 0) == 0:
            self._empty_later(row, 0, settle)

    def _place_lists(self) -> None:
        lists = (self._keys, self._later)
        self._row[LISTS:QUESTION:2] = [address_of(one) for one in lists]
        self._row[LISTS + 1 : QUESTION : 2] = [len(one) for one in lists]
