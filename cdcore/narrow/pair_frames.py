"""Lists of pair-frames, taken pair by pair so that one pair's meshes and poses stay at hand."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray


def rows_of_columns(columns: NDArray[np.int64]) -> Iterator[tuple[int, NDArray[np.int64]]]:
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
