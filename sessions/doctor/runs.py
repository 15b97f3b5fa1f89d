"""Runs of a mask: the first and last index of every stretch of True."""

import numpy as np
from numpy.typing import NDArray


def runs(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """First and last number of every stretch of True, (k, 2), both included.

    Examples
    --------
    >>> runs(np.array([True, False, True, True])).tolist()
    [[0, 0], [2, 3]]
    """
    if not mask.any():  # as most masks of faults are: a tenth of the time
        return np.empty((0, 2), dtype=np.int64)
    edge = np.diff(np.concatenate([[0], mask.astype(np.int8), [0]]))
    return np.stack([np.flatnonzero(edge == 1), np.flatnonzero(edge == -1) - 1], axis=1)
