"""Do two closed triangles meet? Decided exactly for any finite coordinates, degenerate triangles included.

Three stages answer, each only what the one before left open: a float64 filter with a proved bound, exact sums,
integers. Whoever asks about two faces asks here, so that no stage is gone through twice:

==========================  ==========================================================
``corners_meet``            two faces in lanes, in a kernel; the filter
``pair_meets_filtered``     one pair in a row (18,), in a kernel; the filter
``undecided_pair_meets``    the same of what the filter left open; sums
``pair_meets``              filter, then sums
``triangles_intersect``     many pairs as arrays; filter, sums, integers
``undecided_intersect``     many pairs that the filter left open; sums, integers
``unsummed_intersect``      many pairs that the sums left open; integers
==========================  ==========================================================
"""

import numpy as np
from numpy.typing import ArrayLike

from cdcore.errors import InvalidTrianglesError
from cdcore.kernels.compiling import hot_kernel, kernel, never_inlined
from cdcore.kernels.memory import Memory, doubles_of, integers_of
from cdcore.numerics import BoolArray, ByteArray, FloatArray, IntArray, readonly
from cdcore.triangles.exact_pairs import boxes_separated, pair_intersects_exact
from cdcore.triangles.filter import UNDECIDED, Corners, corners_meet, pair_meets_filtered
from cdcore.triangles.integers import pair_intersects_integers
from cdcore.triangles.sums import exponents_are_moderate, new_digits

__all__ = [
    "UNDECIDED",
    "Corners",
    "answer_pairs",
    "checked_triangles",
    "corners_meet",
    "new_digits",
    "pair_meets",
    "pair_meets_filtered",
    "placed_pair_meets",
    "triangles_intersect",
    "undecided_intersect",
    "undecided_pair_meets",
    "unsummed_intersect",
]


@hot_kernel
def undecided_pair_meets(p: Memory, digits: Memory) -> int:
    """0 no, 1 yes, by exact sums, for a pair that the filter left open; UNDECIDED where only integers can tell."""
    never_inlined()
    if boxes_separated(p):
        return 0
    if not exponents_are_moderate(p, 18):
        return UNDECIDED
    return 1 if pair_intersects_exact(p, digits) else 0


@hot_kernel
def pair_meets(p: Memory, digits: Memory) -> int:
    """0 no, 1 yes, by exact sums where the filter cannot tell; UNDECIDED where only integers can."""
    never_inlined()
    answer = pair_meets_filtered(p)
    if answer == UNDECIDED:
        answer = undecided_pair_meets(p, digits)
    return answer


@hot_kernel
def placed_pair_meets(pair: FloatArray, digits: IntArray) -> int:
    """``pair_meets`` of an array (18,): the leaf test of hierarchies."""
    never_inlined()
    return pair_meets(doubles_of(pair), integers_of(digits))


@kernel
def answer_pairs(pairs: FloatArray, answers: ByteArray, filtered: bool, digits: IntArray) -> None:
    """Answer 0, 1, or UNDECIDED for pairs (n, 2, 3, 3); ``filtered``: the filter has left all of them open."""
    for k in range(len(pairs)):
        if filtered:
            answers[k] = undecided_pair_meets(doubles_of(pairs[k]), integers_of(digits))
        else:
            answers[k] = pair_meets(doubles_of(pairs[k]), integers_of(digits))


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
    return _answers(checked_triangles(triangles), filtered=False)


def undecided_intersect(pairs: FloatArray) -> BoolArray:
    """The same of finite pairs (n, 2, 3, 3) that the filter left open."""
    return _answers(np.ascontiguousarray(pairs), filtered=True)


def _answers(pairs: FloatArray, *, filtered: bool) -> BoolArray:
    answers = _answered(pairs, filtered=filtered)
    left = np.flatnonzero(answers == UNDECIDED)
    if left.size:
        answers[left] = unsummed_intersect(pairs[left])
    return answers.astype(np.bool_)


def _answered(pairs: FloatArray, *, filtered: bool) -> ByteArray:
    answers = np.empty(len(pairs), dtype=np.uint8)
    answer_pairs(readonly(pairs[:]), answers, filtered, new_digits())
    return answers


def unsummed_intersect(pairs: FloatArray) -> BoolArray:
    """The same of pairs so large or small that products leave the range of sums.

    They are scaled by powers of two first; where coordinates lie so far apart that the smallest lose bits by that,
    integers decide.
    """
    exponents = np.frexp(np.abs(pairs).max(axis=(1, 2, 3), keepdims=True))[1]
    scaled = np.ldexp(pairs, -exponents)
    answers = _answered(scaled, filtered=False)
    answers[(np.ldexp(scaled, exponents) != pairs).any(axis=(1, 2, 3))] = UNDECIDED
    for index in np.flatnonzero(answers == UNDECIDED).tolist():
        answers[index] = pair_intersects_integers(pairs[index])
    return answers.astype(np.bool_)


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
