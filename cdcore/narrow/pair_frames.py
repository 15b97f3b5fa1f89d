"""Lists of pair-frames, sorted by pair so that the meshes and poses of one pair stay in the cache."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from cdcore.numerics import BoolArray, FloatArray, IntArray


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


def turned_faces(faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """The same face pairs (k, 2), first and second exchanged, sorted again."""
    swapped = faces[:, ::-1]
    return np.ascontiguousarray(swapped[np.lexsort((swapped[:, 1], swapped[:, 0]))])
