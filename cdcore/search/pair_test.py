"""One evaluation: a distance of centroids, and where two balls overlap the triangle test, once per pair.

What the filter of that test cannot decide is noted and asked of the exact predicate, several pairs at a time, outside
these kernels: with the exact sums linked into them they took 13 s to compile instead of 4.
"""

import numpy as np

from cdcore.kernels.compiling import hot_kernel, kernel, runtime_int, stay_one_function
from cdcore.kernels.memory import doubles_of
from cdcore.narrow.triangles.filter import UNDECIDED, pair_intersects_filtered
from cdcore.narrow.triangles.predicates import triangles_intersect
from cdcore.numerics import FloatArray, IntArray, place_points
from cdcore.search import state
from cdcore.search.features import CORNERS, RADIUS, Features

HASH = 0x9E3779B97F4A7C15 - (1 << 64)
"""Odd number near 2^64 over the golden ratio: its products spread neighbouring keys (Knuth)."""


@hot_kernel
def is_new(table: IntArray, count: IntArray, key: int) -> bool:
    """Enter a key in the table of tested pairs (n, 2): key, generation; False if it was there.

    n is a power of two. A table that is full forgets the pair, which costs another test and changes no answer.
    """
    stay_one_function()
    mask = table.shape[0] - 1
    mixed = key * HASH
    slot = (mixed ^ (mixed >> 32)) & mask
    generation = count[state.GENERATION]
    while table[slot, 1] == generation:
        if table[slot, 0] == key:
            return False
        slot = (slot + 1) & mask
    if 4 * count[state.ENTRIES] < 3 * table.shape[0]:
        table[slot, 0] = key
        table[slot, 1] = generation
        count[state.ENTRIES] += 1
    return True


@hot_kernel
def place_corners(rows: FloatArray, face: int, pose: FloatArray, at: int, pair: FloatArray, first: int) -> None:
    """World corners of a face to rows ``first`` to ``first + 2`` of ``pair``, rounded as reference vertices."""
    stay_one_function()
    for corner in range(3):
        x = rows[face, CORNERS + 3 * corner]
        y = rows[face, CORNERS + 3 * corner + 1]
        z = rows[face, CORNERS + 3 * corner + 2]
        for k in range(3):
            turned = (pose[at + 3 * k] * x + pose[at + 3 * k + 1] * y) + pose[at + 3 * k + 2] * z
            pair[first + corner, k] = turned + pose[at + 9 + k]


@hot_kernel
def faces_meet(i: int, j: int, rows_a: FloatArray, rows_b: FloatArray, pose: FloatArray, pair: FloatArray) -> int:
    """Whether face i of A meets face j of B at the reference vertices: 0, 1, or 2 where rounding leaves it open."""
    stay_one_function()
    o = runtime_int(0)
    place_corners(rows_a, i, pose, o + state.WORLD_A, pair, o)
    place_corners(rows_b, j, pose, o + state.WORLD_B, pair, o + 3)
    return pair_intersects_filtered(doubles_of(pair))


@hot_kernel
def leave_open(key: int, count: IntArray) -> None:
    """Note a pair that the filter could not decide; the caller asks the exact predicate about several at a time."""
    count[state.OPEN_FIRST + count[state.OPEN]] = key
    count[state.OPEN] += 1
    count[state.UNDECIDED] += 1


@hot_kernel
def evaluate(
    i: int, j: int, rows_a: FloatArray, rows_b: FloatArray, pose: FloatArray, number: FloatArray, count: IntArray,
    table: IntArray, pair: FloatArray
) -> float:  # fmt: skip
    """Distance of the centroids of faces i and j, the unit of cost; a pair that meets is written to the counters."""
    stay_one_function()
    count[state.EVALUATIONS] += 1
    count[state.QUIET] += 1
    x, y, z = rows_a[i, 0], rows_a[i, 1], rows_a[i, 2]
    square = 0.0
    for k in range(3):
        row = state.RELATIVE + 3 * k
        step = pose[row] * x + pose[row + 1] * y + pose[row + 2] * z + pose[state.RELATIVE + 9 + k] - rows_b[j, k]
        square += step * step
    distance: float = np.sqrt(square)
    if distance < number[state.CLOSEST]:
        number[state.CLOSEST] = distance
        count[state.BEST_A] = i
        count[state.BEST_B] = j
    # written so that a distance that overflowed is tested
    if distance - (rows_a[i, RADIUS] + rows_b[j, RADIUS]) > number[state.PAD]:
        return distance
    key = i * rows_b.shape[0] + j
    if is_new(table, count, key):
        count[state.TESTS] += 1
        answer = faces_meet(i, j, rows_a, rows_b, pose, pair)
        if answer == 1:
            count[state.HIT_A] = i
            count[state.HIT_B] = j
        elif answer == UNDECIDED:
            leave_open(key, count)
    return distance


@kernel
def grow_table(old: IntArray, new: IntArray, count: IntArray) -> None:
    """Move the pairs of this search to a larger table of zeros."""
    count[state.ENTRIES] = 0
    for row in range(old.shape[0]):
        if old[row, 1] == count[state.GENERATION]:
            is_new(new, count, old[row, 0])


def meeting_pairs(first: Features, second: Features, pose: FloatArray, pairs: IntArray) -> IntArray:
    """Those of the pairs (k, 2), places of faces, that meet at the reference vertices; order kept."""
    return pairs[triangles_intersect(placed_pairs(first, second, pose, pairs))]


def placed_pairs(first: Features, second: Features, pose: FloatArray, pairs: IntArray) -> FloatArray:
    """World corners (k, 2, 3, 3) of pairs of faces."""
    placed = np.empty((len(pairs), 2, 3, 3))
    for side, (features, at) in enumerate(((first, state.WORLD_A), (second, state.WORLD_B))):
        corners = features.rows[pairs[:, side], CORNERS:].reshape(-1, 3, 3)
        placed[:, side] = place_points(corners, pose[at : at + 9].reshape(3, 3), pose[at + 9 : at + 12])
    return placed
