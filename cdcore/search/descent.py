"""Local search: from a pair of faces over their neighbours to ever smaller distance, until none is smaller."""

from __future__ import annotations

from cdcore.narrow.compiling import hot_kernel, stay_one_function
from cdcore.numerics import FloatArray, IntArray
from cdcore.search.features import NEIGHBOURS
from cdcore.search.pair_test import evaluate
from cdcore.search.state import BUDGET, CURSOR, EVALUATIONS, HIT_A, OPEN, OPEN_ASKED, ROUNDS

DRAWS = 32
"""Random pairs among which a round of local search chooses its start."""


@hot_kernel
def is_over(count: IntArray) -> bool:
    """A pair meets, the budget is spent, or enough pairs are left open to ask about them."""
    return bool(count[HIT_A] >= 0 or count[EVALUATIONS] >= count[BUDGET] or count[OPEN] >= OPEN_ASKED)


@hot_kernel
def descend(
    i: int, j: int, distance: float, rows_a: FloatArray, rows_b: FloatArray, near_a: IntArray, near_b: IntArray,
    pose: FloatArray, number: FloatArray, count: IntArray, table: IntArray, pair: FloatArray
) -> None:  # fmt: skip
    """Go down from pair (i, j) at its distance; ends at a hit, at the budget, or where no neighbour is closer."""
    stay_one_function()
    moving = True
    while moving and not is_over(count):
        moving = False
        at_i, at_j = i, j
        for k in range(2 * NEIGHBOURS):
            a, b = at_i, at_j
            if k < NEIGHBOURS:
                a = near_a[at_i, k]
            else:
                b = near_b[at_j, k - NEIGHBOURS]
            if a < 0 or b < 0:
                continue
            d = evaluate(a, b, rows_a, rows_b, pose, number, count, table, pair)
            if d < distance:
                distance, i, j = d, a, b
                moving = True
            if is_over(count):
                return


@hot_kernel
def local_round(
    pick_a: IntArray, pick_b: IntArray, rows_a: FloatArray, rows_b: FloatArray, near_a: IntArray, near_b: IntArray,
    pose: FloatArray, number: FloatArray,
    count: IntArray, table: IntArray, pair: FloatArray, random: FloatArray,
) -> None:  # fmt: skip
    """Down from the best of 32 random pairs; needs 64 random numbers."""
    stay_one_function()
    count[ROUNDS] += 1
    best_i, best_j, best = -1, -1, 0.0
    for _ in range(DRAWS):
        i = pick_a[int(random[count[CURSOR]] * pick_a.shape[0])]
        j = pick_b[int(random[count[CURSOR] + 1] * pick_b.shape[0])]
        count[CURSOR] += 2
        d = evaluate(i, j, rows_a, rows_b, pose, number, count, table, pair)
        if best_i < 0 or d < best:
            best_i, best_j, best = i, j, d
        if is_over(count):
            return
    descend(best_i, best_j, best, rows_a, rows_b, near_a, near_b, pose, number, count, table, pair)
