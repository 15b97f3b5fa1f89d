"""The search as one compiled call: until it has found a pair, spent its budget, or needs something from outside.

Random numbers come from outside in blocks, so that every machine draws the same ones.
"""

import numpy as np

from cdcore.kernels.compiling import hot_kernel, kernel, stay_one_function
from cdcore.numerics import FloatArray, IntArray
from cdcore.search import state
from cdcore.search.descent import DRAWS, descend, is_over, local_round
from cdcore.search.pair_test import evaluate
from cdcore.search.swarm import NUMBERS_PER_ANT, iterate, populate

COLONY, LOCAL, RANDOM = 0, 1, 2
"""The strategies of the search."""
RANDOM_STEP = 16
"""Random pairs drawn between two checks of how many random numbers are left."""


@hot_kernel
def random_round(
    pick_a: IntArray, pick_b: IntArray, rows_a: FloatArray, rows_b: FloatArray, pose: FloatArray, number: FloatArray,
    count: IntArray, table: IntArray, pair: FloatArray, random: FloatArray,
) -> None:  # fmt: skip
    """Sixteen uniform random pairs; needs 32 random numbers."""
    stay_one_function()
    for _ in range(RANDOM_STEP):
        i = pick_a[int(random[count[state.CURSOR]] * pick_a.shape[0])]
        j = pick_b[int(random[count[state.CURSOR] + 1] * pick_b.shape[0])]
        count[state.CURSOR] += 2
        evaluate(i, j, rows_a, rows_b, pose, number, count, table, pair)
        if is_over(count):
            return


@hot_kernel
def needed(who: int, count: IntArray) -> int:
    """Random numbers that the next step may use."""
    if who == LOCAL:
        return 2 * DRAWS
    if who == RANDOM:
        return 2 * RANDOM_STEP
    return int((NUMBERS_PER_ANT + 2) * count[state.ANTS])


@hot_kernel
def outcome(count: IntArray) -> int:
    """Why a search stopped."""
    if count[state.HIT_A] >= 0:
        return state.FOUND
    return state.UNSURE if count[state.OPEN] > 0 else state.SPENT


@kernel
def advance(
    who: int, swarm: FloatArray, pick_a: IntArray, pick_b: IntArray, rows_a: FloatArray, rows_b: FloatArray,
    near_a: IntArray, near_b: IntArray, pose: FloatArray, number: FloatArray, count: IntArray, table: IntArray,
    random: FloatArray,
) -> int:  # fmt: skip
    """Search on: FOUND, SPENT, HUNGRY (give random numbers, cursor at 0), STALE (give those of another restart), FULL
    (grow the table) or UNSURE (ask about the pairs left open).
    """
    pair = np.empty((6, 3))
    while not is_over(count):
        if who == COLONY and count[state.QUIET] >= count[state.RESTART_AFTER]:
            count[state.FRESH] = 1
            count[state.QUIET] = 0
            return state.STALE
        if 2 * count[state.ENTRIES] >= table.shape[0]:
            return state.FULL
        if count[state.CURSOR] + needed(who, count) > random.shape[0]:
            return state.HUNGRY
        if who == RANDOM:
            random_round(pick_a, pick_b, rows_a, rows_b, pose, number, count, table, pair, random)
        elif who == LOCAL:
            local_round(pick_a, pick_b, rows_a, rows_b, near_a, near_b, pose, number, count, table, pair, random)
        else:
            if count[state.FRESH] != 0:
                populate(swarm, pick_a.shape[0], pick_b.shape[0], count, random)
                count[state.FRESH] = 0
            iterate(swarm, pick_a, pick_b, rows_a, rows_b, near_a, near_b, pose, number, count, table, pair, random)
    return outcome(count)


@kernel
def follow(
    walk: bool, i: int, j: int, rows_a: FloatArray, rows_b: FloatArray, near_a: IntArray, near_b: IntArray,
    pose: FloatArray, number: FloatArray, count: IntArray, table: IntArray
) -> int:  # fmt: skip
    """Warm start: look at a pair and, if asked to, go down from it; FOUND, SPENT at the end of the way, or UNSURE."""
    pair = np.empty((6, 3))
    d = evaluate(i, j, rows_a, rows_b, pose, number, count, table, pair)
    if walk:
        descend(i, j, d, rows_a, rows_b, near_a, near_b, pose, number, count, table, pair)
    return outcome(count)
