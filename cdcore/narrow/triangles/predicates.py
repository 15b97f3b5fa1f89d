"""Do two closed triangles meet? Decided exactly for any finite coordinates, degenerate triangles included.

Each of three stages is for what the one before left open: a float64 filter with a proved bound, exact sums, integers.
"""

import numpy as np
from numpy.typing import ArrayLike

from cdcore.errors import InvalidTrianglesError
from cdcore.kernels.compiling import kernel
from cdcore.kernels.memory import doubles_of, integers_of
from cdcore.narrow.triangles.filter import UNDECIDED, pair_intersects
from cdcore.narrow.triangles.integers import pair_intersects_integers
from cdcore.narrow.triangles.sums import new_digits
from cdcore.numerics import BoolArray, ByteArray, FloatArray, IntArray, readonly


def triangles_intersect(triangles: ArrayLike) -> BoolArray:
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
    pairs = checked_triangles(triangles)
    answers = np.empty(len(pairs), dtype=np.uint8)
    answer_pairs(readonly(pairs[:]), answers, new_digits())
    left = np.flatnonzero(answers == UNDECIDED)
    if left.size:
        answers[left] = _answers_at_unit_scale(pairs[left])
    for index in np.flatnonzero(answers == UNDECIDED).tolist():
        answers[index] = pair_intersects_integers(pairs[index])
    return answers.astype(np.bool_)


def _answers_at_unit_scale(pairs: FloatArray) -> ByteArray:
    """The same of pairs so large or small that products leave the range of sums, scaled by powers of two."""
    exponents = np.frexp(np.abs(pairs).max(axis=(1, 2, 3), keepdims=True))[1]
    scaled = np.ldexp(pairs, -exponents)
    answers = np.empty(len(pairs), dtype=np.uint8)
    answer_pairs(readonly(scaled), answers, new_digits())
    # Of coordinates that lie too far apart the smallest lose bits.
    answers[(np.ldexp(scaled, exponents) != pairs).any(axis=(1, 2, 3))] = UNDECIDED
    return answers


@kernel
def answer_pairs(pairs: FloatArray, answers: ByteArray, digits: IntArray) -> None:
    """Answer 0, 1, or UNDECIDED where only integers can tell, for pairs (n, 2, 3, 3)."""
    for k in range(len(pairs)):
        answers[k] = pair_intersects(doubles_of(pairs[k]), integers_of(digits))


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
