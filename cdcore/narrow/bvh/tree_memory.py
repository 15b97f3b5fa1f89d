"""Named tuples of memory and numbers that hot kernels read of a pair, filled by name from one row of integers."""

from __future__ import annotations

from typing import Final, NamedTuple

from cdcore.kernels.memory import Bytes, Doubles, Integers, Integers64, reader
from cdcore.narrow.descent import DESCENT_STATES


class TreeMemory(NamedTuple):
    """The arrays of a ``BoxTree`` under their names, rows one after another."""

    boxes: Doubles
    child: Integers
    start: Integers
    stop: Integers
    faces: Integers
    placed: Doubles
    corners: Doubles
    boxed: Doubles
    spans: Doubles


class PoseMemory(NamedTuple):
    """The poses of one body over F frames, or one pose for all of them.

    ``entries`` (12 stride,): rotation row by row, translation; ``centres`` (3 stride,): world centre of the root box;
    ``away`` (stride,): distance of the translation from the origin, rounded up. Every row is followed by copies of its
    last frame, so that eight can be loaded anywhere. ``step``: 1, or 0 for a body that keeps one pose throughout; frame
    f is read at ``f * step``. ``path`` (F,): metres, not decreasing; no point moves further between f and h than
    path[h] - path[f]. ``changed`` (F,): whether the pose differs from that of the frame before. ``facts`` (2,): largest
    Frobenius norm of R^T R - I, and how far corners reach from the body's origin.
    """

    entries: Doubles
    centres: Doubles
    away: Doubles
    path: Doubles
    facts: Doubles
    changed: Bytes
    stride: int
    step: int


STRIDE, STEP = (PoseMemory._fields.index(name) for name in ("stride", "step"))
"""Words of its row that change with the frames."""


class Pair(NamedTuple):
    """Two bodies, A moved into the frame of B, the larger one; and what is asked of the first ``stop`` frames.

    ``hits``, ``volumes``, ``repeats`` (stop,): frames with contact; what volumes say, ``NEAR`` or ``BEYOND``; frames
    that repeat the poses, and so the answer, of the one before. ``every``: each face pair that meets, or else whether
    any does. ``bits_a``, ``bits_b``: of the number of a face; frame, face of A and face of B make one number.
    """

    tree_a: TreeMemory
    pose_a: PoseMemory
    tree_b: TreeMemory
    pose_b: PoseMemory
    hits: Bytes
    volumes: Bytes
    repeats: Bytes
    stop: int
    every: int
    bits_a: int
    bits_b: int


class Scratch(NamedTuple):
    """Memory of a search, so that nothing is allocated inside it: one for all pairs.

    ``state``: where a search goes on that stopped because a list was full, ``STATES`` numbers. ``keys``: face pairs
    that meet, a number each; ``later``: those that only exact arithmetic decides, faces in leaf order;
    word 0 of both counts what follows, and ``keys_end`` and ``later_end`` say when they are full. ``work``: counters.
    """

    relative: Doubles
    middle: Doubles
    offset: Doubles
    rotated: Doubles
    moved: Doubles
    span: Doubles
    stack: Integers64
    candidates: Integers64
    near: Integers64
    state: Integers64
    keys: Integers64
    later: Integers64
    work: Integers64
    keys_end: int
    later_end: int


class Block(NamedTuple):
    """Up to eight frames of a pair from ``frame`` on, as a descent takes them, a lane each.

    ``chord``: how far the rotation of A seen from B strays from that of the middle frame; ``pad``: metres by which
    bodies must be apart.
    """

    pair: Pair
    frame: int
    chord: float
    pad: float
    scratch: Scratch


NEAR, BEYOND = 1, 2
"""No bounding volume keeps the bodies apart; coordinates too large or too small for the bounds of the kernels."""
AT_FRAME, LANES_NOW, GOES_ON, STATES = range(DESCENT_STATES, DESCENT_STATES + 4)
"""Places of ``Scratch.state`` behind those of the descent: the frame at which a block begins, and how many frames it
has, 0 between blocks; 1 where the search of a pair stopped before its last frame. The last: how many numbers it has."""

COUNTERS: Final = (
    "node_tests",
    "leaf_pairs",
    "face_tests",
    "world_tests",
    "exact_tests",
    "integer_tests",
    "blocks",
    "skipped",
    "gap_tests",
    "reused",
)
"""Counted in ``Scratch.work``; the exact stage fills its own two."""
(
    NODE_TESTS,
    LEAF_PAIRS,
    FACE_PAIRS,
    WORLD_TESTS,
    EXACT_TESTS,
    INTEGER_TESTS,
    BLOCKS,
    SKIPPED,
    GAP_TESTS,
    REUSED,
) = range(len(COUNTERS))
DOUBLES: Final = (96, 16, 24, 72, 72, 48)
"""Of each array of doubles, in the order of ``Scratch``."""


pair_at, pose_at, scratch_at = reader(Pair), reader(PoseMemory), reader(Scratch)
