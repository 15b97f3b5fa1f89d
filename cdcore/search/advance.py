"""The search as one compiled call: until it has found a pair, spent its budget, or needs something from outside."""

import numpy as np

from cdcore.kernels.compiling import hot_kernel, kernel, never_inlined
from cdcore.numerics import EPS, UNDERFLOW_PAD, FloatArray, IntArray
from cdcore.poses.kernels import relative_pose
from cdcore.search.evaluation import evaluate
from cdcore.search.local_descent import descend, drawn_pair, is_over, local_round
from cdcore.search.state import DONE, DRAW, FULL, START, UNSURE, Faces, State, States, Swarm
from cdcore.search.swarm import iterate, populate

COLONY, LOCAL, RANDOM = 0, 1, 2
"""The strategies of the search."""
SEARCH, SEARCH_ON = 0, 1
"""What to do: take the poses, look at the start and search; go on with a search."""

PLACING_PAD = 1024.0 * EPS
"""Pad of the threshold in size of both bodies: their relative pose is rounded five times, each by a few eps of that
size; a pad a hundred times too wide costs a triangle test now and then, one too narrow a contact."""


@kernel
def take_poses(
    rotation_a: FloatArray, move_a: FloatArray, rotation_b: FloatArray, move_b: FloatArray, states: States
) -> None:
    """Write poses of both bodies, and of A as B sees it, to the record that the next search begins as."""
    state, rotation, move = states[1], np.empty((3, 3)), np.empty(3)
    relative_pose(rotation_b, move_b, rotation_a, move_a, rotation, move)
    state.relative[12] = 0.0
    for i in range(3):  # assigned as slices, arrays took 2.5 s to compile, not 0.3 (2026-11)
        for j in range(3):
            state.world_a[3 * i + j], state.world_b[3 * i + j] = rotation_a[i, j], rotation_b[i, j]
            state.relative[3 * i + j] = rotation[i, j]
        state.world_a[9 + i], state.world_b[9 + i], state.relative[9 + i] = move_a[i], move_b[i], move[i]
        state.relative[12] = max(state.relative[12], abs(move_a[i]), abs(move_b[i]))


@hot_kernel
def index_in(pick: IntArray, face: int) -> int:
    """Index of a face among ascending ones, or where it would be inserted."""
    lower, upper = 0, len(pick) - 1
    while lower < upper:
        middle = (lower + upper) // 2
        if pick[middle] < face:
            lower = middle + 1
        else:
            upper = middle
    return lower


@hot_kernel
def follow_start(i: int, j: int, faces: Faces, state: State) -> float:
    """Warm start: look at a pair and, if the strategy has local search, go down from it; distance of the pair."""
    never_inlined()
    state.asked_by = START
    distance: float = evaluate(i, j, faces, state)
    if state.descends_from_start != 0:
        descend(i, j, distance, faces, state)
    return distance


@hot_kernel
def step(swarm: Swarm, faces: Faces, state: State) -> None:
    """A round of the strategy: an iteration of the colony, a local search, or a random pair."""
    if state.searcher == RANDOM:
        state.asked_by = DRAW
        i, j = drawn_pair(faces, state)
        evaluate(i, j, faces, state)
    elif state.searcher == LOCAL:
        local_round(faces, state)
    else:
        if state.fresh != 0:
            populate(swarm, len(faces.pick_a), len(faces.pick_b), state)
            state.fresh = 0
        iterate(swarm, faces, state)


@kernel
def advance(task: int, i: int, j: int, budget: int, swarm: Swarm, faces: Faces, states: States) -> int:
    """Do a task within ``budget`` evaluations: DONE, FULL (grow the table) or UNSURE (ask about the pairs left open).

    A search begins as ``states[1]``, which has its poses, at the pair (i, j); i below 0: at none.
    """
    state = states[0]
    if task == SEARCH:
        generation = state.generation + 1
        states[0] = states[1]
        state.generation = generation
        state.pad = PLACING_PAD * (state.bodies_size + 2.0 * state.relative[12]) + UNDERFLOW_PAD
    state.budget = budget
    if task == SEARCH and i >= 0:
        follow_start(i, j, faces, state)
        state.start_a, state.start_b = index_in(faces.pick_a, state.best_a), index_in(faces.pick_b, state.best_b)
        if state.open > 0:
            return UNSURE
    while not is_over(state):
        if state.searcher == COLONY and state.quiet >= state.restart_after:
            state.fresh, state.quiet = 1, 0
            state.restarts += 1
        if 2 * state.entries >= faces.table.shape[0]:
            return FULL
        step(swarm, faces, state)
    return UNSURE if state.hit_a < 0 and state.open > 0 else DONE


@kernel
def follow(i: int, j: int, faces: Faces, states: States) -> float:
    """Look at a pair, and go down from it if the strategy has local search; distance of the pair."""
    return follow_start(i, j, faces, states[0])
