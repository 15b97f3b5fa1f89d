"""Do two closed triangles meet? The answer of exact arithmetic for any finite coordinates, degenerate triangles
included.

Three stages, each only for what the one before left open: a float64 filter with a proved bound, exact sums, Python
integers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdcore.errors import InvalidTrianglesError
from cdcore.kernels.memory import row_of
from cdcore.narrow.exact_sums import new_digits
from cdcore.narrow.triangle_filter import UNDECIDED, pairs_intersect_compiled
from cdcore.narrow.triangle_integers import pair_intersects_integers
from cdcore.numerics import FloatArray


@dataclass(frozen=True)
class PredicateWork:
    """How many pairs each stage of the exact triangle test had to look at."""

    pairs: int
    undecided: int
    """Pairs the float64 filter left open, decided by exact sums or integers."""
    integers: int
    """Those of them whose exponents lie too far apart for exact sums."""


def triangles_intersect(triangles: ArrayLike) -> NDArray[np.bool_]:
    """Whether the two closed triangles of each pair have a point in common; touching counts.

    Choose it wherever the answer must be right: near-contact, coplanar faces, needles, points and segments as
    triangles. It has no tolerance.

    Parameters
    ----------
    triangles : (n, 2, 3, 3) finite numbers: pair, triangle, corner, coordinate.

    Returns
    -------
    (n,) bool.

    Raises
    ------
    InvalidTrianglesError
        Wrong shape, or a coordinate that is not finite (names the pair).

    Notes
    -----
    Cost: 0.05-0.1 microseconds a pair where the filter decides, 1-10 where faces share planes or corners.

    Source: Shewchuk (1997) for the bounds; section 7.1 of the project's specification for the decision.

    Examples
    --------
    >>> floor = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    >>> triangles_intersect([[floor, [[0.25, 0.25, 0], [1, 1, 1], [0, 1, 1]]]])
    array([ True])
    """
    return triangles_intersect_counted(triangles)[0]


def triangles_intersect_counted(triangles: ArrayLike) -> tuple[NDArray[np.bool_], PredicateWork]:
    """The answers of :func:`triangles_intersect` and the work behind them."""
    pairs = checked_triangles(triangles)
    answers = np.empty(len(pairs), dtype=np.uint8)
    digits = new_digits()
    undecided = int(pairs_intersect_compiled(row_of([pairs, answers, digits]), len(pairs)))
    hard = np.flatnonzero(answers == UNDECIDED)
    for index in hard.tolist():
        answers[index] = pair_intersects_integers(pairs[index].tolist())
    return answers.astype(np.bool_), PredicateWork(len(pairs), undecided, len(hard))


def checked_triangles(triangles: ArrayLike) -> FloatArray:
    """The pairs as a contiguous float64 array (n, 2, 3, 3), or one sentence why they are none."""
    try:
        array = np.ascontiguousarray(triangles, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidTrianglesError(f"triangles are not an array of numbers ({error}); give (n, 2, 3, 3)") from None
    if array.size == 0 and array.ndim in (1, 4):
        return np.zeros((0, 2, 3, 3))
    if array.ndim != 4 or array.shape[1:] != (2, 3, 3):
        raise InvalidTrianglesError(f"triangles have shape {array.shape}; give (n, 2, 3, 3)")
    finite = np.isfinite(array).all(axis=(1, 2, 3))
    if not finite.all():
        pair = int(np.flatnonzero(~finite)[0])
        raise InvalidTrianglesError(f"pair {pair} has a coordinate that is not finite; remove the pair or repair it")
    return array
