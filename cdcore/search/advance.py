"""The search as one compiled call: until it has found a pair, spent its budget, or needs something from outside."""

from cdcore.kernels.compiling import hot_kernel, kernel, stay_one_function
from cdcore.numerics import EPS, UNDERFLOW_PAD, IntArray
from cdcore.search.evaluation import evaluate
from cdcore.search.local_descent import descend, drawn_pair, is_over, local_round
from cdcore.search.rng import seed_stream
from cdcore.search.state import DRAW, FOUND, FULL, KEYLESS, SPENT, START, UNSURE, Faces, State, States, Swarm
from cdcore.search.swarm import iterate, populate

COLONY, LOCAL, RANDOM = 0, 1, 2
"""The strategies of the search."""
SEARCH, SEARCH_ON = 0, 1
"""What to do: take the poses, look at the start and search; go on with a search."""

PLACE_PAD = 1024.0 * EPS
"""Pad of the threshold in size of both bodies: their relative pose is rounded five times, each by a few eps of that
size; a pad a hundred times too wide costs a triangle test now and then, one too narrow a contact."""


@hot_kernel
def outcome(state: State) -> int:
    """Why a search stopped."""
    if state.hit_a >= 0:
        return FOUND
    return UNSURE if state.open > 0 else SPENT


@hot_kernel
def place_in(pick: IntArray, face: int) -> int:
    """Where a face stands among ascending ones, or would stand."""
    low, high = 0, len(pick) - 1
    while low < high:
        middle = (low + high) // 2
        if pick[middle] < face:
            low = middle + 1
        else:
            high = middle
    return low


@hot_kernel
def largest_coordinate(pose: State) -> float:
    """Of the place of a pose (12,)."""
    return max(abs(pose[9]), abs(pose[10]), abs(pose[11]))


@hot_kernel
def follow_start(i: int, j: int, faces: Faces, state: State) -> None:
    """Warm start: look at a pair and, if the strategy has local search, go down from it."""
    stay_one_function()
    state.asked_by = START
    distance = evaluate(i, j, faces, state)
    if state.walk != 0:
        descend(i, j, distance, faces, state)


@hot_kernel
def step(swarm: Swarm, faces: Faces, state: State) -> None:
    """A round of the strategy: an iteration of the colony, a local search, or a random pair."""
    if state.who == RANDOM:
        state.asked_by = DRAW
        i, j = drawn_pair(faces, state)
        evaluate(i, j, faces, state)
    elif state.who == LOCAL:
        local_round(faces, state)
    else:
        if state.fresh != 0:
            populate(swarm, len(faces.pick_a), len(faces.pick_b), state)
            state.fresh = 0
        iterate(swarm, faces, state)


@kernel
def advance(task: int, i: int, j: int, budget: int, swarm: Swarm, faces: Faces, states: States) -> int:
    """Do a task within ``budget`` evaluations: FOUND, SPENT, KEYLESS (give the key of this restart), FULL (grow the
    table) or UNSURE (ask about the pairs left open).

    A search begins as ``states[1]``, which has its poses, at the pair (i, j); i below 0: at none.
    """
    state = states[0]
    if task != SEARCH_ON:
        generation = state.generation + 1
        states[0] = states[1]
        state.generation = generation
        size = state.size + (largest_coordinate(state.world_a) + largest_coordinate(state.world_b))
        state.pad = PLACE_PAD * size + UNDERFLOW_PAD
    state.budget = budget
    if task != SEARCH_ON and i >= 0:
        follow_start(i, j, faces, state)
        state.start_a, state.start_b = place_in(faces.pick_a, state.best_a), place_in(faces.pick_b, state.best_b)
    if task == SEARCH and state.open > 0:
        return UNSURE
    while not is_over(state):
        if state.who == COLONY and state.quiet >= state.restart_after:
            state.fresh, state.quiet, state.keyed, state.seeded = 1, 0, 0, 0
            state.restarts += 1
        if 2 * state.entries >= faces.table.shape[0]:
            return FULL
        if state.keyed == 0:
            return KEYLESS
        if state.seeded == 0:
            seed_stream(state)
            state.seeded = 1
        step(swarm, faces, state)
    return outcome(state)


@kernel
def follow(i: int, j: int, faces: Faces, states: States) -> None:
    """Look at a pair, and go down from it if the strategy has local search."""
    follow_start(i, j, faces, states[0])
