"""Equations (15) to (20) as the paper prints them: after a few iterations their values are no longer probabilities.

Kept to show that they break, and how. Fitness is the distance to be driven down, which (19) then rewards for growing;
powers of differences are added to pheromone without a clamp; the gate of (17) with ``-cos`` shrinks its vector.
"""

from collections.abc import Callable

import numpy as np

from cdcore.numerics import FloatArray
from cdcore.search.search_settings import SearchSettings


def printed_gate(theta: FloatArray, qubits: FloatArray) -> FloatArray:
    """(17) as printed on qubits (..., 2) by angles (...): its last entry is ``-cos``, so that it is no rotation."""
    cos, sin = np.cos(theta), np.sin(theta)
    a, b = qubits[..., 0], qubits[..., 1]
    return np.stack([cos * a - sin * b, sin * a - cos * b], axis=-1)


def signed_power(change: float, exponent: float) -> float:
    """``sgn(x) |x|^exponent`` of (19)."""
    return float(np.sign(change) * np.abs(change) ** exponent)


def probabilities(pheromone: FloatArray, heuristic: FloatArray, alpha: float, beta: float) -> FloatArray:
    """(16) as a plain ratio of powers; what it gives may be negative or no number."""
    with np.errstate(all="ignore"):
        weight = pheromone**alpha * heuristic**beta
        return weight / weight.sum()


def search_as_printed(
    evaluate: Callable[[int, int], float],
    is_over: Callable[[], bool],
    sizes: tuple[int, int],
    settings: SearchSettings,
    stream: np.random.Generator,
) -> tuple[int, bool]:
    """Search until a hit, the end of the budget, or probabilities that are none; iterations, and whether they broke.

    ``evaluate`` gives the distance of a pair of features by their places; ``is_over``: a pair was hit or the budget is
    spent; ``sizes``: features of both bodies. Of the settings ants, turn, mutation, alpha, beta and evaporation count.
    """
    ants = settings.ants
    angle = 2 * np.pi * stream.random((ants, 2))
    qubits = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    pheromone, heuristic = np.ones(ants), np.ones(ants)
    f, change = np.zeros(ants), np.zeros(ants)
    iterations = 0
    while not is_over():
        iterations += 1
        for ant in range(ants):
            distance, change_before = _closest(evaluate, is_over, sizes, qubits[ant]), change[ant]
            change[ant], f[ant] = distance - f[ant], distance
            pheromone[ant] += signed_power(change[ant], settings.alpha)
            heuristic[ant] += signed_power(change[ant] - change_before, settings.beta)
            if is_over():
                return iterations, False
        best = int(np.argmin(f))
        pheromone *= 1 - settings.evaporation
        pheromone[best] += settings.evaporation * f[best]
        chance = probabilities(pheromone, heuristic, settings.alpha, settings.beta)
        if not (np.isfinite(chance).all() and (chance >= 0).all()):
            return iterations, True
        followed = np.searchsorted(np.cumsum(chance), stream.random(ants)).clip(max=ants - 1)
        # the lookup rule of the double-chain papers: minus the sign of the determinant
        ahead, behind = qubits[followed], qubits
        sign = -np.sign(ahead[..., 0] * behind[..., 1] - ahead[..., 1] * behind[..., 0])
        qubits = printed_gate(-sign * settings.turn * stream.random((ants, 2)), qubits)
        mutated = stream.random((ants, 2)) < settings.mutation
        qubits[mutated] = qubits[mutated][..., ::-1]  # (18): the two amplitudes change places
    return iterations, False


def _closest(
    evaluate: Callable[[int, int], float], is_over: Callable[[], bool], sizes: tuple[int, int], qubits: FloatArray
) -> float:
    """The closer of the two candidates of an ant, decoded by the linear map of amplitudes."""
    closest = np.inf
    for chain in range(2):
        # Built-in minimum and maximum: of two numbers, numpy's take ten times as long.
        share = [min(max(0.5 + 0.5 * amplitude, 0.0), 1.0) for amplitude in qubits[:, chain].tolist()]
        i, j = (min(int(share[k] * sizes[k]), sizes[k] - 1) for k in range(2))
        closest = min(closest, evaluate(i, j))
        if is_over():
            break
    return closest
