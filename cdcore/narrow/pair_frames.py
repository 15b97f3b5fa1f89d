"""Lists of pair-frames, sorted by pair so that the meshes and poses of one pair stay in the cache."""

from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from cdcore.numerics import FloatArray, IntArray
from cdcore.poses import changed_poses
from cdcore.protocol import Motion

Answer = TypeVar("Answer")


def rows_of_columns(columns: IntArray) -> Iterator[tuple[int, IntArray]]:
    """Each column that occurs in ``columns`` (K,), ascending, with the rows in which it stands, ascending.

    Cost: one pass where the columns are sorted, else a sort.
    """
    if not len(columns):
        return
    order = np.arange(len(columns))
    if (columns[1:] < columns[:-1]).any():
        order = np.argsort(columns, kind="stable")
        columns = columns[order]
    starts = np.flatnonzero(np.concatenate([[True], columns[1:] != columns[:-1]]))
    for start, stop in zip(starts, [*starts[1:], len(columns)], strict=True):
        yield int(columns[start]), order[start:stop]


Poses = tuple[FloatArray, FloatArray]
"""Rotations (n, 3, 3) and translations (n, 3)."""


def ask_changed_poses(
    motion: Motion,
    pairs: IntArray,
    frames: IntArray,
    columns: IntArray,
    ask: Callable[[int, Poses, Poses], Iterable[Answer]],
) -> tuple[list[Answer], IntArray]:
    """Answers of ``ask(column, poses of the first, those of the second)``, one a pose, and the index of each, (K,).

    ``pairs`` (P, 2) body numbers; ``frames``, ``columns`` (K,). A pair-frame whose poses are bit for bit those of the
    one before it in its column shares that one's answer.
    """
    which, answers = np.zeros(len(frames), dtype=np.int64), list[Answer]()
    for column, rows in rows_of_columns(columns):
        at = frames[rows, None], pairs[column]
        rotation, move = motion.rotations[at], motion.translations[at]
        fresh = changed_poses(rotation, move)
        which[rows] = len(answers) + np.cumsum(fresh) - 1
        answers += ask(column, (rotation[fresh, 0], move[fresh, 0]), (rotation[fresh, 1], move[fresh, 1]))
    return answers, which


def swapped_faces(faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """The same face pairs (k, 2), first and second exchanged, sorted again."""
    swapped = faces[:, ::-1]
    return np.ascontiguousarray(swapped[np.lexsort((swapped[:, 1], swapped[:, 0]))])
