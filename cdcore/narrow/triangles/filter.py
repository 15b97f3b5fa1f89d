"""Decides nearly all triangle pairs in plain float64 and never wrongly: yes, no, or undecided.

Undecided are pairs within rounding of touching, coplanar ones and needles: 0 % of ordinary geometry, nearly all of
resting contact.
"""

from cdcore.kernels.compiling import hot_kernel, kernel, runtime_int
from cdcore.kernels.memory import Memory, bytes_at, doubles_at, words_at
from cdcore.narrow.triangles.exact import boxes_apart, pair_intersects_exact
from cdcore.narrow.triangles.orientation import orientation_filtered
from cdcore.narrow.triangles.sums import exponents_are_moderate
from cdcore.numerics import IntArray

UNDECIDED = 2


@hot_kernel
def one_sided(first: int, second: int, third: int) -> bool:
    """Three certain and equal signs."""
    return first == second and second == third and first != UNDECIDED


@hot_kernel
def pair_intersects_filtered(p: Memory) -> int:
    """0 no, 1 yes, 2 undecided, for rows 0-2 against rows 3-5 of p (6, 3)."""
    if boxes_apart(p):
        return 0
    o = runtime_int(0)
    t = o + 3
    a0 = orientation_filtered(p, t, t + 1, t + 2, o)
    a1 = orientation_filtered(p, t, t + 1, t + 2, o + 1)
    a2 = orientation_filtered(p, t, t + 1, t + 2, o + 2)
    if one_sided(a0, a1, a2):
        return 0
    b0 = orientation_filtered(p, o, o + 1, o + 2, t)
    b1 = orientation_filtered(p, o, o + 1, o + 2, t + 1)
    b2 = orientation_filtered(p, o, o + 1, o + 2, t + 2)
    if one_sided(b0, b1, b2):
        return 0
    v00 = orientation_filtered(p, o, o + 1, t, t + 1)
    v01 = orientation_filtered(p, o, o + 1, t + 1, t + 2)
    v02 = orientation_filtered(p, o, o + 1, t + 2, t)
    v10 = orientation_filtered(p, o + 1, o + 2, t, t + 1)
    v11 = orientation_filtered(p, o + 1, o + 2, t + 1, t + 2)
    v12 = orientation_filtered(p, o + 1, o + 2, t + 2, t)
    v20 = orientation_filtered(p, o + 2, o, t, t + 1)
    v21 = orientation_filtered(p, o + 2, o, t + 1, t + 2)
    v22 = orientation_filtered(p, o + 2, o, t + 2, t)
    # an edge whose ends lie certainly on different sides of the other plane (-1 is their product) and passes
    # certainly inside
    if (
        (a0 * a1 == -1 and one_sided(v00, v01, v02))
        or (a1 * a2 == -1 and one_sided(v10, v11, v12))
        or (a2 * a0 == -1 and one_sided(v20, v21, v22))
        or (b0 * b1 == -1 and one_sided(v00, v10, v20))
        or (b1 * b2 == -1 and one_sided(v01, v11, v21))
        or (b2 * b0 == -1 and one_sided(v02, v12, v22))
    ):
        return 1
    uncertain = max(max(max(a0, a1), max(a2, b0)), max(max(b1, b2), max(v00, v01)))
    uncertain = max(uncertain, max(max(max(v02, v10), max(v11, v12)), max(max(v20, v21), v22)))
    return UNDECIDED if uncertain == UNDECIDED else 0


@kernel
def pairs_intersect_compiled(row: IntArray, count: int) -> int:
    """Answer 0, 1, or 2 where only integers can tell; returns how many the filter left undecided.

    ``row`` holds addresses: of the pairs (n, 18), the answers (n,), and the digits of an exact sum.
    """
    answers, digits, undecided = bytes_at(row[1]), words_at(row[2]), 0
    for k in range(count):
        pair = doubles_at(row[0] + 144 * k)
        answer = pair_intersects_filtered(pair)
        if answer == UNDECIDED:
            undecided += 1
            if exponents_are_moderate(pair, runtime_int(18)):
                answer = 1 if pair_intersects_exact(pair, digits) else 0
        answers[k] = answer
    return undecided
