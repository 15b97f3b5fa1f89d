"""Equations (15) to (20) as the paper prints them: after a few iterations their values are no longer probabilities.

Kept to show that they break, and how. Fitness is the distance to be driven down, which (19) then rewards for growing;
powers of differences are added to pheromone without a clamp; the gate of (17) with ``-cos`` shrinks its vector.
"""

from collections.abc import Callable, Iterator
from itertools import count

import numpy as np

from cdcore.numerics import FloatArray
from cdcore.search.search_settings import SearchSettings


class SearchOverError(Exception):
    """A pair meets, or the budget is spent."""


def printed_15(amplitude: float, features: int) -> int:
    """The linear map from an amplitude, which a qubit that (17) shrank leaves in the middle."""
    # Built-in minimum and maximum: of two numbers, numpy's take ten times as long.
    fraction = min(max(0.5 + 0.5 * amplitude, 0.0), 1.0)
    return min(int(fraction * features), features - 1)


def printed_16(pheromone: FloatArray, heuristic: FloatArray, alpha: float, beta: float) -> FloatArray:
    """A plain ratio of powers; what it gives may be negative or no number."""
    with np.errstate(all="ignore"):
        weight = pheromone**alpha * heuristic**beta
        return weight / weight.sum()


def printed_17(theta: FloatArray, qubits: FloatArray) -> FloatArray:
    """The gate on qubits (..., 2) by angles (...): its last entry is ``-cos``, so that it is no rotation."""
    cos, sin = np.cos(theta), np.sin(theta)
    a, b = qubits[..., 0], qubits[..., 1]
    return np.stack([cos * a - sin * b, sin * a - cos * b], axis=-1)


def printed_19(change: float, exponent: float) -> float:
    """Returns the amount added to pheromone or heuristic: ``sgn(x) |x|^exponent``."""
    return float(np.sign(change) * np.abs(change) ** exponent)


def iterations_as_printed(
    evaluate: Callable[[int, int], float], sizes: tuple[int, int], settings: SearchSettings, stream: np.random.Generator
) -> Iterator[int]:
    """The number of each iteration when it begins, from 1 on, until the probabilities are none.

    ``evaluate`` gives the distance of a pair of features by their indices, or ends the search by ``SearchOverError``;
    ``sizes``: features of both bodies. Of the settings ants, turn, mutation, alpha, beta and evaporation count.
    """
    ants = settings.ants
    angle = 2 * np.pi * stream.random((ants, 2))
    qubits = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    pheromone, heuristic = np.ones(ants), np.ones(ants)
    f, change = np.zeros(ants), np.zeros(ants)
    for iteration in count(1):
        yield iteration
        for ant in range(ants):
            candidates = [
                (printed_15(first, sizes[0]), printed_15(second, sizes[1])) for first, second in qubits[ant].T.tolist()
            ]
            distance, change_before = min(evaluate(i, j) for i, j in candidates), change[ant]
            change[ant], f[ant] = distance - f[ant], distance
            pheromone[ant] += printed_19(change[ant], settings.alpha)
            heuristic[ant] += printed_19(change[ant] - change_before, settings.beta)
        best = int(np.argmin(f))
        pheromone *= 1 - settings.evaporation  # (20)
        pheromone[best] += settings.evaporation * f[best]
        chance = printed_16(pheromone, heuristic, settings.alpha, settings.beta)
        if not (np.isfinite(chance).all() and (chance >= 0).all()):
            return
        followed = np.searchsorted(np.cumsum(chance), stream.random(ants)).clip(max=ants - 1)
        # the lookup rule of the double-chain papers: minus the sign of the determinant
        ahead, behind = qubits[followed], qubits
        sign = -np.sign(ahead[..., 0] * behind[..., 1] - ahead[..., 1] * behind[..., 0])
        qubits = printed_17(-sign * settings.turn * stream.random((ants, 2)), qubits)
        mutated = stream.random((ants, 2)) < settings.mutation
        qubits[mutated] = qubits[mutated][..., ::-1]  # (18): the two amplitudes change places
