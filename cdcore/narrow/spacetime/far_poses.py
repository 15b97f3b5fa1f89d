"""Poses far outside the rest of a recording: found, replaced by a neighbour's, and answered apart.

The distance that a dismissal keeps grows with the largest translation of a recording. One corrupt pose of 1e15 m would
disable every dismissal of all other frames. So such a pose takes no part in the search; its own frame is asked alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from cdcore.narrow.spacetime.bounds import ROUNDOFF, SMALLEST_SIZE
from cdcore.numerics import BoolArray, FloatArray, IntArray

FAR: Final = 2.0**20
"""A pose is far that lies so many times further out than a tenth of the body's poses: then the pad of the others is
below 1e-7 m in a room of 1 m, and no student walks a million times the size of the room."""
USUAL_SHARE: Final = 0.1
ROUNDING_ULPS: Final = 64.0
"""Placing two corners rounds each by at most 7 u of its coordinates; taken four times."""


def far_poses(translations: FloatArray, valid: BoolArray, reaches: FloatArray) -> BoolArray | None:
    """Which poses (T, N) are far; ``None``, the usual answer, where there is none.

    ``reaches`` (N,): largest distance of a corner from the body's origin, metres.
    """
    # numpy takes the largest of many rows ten times faster than that of three neighbours
    if valid.all() and not (np.abs(translations).max(axis=0, initial=0.0).max(axis=1) > FAR * reaches).any():
        return None
    x, y, z = np.moveaxis(np.abs(np.where(valid[:, :, None], translations, 0.0)), 2, 0)
    away = np.maximum(np.maximum(x, y), z)
    far = np.zeros(valid.shape, dtype=np.bool_)
    for body in np.flatnonzero(valid.any(axis=0)):
        known = away[valid[:, body], body]
        place = int(USUAL_SHARE * len(known))
        usual = np.partition(known, place)[place]
        # divided, since the product may overflow
        far[:, body] = away[:, body] / FAR > usual + reaches[body]
    return far if far.any() else None


def without(values: FloatArray, far: BoolArray, valid: BoolArray) -> FloatArray:
    """A copy of poses (T, N, ...) in which a far one is the last valid one before it, or the first after it."""
    copy = values.copy()
    for body in np.flatnonzero(far.any(axis=0)):
        good = np.flatnonzero(valid[:, body] & ~far[:, body])
        rows = np.flatnonzero(far[:, body])
        copy[rows, body] = values[good[np.maximum(np.searchsorted(good, rows) - 1, 0)], body]
    return copy


def certainly_apart(first: FloatArray, second: FloatArray, reach: float) -> BoolArray:
    """For origins (K, 3) of two bodies that together reach so far: whether no placed corner can meet the other body.

    Rotations may be off orthonormal by 1e-3, and the reach of a very small body may have underflowed to 0: it counts
    twice, and with the smallest size of the kernels.
    """
    with np.errstate(over="ignore"):
        between = np.abs(first - second).max(axis=1)
        rounding = ROUNDING_ULPS * ROUNDOFF * (np.abs(first).max(axis=1) + np.abs(second).max(axis=1) + reach)
    apart: BoolArray = between > 2.0 * (reach + SMALLEST_SIZE) + rounding
    return apart


def asked_apart(
    far: BoolArray, valid: BoolArray, translations: FloatArray, pairs: IntArray, reaches: FloatArray
) -> Iterator[tuple[int, IntArray, IntArray]]:
    """Of each pair with far poses: its column, its frames with such a pose, and those of them that are to be asked."""
    for column, (i, j) in enumerate(pairs.tolist()):
        rows = np.flatnonzero((far[:, i] | far[:, j]) & valid[:, i] & valid[:, j])
        if len(rows):
            apart = certainly_apart(translations[rows, i], translations[rows, j], float(reaches[i] + reaches[j]))
            yield column, rows, rows[~apart]
