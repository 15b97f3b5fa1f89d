"""Flood fill: from pairs that meet over neighbours to every pair of their curves.

In general position the pairs that meet form curves, and where a curve crosses an edge one of the two faces changes to
its neighbour across that edge. Where a curve passes a vertex or lies in both surfaces (the filter of the triangle test
then leaves pairs open) neighbours across corners count too.

Source: section 3.4 of the project's specification.
"""

from cdcore.kernels.compiling import hot_kernel, kernel, never_inlined
from cdcore.numerics import IntArray
from cdcore.search.evaluation import faces_meet, is_new, leave_open
from cdcore.search.features import NEIGHBOURS
from cdcore.search.state import DONE, FULL, OPEN_KEPT, STALE, UNSURE, Faces, State, States
from cdcore.triangles.decide import UNDECIDED


@hot_kernel
def enter(i: int, j: int, contacts: IntArray, faces: Faces, state: State) -> int:
    """Test a pair that is new and add it to the contacts; DONE, FULL, UNSURE, or STALE: corners count from here on."""
    never_inlined()
    if state.contact_count >= contacts.shape[0] or 4 * state.entries + 4 >= 3 * faces.table.shape[0]:
        return FULL
    if state.open >= OPEN_KEPT:
        return UNSURE
    key = i * faces.rows_b.shape[0] + j
    if not is_new(faces.table, state, key):
        return DONE
    state.flood_tests += 1
    answer = faces_meet(i, j, faces, state)
    if answer == 1:
        contacts[state.contact_count, 0] = i
        contacts[state.contact_count, 1] = j
        state.contact_count += 1
    elif answer == UNDECIDED:
        leave_open(key, state)
        if state.by_corners == 0:
            state.by_corners = 1
            return STALE
    return DONE


@hot_kernel
def spread(second: bool, i: int, j: int, links: IntArray, contacts: IntArray, faces: Faces, state: State) -> int:
    """Enter the neighbours of one face of a pair, with the other face."""
    never_inlined()
    face, near = (j, faces.near_b) if second else (i, faces.near_a)
    edges = state.by_corners == 0 and near[face, NEIGHBOURS] < NEIGHBOURS
    for corner in range(1 if edges else 3):
        at = 3 * near.shape[0] + links[3 * face + corner]
        for k in range(0 if edges else links[at], near[face, NEIGHBOURS] if edges else links[at + 1]):
            other = near[face, k] if edges else links[k]
            a, b = (i, other) if second else (other, j)
            outcome = enter(a, b, contacts, faces, state)
            if outcome != DONE:
                return outcome
    return DONE


@kernel
def flood(seeds: IntArray, contacts: IntArray, links: tuple[IntArray, IntArray], faces: Faces, states: States) -> int:
    """Test ``seeds`` (n, 2), pairs of another time, and look around every pair ``contacts`` (n, 2).

    DONE: done; FULL: grow ``contacts`` and table; UNSURE: ask about open ones. May be called again after either: pairs
    tested before are not tested again.
    """
    state = states[0]
    for row in range(seeds.shape[0]):
        outcome = enter(seeds[row, 0], seeds[row, 1], contacts, faces, state)
        if outcome == STALE:
            state.head = 0
        elif outcome != DONE:
            return outcome
    while state.head < state.contact_count:
        i, j = contacts[state.head, 0], contacts[state.head, 1]
        outcome = spread(False, i, j, links[0], contacts, faces, state)
        if outcome == DONE:
            outcome = spread(True, i, j, links[1], contacts, faces, state)
        if outcome == DONE:
            state.head += 1
        elif outcome == STALE:
            state.head = 0
        else:
            return outcome
    return UNSURE if state.open > 0 else DONE
