"""A tree and a track as the hot kernels see them: the addresses of their arrays under the arrays' names."""

from __future__ import annotations

from typing import NamedTuple

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel
from cdcore.kernels.memory import Memory, doubles_at, integers_at
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
    planes: Memory


class PoseMemory(NamedTuple):
    """The arrays of ``PoseLanes`` under their names."""

    entries: Memory
    stride: int
    step: int
    path: Memory
    ranges: Memory
    frames: int
    centres: Memory


TREE_WORDS, POSE_WORDS = 10, 7


@hot_kernel
def tree_memory(row: IntArray, at: int) -> TreeMemory:
    """The tree whose ten addresses start at ``row[at]``."""
    become_part_of_caller()
    return TreeMemory(
        doubles_at(row[at]), integers_at(row[at + 1]), integers_at(row[at + 2]), integers_at(row[at + 3]),
        doubles_at(row[at + 4]), integers_at(row[at + 5]), doubles_at(row[at + 6]), doubles_at(row[at + 7]),
        doubles_at(row[at + 8]), doubles_at(row[at + 9]),
    )  # fmt: skip


@hot_kernel
def pose_memory(row: IntArray, at: int) -> PoseMemory:
    """The track whose seven words start at ``row[at]``."""
    become_part_of_caller()
    return PoseMemory(
        doubles_at(row[at]), row[at + 1], row[at + 2], doubles_at(row[at + 3]), doubles_at(row[at + 4]), row[at + 5],
        doubles_at(row[at + 6]),
    )  # fmt: skip
