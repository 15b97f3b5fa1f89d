"""Flood fill: from pairs that meet over neighbours to every pair of their curves.

In general position the pairs that meet form curves, and where a curve crosses an edge one of the two faces changes to
its neighbour across that edge. Where a curve passes a vertex or lies in both surfaces (the filter of the triangle test
then leaves pairs open) neighbours across corners count too.

Source: section 3.4 of the project's specification.
"""

import numpy as np

from cdcore.kernels.compiling import hot_kernel, kernel, stay_one_function
from cdcore.narrow.triangles.filter import UNDECIDED
from cdcore.numerics import FloatArray, IntArray
from cdcore.search import state
from cdcore.search.features import NEIGHBOURS
from cdcore.search.pair_test import faces_meet, is_new, leave_open


@hot_kernel
def enter(
    i: int, j: int, found: IntArray, rows_a: FloatArray, rows_b: FloatArray, pose: FloatArray, count: IntArray,
    table: IntArray, pair: FloatArray,
) -> int:  # fmt: skip
    """Test a pair that is new and add it to those found; SPENT, FULL, UNSURE, or STALE: corners count from here on."""
    stay_one_function()
    if count[state.FOUND_COUNT] >= found.shape[0] or 4 * count[state.ENTRIES] + 4 >= 3 * table.shape[0]:
        return state.FULL
    if count[state.OPEN] >= state.OPEN_KEPT:
        return state.UNSURE
    key = i * rows_b.shape[0] + j
    if not is_new(table, count, key):
        return state.SPENT
    count[state.FLOOD_TESTS] += 1
    answer = faces_meet(i, j, rows_a, rows_b, pose, pair)
    if answer == 1:
        found[count[state.FOUND_COUNT], 0] = i
        found[count[state.FOUND_COUNT], 1] = j
        count[state.FOUND_COUNT] += 1
    elif answer == UNDECIDED:
        leave_open(key, count)
        if count[state.BY_CORNERS] == 0:
            count[state.BY_CORNERS] = 1
            return state.STALE
    return state.SPENT


@hot_kernel
def spread(
    second: bool, i: int, j: int, near: IntArray, links: IntArray, found: IntArray, rows_a: FloatArray,
    rows_b: FloatArray, pose: FloatArray, count: IntArray, table: IntArray, pair: FloatArray,
) -> int:  # fmt: skip
    """Enter the neighbours of one face of a pair, with the other face."""
    stay_one_function()
    face = j if second else i
    faces = near.shape[0]
    edges = count[state.BY_CORNERS] == 0 and near[face, NEIGHBOURS] < NEIGHBOURS
    for corner in range(1 if edges else 3):
        at = 3 * faces + links[3 * face + corner]
        for k in range(0 if edges else links[at], near[face, NEIGHBOURS] if edges else links[at + 1]):
            other = near[face, k] if edges else links[k]
            a, b = (i, other) if second else (other, j)
            outcome = enter(a, b, found, rows_a, rows_b, pose, count, table, pair)
            if outcome != state.SPENT:
                return outcome
    return state.SPENT


@kernel
def flood(
    found: IntArray, rows_a: FloatArray, rows_b: FloatArray, near_a: IntArray, near_b: IntArray, links_a: IntArray,
    links_b: IntArray, pose: FloatArray, count: IntArray, table: IntArray,
) -> int:  # fmt: skip
    """Look around every pair found (n, 2); SPENT: done, FULL: grow ``found`` and table, UNSURE: ask about open ones.

    May be called again after either: pairs tested before are not tested again.
    """
    pair = np.empty((6, 3))
    while count[state.HEAD] < count[state.FOUND_COUNT]:
        i, j = found[count[state.HEAD], 0], found[count[state.HEAD], 1]
        outcome = spread(False, i, j, near_a, links_a, found, rows_a, rows_b, pose, count, table, pair)
        if outcome == state.SPENT:
            outcome = spread(True, i, j, near_b, links_b, found, rows_a, rows_b, pose, count, table, pair)
        if outcome == state.SPENT:
            count[state.HEAD] += 1
        elif outcome == state.STALE:
            count[state.HEAD] = 0
        else:
            return outcome
    return state.UNSURE if count[state.OPEN] > 0 else state.SPENT


@kernel
def sow(
    seeds: IntArray, found: IntArray, rows_a: FloatArray, rows_b: FloatArray, pose: FloatArray, count: IntArray,
    table: IntArray,
) -> int:  # fmt: skip
    """Test seeds (n, 2), pairs of another time, and add those that meet to those found; FULL as ``flood``."""
    pair = np.empty((6, 3))
    for row in range(seeds.shape[0]):
        outcome = enter(seeds[row, 0], seeds[row, 1], found, rows_a, rows_b, pose, count, table, pair)
        if outcome == state.STALE:
            count[state.HEAD] = 0
        elif outcome != state.SPENT:
            return outcome
    return state.SPENT
