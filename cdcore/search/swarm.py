"""The quantum ant colony: one iteration of equations (15) to (20), each of which can be switched off."""

import numpy as np

from cdcore.kernels.compiling import hot_kernel, never_inlined
from cdcore.kernels.memory import doubles_at
from cdcore.search.equations import (
    PI,
    TWO_PI,
    equation_15,
    equation_16,
    equation_17,
    equation_18,
    equation_19,
    equation_20,
    index_of,
    wrapped_angle,
)
from cdcore.search.evaluation import evaluate
from cdcore.search.local_descent import descend, is_over
from cdcore.search.state import FROM_ANT, TRACED, Faces, State, Swarm, draw

FARTHEST = 1e-3
"""Added to distance over scale in the heuristic, so that a distance of zero stays finite."""


@hot_kernel
def decode_angle(angle: float, chain: int, features: int, state: State) -> int:
    """Index of the feature an angle stands for: (15), or without it straight from the angle."""
    never_inlined()
    if state.left_out_equation == 15:
        return index_of(wrapped_angle(angle) / TWO_PI + 0.5, features)
    return equation_15(angle, chain, features)


@hot_kernel
def populate(swarm: Swarm, features_a: int, features_b: int, state: State) -> None:
    """Angles anew, pheromone 1, fitness 0; the first ant at the pair to start from, if any."""
    never_inlined()
    for k in range(state.ants):
        ant = swarm[k]
        ant.angles[0] = TWO_PI * draw(state)
        ant.angles[1] = TWO_PI * draw(state)
        ant.pheromone, ant.fitness = 1.0, 0.0
    if state.start_a >= 0:
        swarm[0].angles[0] = PI * (state.start_a + 0.5) / features_a
        swarm[0].angles[1] = PI * (state.start_b + 0.5) / features_b
        state.start_a = -1


@hot_kernel
def clamped_pheromone(pheromone: float, state: State) -> float:
    """Pheromone inside its clamp."""
    return float(max(state.pheromone_least, min(pheromone, state.pheromone_most)))


@hot_kernel
def reward(ant: State, distance: float, state: State) -> None:
    """New fitness and heuristic of an ant; its pheromone follows by (19)."""
    never_inlined()
    fitness = 1.0 / (1.0 + distance / state.scale)
    change = fitness - ant.fitness
    ant.fitness = fitness
    ant.heuristic = 1.0 / (FARTHEST + distance / state.scale)
    if state.left_out_equation != 19:
        ant.pheromone = clamped_pheromone(equation_19(ant.pheromone, change, state.reward), state)


@hot_kernel
def weigh(swarm: Swarm, best: int, state: State) -> float:
    """(20), then (16): cumulated weights of the ants; returns their sum."""
    never_inlined()
    highest = -np.inf
    for k in range(state.ants):
        ant = swarm[k]
        if state.left_out_equation != 20:
            deposit = ant.fitness if k == best else 0.0
            ant.pheromone = clamped_pheromone(equation_20(ant.pheromone, state.evaporation, deposit), state)
        ant.weight = 0.0
        if state.left_out_equation != 16:
            ant.weight = equation_16(ant.pheromone, ant.heuristic, state.alpha, state.beta)
        highest = max(highest, ant.weight)
    total = 0.0
    for k in range(state.ants):
        total += np.exp(swarm[k].weight - highest)
        swarm[k].weight = total
    return total


@hot_kernel
def chosen_ant(swarm: Swarm, ants: int, level: float) -> int:
    """The ant whose cumulated weight first exceeds a level."""
    for k in range(ants):
        if swarm[k].weight > level:
            return k
    return ants - 1


@hot_kernel
def rotated_towards(angle: float, target: float, state: State) -> float:
    """A rotation towards the target angle, (17), and with some probability a NOT gate, (18)."""
    never_inlined()
    ahead = wrapped_angle(target - angle)
    sign, fraction, chance = 1.0 if draw(state) < 0.5 else -1.0, draw(state), draw(state)
    size = state.turn * fraction
    if ahead != 0.0:
        size = 2.0 * fraction * min(state.turn, abs(ahead))
        if state.left_out_equation != 17:
            sign = 1.0 if ahead > 0.0 else -1.0
    rotated = equation_17(angle, sign * size)
    if state.left_out_equation != 18 and chance < state.mutation:
        return equation_18(rotated)
    return rotated


@hot_kernel
def move(swarm: Swarm, total: float, state: State) -> None:
    """Every ant follows one drawn by weight, all from the places before the move."""
    never_inlined()
    for k in range(state.ants):
        chosen = chosen_ant(swarm, state.ants, draw(state) * total)
        for body in range(2):
            angle, target = swarm[k].angles[body], swarm[chosen].angles[body]
            swarm[k].next_angles[body] = rotated_towards(angle, target, state)
    for k in range(state.ants):
        swarm[k].angles[0], swarm[k].angles[1] = swarm[k].next_angles[0], swarm[k].next_angles[1]


@hot_kernel
def trace_pheromone(swarm: Swarm, first: int, chains: int, state: State) -> None:
    """Write the pheromone of the ants beside their evaluations of one iteration, from evaluation ``first`` on."""
    trace = doubles_at(state.trace_address)
    for number in range(first, min(state.evaluations, state.trace_rows)):
        trace[TRACED * number + TRACED - 1] = swarm[(number - first) // chains].pheromone


@hot_kernel
def iterate(swarm: Swarm, faces: Faces, state: State) -> None:
    """One iteration: evaluate every ant, weigh, move, and, in some variants, improve the best pair by local search."""
    never_inlined()
    state.iterations += 1
    state.source = FROM_ANT
    best, best_i, best_j, best_d = -1, 0, 0, 0.0
    chains, first = 1 if state.left_out_equation == 15 else 2, state.evaluations
    for k in range(state.ants):
        closest, ant = np.inf, swarm[k]
        for chain in range(chains):
            i = faces.pick_a[decode_angle(ant.angles[0], chain, len(faces.pick_a), state)]
            j = faces.pick_b[decode_angle(ant.angles[1], chain, len(faces.pick_b), state)]
            d = evaluate(i, j, faces, state)
            closest = min(closest, d)
            if best < 0 or d < best_d:
                best, best_i, best_j, best_d = k, i, j, d
            if is_over(state):
                trace_pheromone(swarm, first, chains, state)
                return
        reward(ant, closest, state)
    total = weigh(swarm, best, state)
    trace_pheromone(swarm, first, chains, state)
    move(swarm, total, state)
    if state.improves_best != 0 and (best_i != state.last_a or best_j != state.last_b):
        state.last_a, state.last_b = best_i, best_j
        descend(best_i, best_j, best_d, faces, state)
