"""Lists of pair-frames, sorted by pair so that the meshes and poses of one pair stay in the cache."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import Motion


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


def differs_from_before(poses: tuple[FloatArray, FloatArray]) -> BoolArray:
    """(K,): whether a pose (rotations, translations) is not bit for bit the one in the row before; True in row 0."""
    turn, move = poses
    differs = np.ones(len(turn), dtype=np.bool_)
    differs[1:] = (turn[1:] != turn[:-1]).any(axis=(1, 2)) | (move[1:] != move[:-1]).any(axis=1)
    return differs


Poses = tuple[FloatArray, FloatArray]
"""Rotations (n, 3, 3) and translations (n, 3)."""


def poses_to_ask(
    motion: Motion, pairs: IntArray, frames: IntArray, columns: IntArray
) -> Iterator[tuple[int, IntArray, Poses, Poses, IntArray]]:
    """Per column of K pair-frames: its rows, both bodies' poses without repeats, and which of these each row has (n,).

    ``pairs`` (P, 2) body numbers. A repeat is a pair of poses that is bit for bit that of the row before.
    """
    for column, rows in rows_of_columns(columns):
        at = frames[rows]
        poses = [(motion.rotations[at, body], motion.translations[at, body]) for body in pairs[column].tolist()]
        fresh = differs_from_before(poses[0]) | differs_from_before(poses[1])
        first, second = ((turn[fresh], move[fresh]) for turn, move in poses)
        yield column, rows, first, second, np.cumsum(fresh) - 1


def turned_faces(faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """The same face pairs (k, 2), first and second exchanged, sorted again."""
    swapped = faces[:, ::-1]
    return np.ascontiguousarray(swapped[np.lexsort((swapped[:, 1], swapped[:, 0]))])
