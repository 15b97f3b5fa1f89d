"""The search as one compiled call: until it has found a pair, spent its budget, or needs something from outside.

Random numbers come from outside in blocks, so that every machine draws the same ones.
"""

from cdcore.kernels.compiling import hot_kernel, kernel, stay_one_function
from cdcore.numerics import FloatArray
from cdcore.search.descent import DRAWS, descend, is_over, local_round
from cdcore.search.pair_test import evaluate
from cdcore.search.state import DRAW, FOUND, FULL, HUNGRY, SPENT, STALE, START, UNSURE, Faces, State, States, Swarm
from cdcore.search.swarm import NUMBERS_PER_ANT, iterate, populate

COLONY, LOCAL, RANDOM = 0, 1, 2
"""The strategies of the search."""
RANDOM_STEP = 16
"""Random pairs drawn between two checks of how many random numbers are left."""


@hot_kernel
def random_round(faces: Faces, state: State, random: FloatArray) -> None:
    """Sixteen uniform random pairs; needs 32 random numbers."""
    stay_one_function()
    state.asked_by = DRAW
    for _ in range(RANDOM_STEP):
        i = faces.pick_a[int(random[state.cursor] * len(faces.pick_a))]
        j = faces.pick_b[int(random[state.cursor + 1] * len(faces.pick_b))]
        state.cursor += 2
        evaluate(i, j, faces, state)
        if is_over(state):
            return


@hot_kernel
def needed(who: int, state: State) -> int:
    """Random numbers that the next step may use."""
    if who == LOCAL:
        return 2 * DRAWS
    if who == RANDOM:
        return 2 * RANDOM_STEP
    return int((NUMBERS_PER_ANT + 2) * state.ants)


@hot_kernel
def outcome(state: State) -> int:
    """Why a search stopped."""
    if state.hit_a >= 0:
        return FOUND
    return UNSURE if state.open > 0 else SPENT


@kernel
def advance(who: int, swarm: Swarm, faces: Faces, states: States, random: FloatArray) -> int:
    """Search on: FOUND, SPENT, HUNGRY (give random numbers, cursor at 0), STALE (give those of another restart), FULL
    (grow the table) or UNSURE (ask about the pairs left open).
    """
    state = states[0]
    while not is_over(state):
        if who == COLONY and state.quiet >= state.restart_after:
            state.fresh = 1
            state.quiet = 0
            return STALE
        if 2 * state.entries >= faces.table.shape[0]:
            return FULL
        if state.cursor + needed(who, state) > random.shape[0]:
            return HUNGRY
        if who == RANDOM:
            random_round(faces, state, random)
        elif who == LOCAL:
            local_round(faces, state, random)
        else:
            if state.fresh != 0:
                populate(swarm, len(faces.pick_a), len(faces.pick_b), state, random)
                state.fresh = 0
            iterate(swarm, faces, state, random)
    return outcome(state)


@kernel
def follow(walk: bool, i: int, j: int, faces: Faces, states: States) -> int:
    """Warm start: look at a pair and, if asked to, go down from it; FOUND, SPENT at the end of the way, or UNSURE."""
    state = states[0]
    state.asked_by = START
    d = evaluate(i, j, faces, state)
    if walk:
        descend(i, j, d, faces, state)
    return outcome(state)
