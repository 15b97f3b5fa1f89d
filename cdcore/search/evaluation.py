"""One evaluation: a distance of centroids, and where two balls overlap the triangle test, once per pair.

What the filter of that test cannot decide is noted and put to the exact predicate, several pairs at a time, outside
these kernels: with the exact sums linked into them they took 13 s to compile instead of 4.
"""

import numpy as np

from cdcore.kernels.compiling import always_inlined, hot_kernel, kernel, never_inlined
from cdcore.kernels.memory import doubles_at, doubles_of
from cdcore.numerics import FloatArray, IntArray
from cdcore.poses import place_points
from cdcore.poses.kernels import placed_by_row
from cdcore.search.features import CORNERS, RADIUS, Features
from cdcore.search.state import TRACED, Faces, State, States
from cdcore.triangles.decide import UNDECIDED, pair_meets_filtered, undecided_intersect

HASH = 0x9E3779B97F4A7C15 - (1 << 64)
"""Odd number near 2^64 over the golden ratio: its products spread neighbouring keys (Knuth)."""


@hot_kernel
def is_new(table: IntArray, state: State, key: int) -> bool:
    """Enter a key in the table of tested pairs (n, 2): key, generation; False if it was there.

    n is a power of two. A table that is full forgets the pair, which costs another test and changes no answer.
    """
    never_inlined()
    mask = table.shape[0] - 1
    mixed = key * HASH
    slot = (mixed ^ (mixed >> 32)) & mask
    while table[slot, 1] == state.generation:
        if table[slot, 0] == key:
            return False
        slot = (slot + 1) & mask
    if 4 * state.entries < 3 * table.shape[0]:
        table[slot, 0] = key
        table[slot, 1] = state.generation
        state.entries += 1
    return True


@hot_kernel
def place_corners(rows: FloatArray, face: int, pose: FloatArray, pair: FloatArray, first: int) -> None:
    """World corners of a face to ``pair[first:first + 9]``, rounded as reference vertices."""
    never_inlined()
    for corner in range(3):
        at = CORNERS + 3 * corner
        point = rows[face, at], rows[face, at + 1], rows[face, at + 2]
        placed = placed_by_row(pose, point)
        pair[first + 3 * corner], pair[first + 3 * corner + 1], pair[first + 3 * corner + 2] = placed


@hot_kernel
def faces_meet(i: int, j: int, faces: Faces, state: State) -> int:
    """Whether face i of A meets face j of B at the reference vertices: 0, 1, or 2 where rounding leaves it open."""
    never_inlined()
    place_corners(faces.rows_a, i, state.world_a, state.pair, 0)
    place_corners(faces.rows_b, j, state.world_b, state.pair, 9)
    return pair_meets_filtered(doubles_of(state.pair))


@hot_kernel
def leave_open(key: int, state: State) -> None:
    """Note a pair that the filter could not decide; the caller asks the exact predicate about several at a time."""
    state.open_keys[state.open] = key
    state.open += 1
    state.undecided += 1


@hot_kernel
def trace_evaluation(i: int, j: int, distance: float, state: State) -> None:
    """Write an evaluation down for who watches."""
    never_inlined()
    trace, row = doubles_at(state.trace_address), TRACED * (state.evaluations - 1)
    trace[row], trace[row + 1], trace[row + 2] = i, j, distance
    trace[row + 3], trace[row + 4], trace[row + 5] = state.iterations, state.source, np.nan


@hot_kernel
def test_once(i: int, j: int, faces: Faces, state: State) -> None:
    """Test a pair whose balls overlap unless this search has; one that meets is written to the state."""
    never_inlined()
    key = i * faces.rows_b.shape[0] + j
    if is_new(faces.table, state, key):
        state.tests += 1
        answer = faces_meet(i, j, faces, state)
        if answer == 1:
            state.hit_a = i
            state.hit_b = j
        elif answer == UNDECIDED:
            leave_open(key, state)


@hot_kernel
def evaluate(i: int, j: int, faces: Faces, state: State) -> float:
    """Distance of the centroids of faces i and j, the unit of cost; a pair that meets is written to the state."""
    always_inlined()
    rows_a, rows_b, pose = faces.rows_a, faces.rows_b, state.relative
    state.evaluations += 1
    state.quiet += 1
    x, y, z = rows_a[i, 0], rows_a[i, 1], rows_a[i, 2]
    square = 0.0
    for k in range(3):
        step = pose[3 * k] * x + pose[3 * k + 1] * y + pose[3 * k + 2] * z + pose[9 + k] - rows_b[j, k]
        square += step * step
    distance: float = np.sqrt(square)
    if state.evaluations <= state.trace_rows:
        trace_evaluation(i, j, distance, state)
    if distance < state.closest:
        state.closest = distance
        state.best_a = i
        state.best_b = j
    # written so that a distance that overflowed is tested
    if distance - (rows_a[i, RADIUS] + rows_b[j, RADIUS]) > state.pad:
        return distance
    test_once(i, j, faces, state)
    return distance


@kernel
def grow_table(old: IntArray, new: IntArray, states: States) -> None:
    """Move the pairs of this search to a larger table of zeros."""
    state = states[0]
    state.entries = 0
    for row in range(old.shape[0]):
        if old[row, 1] == state.generation:
            is_new(new, state, old[row, 0])


def meeting_pairs(first: Features, second: Features, state: State, pairs: IntArray) -> IntArray:
    """Those of the pairs (k, 2), indices of faces, that meet at the reference vertices; order kept."""
    placed = np.empty((len(pairs), 2, 3, 3))
    for side, (features, pose) in enumerate(((first, state["world_a"]), (second, state["world_b"]))):
        corners = features.rows[pairs[:, side], CORNERS:].reshape(-1, 3, 3)
        placed[:, side] = place_points(corners, pose[:9].reshape(3, 3), pose[9:])
    return pairs[undecided_intersect(placed)]
