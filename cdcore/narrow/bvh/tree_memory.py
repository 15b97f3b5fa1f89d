"""Named tuples of memory and numbers that hot kernels read of a pair, filled by name from one row of integers.

A word is a number or the address of an array. The arrays themselves as operands of one named tuple took ten times as
long to hand over, 2.7 microseconds for 25 of them, which a live look pays for every pair (2026-11).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from itertools import count
from typing import Annotated, Any, Final, NamedTuple, get_type_hints

import numpy as np
from llvmlite import ir
from numba import types
from numpy.typing import NDArray

from cdcore.kernels.compiling import machine_operation
from cdcore.kernels.memory import Memory, address_of, memory_at

Rows = NDArray[np.void]
Doubles = Annotated[Memory, types.float64]
Integers64 = Annotated[Memory, types.int64]
Integers = Annotated[Memory, types.int32]
Bytes = Annotated[Memory, types.uint8]


TYPE_STRINGS: Final = {types.float64: "<f8", types.int64: "<i8", types.int32: "<i4", types.uint8: "|u1"}


class TreeMemory(NamedTuple):
    """The arrays of a ``BoxTree`` under their names, rows one after another."""

    boxes: Doubles
    links: Integers
    leaves: Integers
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
    path[h] - path[f]. ``changed`` (F,): whether the pose differs from that of the
    frame before. ``facts`` (2,): largest Frobenius norm of R^T R - I, and how far corners reach from the body's origin.
    """

    entries: Doubles
    centres: Doubles
    away: Doubles
    path: Doubles
    facts: Doubles
    changed: Bytes
    stride: int
    step: int
    frames: int


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


NEAR, BEYOND = 1, 2
"""No bounding volume keeps the bodies apart; coordinates too large or too small for the bounds of the kernels."""
DEPTH, ALIVE, AT_FRAME, LANES_NOW, GOES_ON = range(5)
"""Places of ``Scratch.state``: height of the stack and lanes not yet decided, in a block; the frame at which it begins,
and how many frames it has, 0 between blocks; 1 where the search of a pair stopped before its last frame."""
STATES: Final = 5

COUNTERS: Final = (
    "node_tests", "leaf_pairs", "face_tests", "world_tests", "exact_tests", "integer_tests", "blocks", "skipped",
    "gap_tests", "reused",
)  # fmt: skip
"""Counted in ``Scratch.work``; the exact stage fills its own two."""
(
    NODE_TESTS, LEAF_PAIRS, FACE_PAIRS, WORLD_TESTS, EXACT_TESTS, INTEGER_TESTS, BLOCKS, SKIPPED, GAP_TESTS, REUSED,
) = range(len(COUNTERS))  # fmt: skip
DOUBLES: Final = (96, 16, 24, 72, 72, 48)
"""Of each array of doubles, in the order of ``Scratch``."""


@cache
def layout(kind: Any) -> np.dtype[np.void]:
    """The row of a named tuple: a word for each of its names, in order."""
    hints = get_type_hints(kind)
    return np.dtype([(name, layout(hint) if hasattr(hint, "_fields") else np.int64) for name, hint in hints.items()])


def row_of(kind: Any, **entries: NDArray[Any] | int) -> Rows:
    """The row () of a named tuple of arrays, which the caller keeps, and numbers."""
    row = np.zeros((), dtype=layout(kind))
    for name, item in entries.items():
        row[name] = item if isinstance(item, int) else address_of(item)
    return row


def integers_of_rows(rows: Rows) -> NDArray[np.int64]:
    """The same memory as a kernel takes it, (n, words)."""
    return rows.view(np.int64).reshape(len(rows), -1)


def _shape(kind: Any) -> Any:
    make: Any = types.NamedTuple
    pointer: Any = types.CPointer
    entries = []
    for hint in get_type_hints(kind, include_extras=True).values():
        if hasattr(hint, "_fields"):
            entries.append(_shape(hint))
        else:
            entries.append(pointer(hint.__metadata__[0]) if hasattr(hint, "__metadata__") else types.int64)
    return make(entries, kind)


def reader(kind: Any) -> Callable[[Memory], Any]:
    """For kernels: what reads a named tuple from the place in memory at which its row starts."""
    shape = _shape(kind)

    def typed(_context: Any, row: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            indices = count()

            def value(item: Any) -> Any:
                if isinstance(item, types.NamedTuple):
                    return context.make_tuple(builder, item, [value(entry) for entry in item.types])
                index = ir.Constant(ir.IntType(64), next(indices))
                word = builder.load(builder.gep(arguments[0], [index]))
                return word if item is types.int64 else builder.inttoptr(word, context.get_value_type(item))

            return value(shape)

        return shape(row), generate

    return machine_operation(typed, partial(_read, kind))


@cache
def _kinds_of_entries(kind: Any) -> list[Any]:
    """For each field of a named tuple: a named tuple, NumPy's type string of its entries, or "" for a number."""
    kinds: list[Any] = []
    for hint in get_type_hints(kind, include_extras=True).values():
        if hasattr(hint, "_fields"):
            kinds.append(hint)
        else:
            kinds.append(TYPE_STRINGS[hint.__metadata__[0]] if hasattr(hint, "__metadata__") else "")
    return kinds


def _read(kind: Any, row: Any) -> Any:
    """A named tuple from a row of words, which may be an iterator of them, in Python."""
    words = iter(row)
    entries = []
    for of in _kinds_of_entries(kind):
        if hasattr(of, "_fields"):
            entries.append(_read(of, words))
        else:
            word = int(next(words))
            entries.append(memory_at(word, of) if of else word)
    return kind(*entries)


pair_at, pose_at, scratch_at = reader(Pair), reader(PoseMemory), reader(Scratch)
