"""What the hot kernels read of a pair: the addresses of its arrays, one row of integers, under the arrays' names."""

from __future__ import annotations

from typing import Final, NamedTuple

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel, runtime_int
from cdcore.kernels.memory import Memory, bytes_at, doubles_at, integers_at, words_at
from cdcore.numerics import IntArray


class TreeMemory(NamedTuple):
    """The arrays of a ``BoxTree`` under their names, rows one after another."""

    boxes: Memory
    links: Memory
    leaves: Memory
    faces: Memory
    placed: Memory
    picks: Memory
    corners: Memory
    boxed: Memory
    spans: Memory


class PoseMemory(NamedTuple):
    """The poses of one body over F frames, or one pose for all of them.

    ``entries`` (12 stride,): rotation row by row, translation; ``centres`` (3 stride,): world centre of the root box;
    ``away`` (stride,): distance of the translation from the origin, rounded up. Every row is followed by copies of its
    last frame, so that eight can be loaded anywhere. ``step``: 1, or 0 for a body that keeps one pose throughout; frame
    f is read at ``f * step``. ``path`` (F,): metres, not decreasing; no point moves further between f and h than
    path[h] - path[f]. ``changed`` (F,): whether the pose differs from that of the
    frame before. ``facts`` (2,): largest Frobenius norm of R^T R - I, and how far corners reach from the body's origin.
    """

    entries: Memory
    stride: int
    step: int
    frames: int
    centres: Memory
    away: Memory
    path: Memory
    changed: Memory
    facts: Memory


class Pair(NamedTuple):
    """Two bodies; A is moved into the frame of B, the larger one."""

    tree_a: TreeMemory
    pose_a: PoseMemory
    tree_b: TreeMemory
    pose_b: PoseMemory


class Question(NamedTuple):
    """Frames ``start`` to ``stop`` of a pair: whether it is in contact, or every face pair that meets.

    ``hits``, ``volumes`` and ``repeats`` are the rows of the pair's marks. A face pair of a frame is packed into one
    number: the frame from ``start``, the face of A, that of B in ``bits_b`` bits, both in ``bits`` bits.
    """

    start: int
    stop: int
    every: bool
    bits: int
    bits_b: int
    hits: Memory
    volumes: Memory
    repeats: Memory


TREE_WORDS, POSE_WORDS = 9, 9
TREE_B: Final = TREE_WORDS
POSE_A: Final = 2 * TREE_WORDS
POSE_B: Final = POSE_A + POSE_WORDS
MARKS: Final = POSE_B + POSE_WORDS
"""Address of the marks of a pair, (3, T): frames with contact; frames with what volumes say, ``NEAR`` or ``BEYOND``;
frames that repeat the poses, and so the answer, of the frame before."""
FRAMES: Final = MARKS + 1
"""T; then the question: the first frame, the frame after the last, whether all face pairs are asked for, and how many
bits the number of a face of A and of B takes."""
START, STOP, EVERY, BITS_A, BITS_B = range(FRAMES + 1, FRAMES + 6)
PAIR_WORDS: Final = BITS_B + 1

NEAR, BEYOND = 1, 2
"""No bounding volume keeps the bodies apart; coordinates too large or too small for the bounds of the kernels."""


@hot_kernel
def tree_memory(row: IntArray, at: int) -> TreeMemory:
    """The tree whose nine addresses start at ``row[at]``."""
    become_part_of_caller()
    return TreeMemory(
        doubles_at(row[at]), integers_at(row[at + 1]), integers_at(row[at + 2]), integers_at(row[at + 3]),
        doubles_at(row[at + 4]), integers_at(row[at + 5]), doubles_at(row[at + 6]), doubles_at(row[at + 7]),
        doubles_at(row[at + 8]),
    )  # fmt: skip


@hot_kernel
def pose_memory(row: IntArray, at: int) -> PoseMemory:
    """The poses whose nine words start at ``row[at]``."""
    become_part_of_caller()
    return PoseMemory(
        doubles_at(row[at]), row[at + 1], row[at + 2], row[at + 3], doubles_at(row[at + 4]), doubles_at(row[at + 5]),
        doubles_at(row[at + 6]), bytes_at(row[at + 7]), doubles_at(row[at + 8]),
    )  # fmt: skip


@hot_kernel
def pair_memory(row: IntArray) -> Pair:
    """The trees and poses of a pair's row."""
    become_part_of_caller()
    return Pair(
        tree_memory(row, runtime_int(0)), pose_memory(row, runtime_int(POSE_A)), tree_memory(row, runtime_int(TREE_B)),
        pose_memory(row, runtime_int(POSE_B)),
    )  # fmt: skip


@hot_kernel
def question_memory(row: IntArray) -> Question:
    """The question of a pair's row."""
    become_part_of_caller()
    marks, frames = row[MARKS], row[FRAMES]
    return Question(
        row[START], row[STOP], row[EVERY] != 0, row[BITS_A] + row[BITS_B], row[BITS_B], bytes_at(marks),
        bytes_at(marks + frames), bytes_at(marks + 2 * frames),
    )  # fmt: skip


class Scratch(NamedTuple):
    """Memory of a search, so that nothing is allocated inside it: one for all pairs.

    ``state``: where a search goes on that stopped because a list was full, ``STATES`` numbers. ``keys``: face pairs
    that meet; ``later``: those that only exact arithmetic decides, faces in leaf order; place 0 of both counts what
    follows, ``_end`` is what they have room for. ``work``: counters.
    """

    relative: Memory
    middle: Memory
    offset: Memory
    turned: Memory
    moved: Memory
    span: Memory
    edges: Memory
    stack: Memory
    found: Memory
    state: Memory
    keys: Memory
    keys_end: int
    later: Memory
    later_end: int
    work: Memory


DEPTH, ALIVE, AT_FRAME, LANES_NOW = range(4)
"""Places of ``Scratch.state``: height of the stack and lanes not yet decided, in a block; the frame at which it begins,
and how many frames it has, 0 between blocks."""
STATES: Final = 4

MOST_LEAF_CORNERS: Final = 24
"""Three for each of at most eight faces of a leaf."""
EDGE_ROOM: Final = 198
"""Doubles of the edges of two faces, as ``face_lanes`` lays them out."""
MOST_AT_ONCE: Final = 512
"""Numbers that two leaves may add to a list: eight faces against eight in eight frames."""
DOUBLES: Final = (96, 16, 24, 72, 24 * MOST_LEAF_CORNERS, 48, EDGE_ROOM)
"""Of each array of doubles, in the order of ``Scratch``."""
LATER_END: Final = Scratch._fields.index("later_end")
"""Place in the row of a ``Scratch`` of what the list of face pairs left open has room for."""


@hot_kernel
def scratch_memory(row: IntArray) -> Scratch:
    """The memory that the row of a ``Scratch`` names."""
    become_part_of_caller()
    return Scratch(
        doubles_at(row[0]), doubles_at(row[1]), doubles_at(row[2]), doubles_at(row[3]), doubles_at(row[4]),
        doubles_at(row[5]), doubles_at(row[6]), words_at(row[7]), words_at(row[8]), words_at(row[9]),
        words_at(row[10]), row[11], words_at(row[12]), row[13], words_at(row[14]),
    )  # fmt: skip
