"""The quantum ant colony: one iteration of equations (15) to (20), each of which can be switched off."""

import numpy as np

from cdcore.kernels.compiling import hot_kernel, stay_one_function
from cdcore.numerics import FloatArray, IntArray
from cdcore.search import state
from cdcore.search.descent import descend, is_over
from cdcore.search.equations import (
    PI,
    TWO_PI,
    equation_15,
    equation_16,
    equation_17,
    equation_18,
    equation_19,
    equation_20,
    place_of,
    wrapped,
)
from cdcore.search.pair_test import evaluate

NUMBERS_PER_ANT = 7
"""Random numbers an ant uses in one iteration: whom it follows; per angle a sign, a size and a mutation."""
FARTHEST = 1e-3
"""Added to distance over scale in the heuristic, so that a distance of zero stays finite."""


@hot_kernel
def decoded(angle: float, chain: int, features: int, amplitude: int, without: int) -> int:
    """Place of the feature an angle stands for: (15), or without it straight from the angle."""
    stay_one_function()
    if without == 15:
        return place_of(wrapped(angle) / TWO_PI + 0.5, features)
    return equation_15(angle, chain, features, amplitude != 0)


@hot_kernel
def populate(swarm: FloatArray, features_a: int, features_b: int, count: IntArray, random: FloatArray) -> None:
    """Angles anew, pheromone 1, fitness 0; the first ant at the pair to start from, if any; two numbers an ant."""
    stay_one_function()
    for ant in range(count[state.ANTS]):
        swarm[ant, state.FIRST_ANGLE] = TWO_PI * random[count[state.CURSOR]]
        swarm[ant, state.SECOND_ANGLE] = TWO_PI * random[count[state.CURSOR] + 1]
        swarm[ant, state.PHEROMONE] = 1.0
        swarm[ant, state.FITNESS] = 0.0
        count[state.CURSOR] += 2
    if count[state.START_A] >= 0:
        swarm[0, state.FIRST_ANGLE] = PI * (count[state.START_A] + 0.5) / features_a
        swarm[0, state.SECOND_ANGLE] = PI * (count[state.START_B] + 0.5) / features_b
        count[state.START_A] = -1


@hot_kernel
def clamped(value: float, number: FloatArray) -> float:
    """Pheromone inside its clamp."""
    return float(max(number[state.LEAST], min(value, number[state.MOST])))


@hot_kernel
def reward(swarm: FloatArray, ant: int, distance: float, number: FloatArray, count: IntArray) -> None:
    """New fitness and heuristic of an ant; its pheromone follows by (19)."""
    stay_one_function()
    fitness = 1.0 / (1.0 + distance / number[state.SCALE])
    change = fitness - swarm[ant, state.FITNESS]
    swarm[ant, state.FITNESS] = fitness
    swarm[ant, state.HEURISTIC] = 1.0 / (FARTHEST + distance / number[state.SCALE])
    if count[state.WITHOUT] != 19:
        left = equation_19(swarm[ant, state.PHEROMONE], change, number[state.REWARD])
        swarm[ant, state.PHEROMONE] = clamped(left, number)


@hot_kernel
def weigh(swarm: FloatArray, best: int, number: FloatArray, count: IntArray) -> float:
    """(20), then (16): cumulated weights of the ants; returns their sum."""
    stay_one_function()
    highest = -np.inf
    for ant in range(count[state.ANTS]):
        if count[state.WITHOUT] != 20:
            deposit = swarm[ant, state.FITNESS] if ant == best else 0.0
            left = equation_20(swarm[ant, state.PHEROMONE], number[state.EVAPORATION], deposit)
            swarm[ant, state.PHEROMONE] = clamped(left, number)
        weight = 0.0
        if count[state.WITHOUT] != 16:
            pheromone, heuristic = swarm[ant, state.PHEROMONE], swarm[ant, state.HEURISTIC]
            weight = equation_16(pheromone, heuristic, number[state.ALPHA], number[state.BETA])
        swarm[ant, state.WEIGHT] = weight
        highest = max(highest, weight)
    total = 0.0
    for ant in range(count[state.ANTS]):
        total += np.exp(swarm[ant, state.WEIGHT] - highest)
        swarm[ant, state.WEIGHT] = total
    return total


@hot_kernel
def followed(swarm: FloatArray, ants: int, level: float) -> int:
    """The ant whose cumulated weight first exceeds a level."""
    for ant in range(ants):
        if swarm[ant, state.WEIGHT] > level:
            return ant
    return ants - 1


@hot_kernel
def stepped(angle: float, target: float, number: FloatArray, without: int, random: FloatArray, at: int) -> float:
    """A rotation towards the target angle, (17), and with some probability a NOT gate, (18); uses three numbers."""
    stay_one_function()
    ahead = wrapped(target - angle)
    sign = 1.0 if random[at] < 0.5 else -1.0
    size = number[state.TURN] * random[at + 1]
    if ahead != 0.0:
        size = 2.0 * random[at + 1] * min(number[state.TURN], abs(ahead))
        if without != 17:
            sign = 1.0 if ahead > 0.0 else -1.0
    turned = equation_17(angle, sign * size)
    if without != 18 and random[at + 2] < number[state.MUTATION]:
        return equation_18(turned)
    return turned


@hot_kernel
def move(swarm: FloatArray, total: float, number: FloatArray, count: IntArray, random: FloatArray) -> None:
    """Every ant follows one drawn by weight, all from the places before the move."""
    stay_one_function()
    ants, without = count[state.ANTS], count[state.WITHOUT]
    for ant in range(ants):
        at = count[state.CURSOR]
        chosen = followed(swarm, ants, random[at] * total)
        for k in range(2):
            angle, target = swarm[ant, state.FIRST_ANGLE + k], swarm[chosen, state.FIRST_ANGLE + k]
            swarm[ant, state.NEXT_FIRST + k] = stepped(angle, target, number, without, random, at + 1 + 3 * k)
        count[state.CURSOR] += NUMBERS_PER_ANT
    for ant in range(ants):
        swarm[ant, state.FIRST_ANGLE] = swarm[ant, state.NEXT_FIRST]
        swarm[ant, state.SECOND_ANGLE] = swarm[ant, state.NEXT_FIRST + 1]


@hot_kernel
def iterate(
    swarm: FloatArray, pick_a: IntArray, pick_b: IntArray, rows_a: FloatArray, rows_b: FloatArray, near_a: IntArray,
    near_b: IntArray, pose: FloatArray,
    number: FloatArray, count: IntArray, table: IntArray, pair: FloatArray, random: FloatArray,
) -> None:  # fmt: skip
    """One iteration: evaluate every ant, weigh, move, and improve the best pair by local search if asked to."""
    stay_one_function()
    count[state.ITERATIONS] += 1
    best, best_i, best_j, best_d = -1, 0, 0, 0.0
    amplitude, without = count[state.AMPLITUDE], count[state.WITHOUT]
    chains = 1 if without == 15 else 2
    for ant in range(count[state.ANTS]):
        closest = np.inf
        for chain in range(chains):
            i = pick_a[decoded(swarm[ant, state.FIRST_ANGLE], chain, pick_a.shape[0], amplitude, without)]
            j = pick_b[decoded(swarm[ant, state.SECOND_ANGLE], chain, pick_b.shape[0], amplitude, without)]
            d = evaluate(i, j, rows_a, rows_b, pose, number, count, table, pair)
            closest = min(closest, d)
            if best < 0 or d < best_d:
                best, best_i, best_j, best_d = ant, i, j, d
            if is_over(count):
                return
        reward(swarm, ant, closest, number, count)
    move(swarm, weigh(swarm, best, number, count), number, count, random)
    if count[state.DAEMON] != 0 and (best_i != count[state.LAST_A] or best_j != count[state.LAST_B]):
        count[state.LAST_A], count[state.LAST_B] = best_i, best_j
        descend(best_i, best_j, best_d, rows_a, rows_b, near_a, near_b, pose, number, count, table, pair)
