"""Equations (15) to (20) of the paper as corrected, one function each, in the order of the paper.

An ant is two angles, one a body; where the paper prints two amplitudes, (cos t, sin t), the angle t is kept, so that
they stay a unit vector whatever the number of steps. As printed they break: ``printed`` shows how.
"""

import numpy as np

from cdcore.kernels.compiling import always_inlined, hot_kernel, never_inlined

PI = 3.141592653589793
TWO_PI = 2.0 * PI


@hot_kernel
def equation_15(angle: float, chain: int, features: int) -> int:
    """Index of the feature that an angle stands for, by its cosine (chain 0) or its sine (chain 1).

    ``arccos(cos t) / pi`` is the distance of t to the nearest multiple of 2 pi, over pi; so written it needs no cosine.
    Differs: printed linear in the amplitude, which draws the end faces twenty times too often.
    """
    never_inlined()
    return index_of(abs(wrapped_angle(angle - 0.5 * PI * chain)) / PI, features)


@hot_kernel
def equation_16(pheromone: float, heuristic: float, alpha: float, beta: float) -> float:
    """Logarithm of the weight ``tau^alpha eta^beta`` with which an ant is followed: powers of any size stay finite."""
    always_inlined()
    weight: float = alpha * np.log(pheromone)
    weight += beta * np.log(heuristic)
    return weight


@hot_kernel
def equation_17(angle: float, step: float) -> float:
    """The gate: a rotation of the amplitudes by a step. Differs: printed with ``-cos``, which is none."""
    always_inlined()
    return wrapped_angle(angle + step)


@hot_kernel
def equation_18(angle: float) -> float:
    """The NOT gate: the two amplitudes change places."""
    always_inlined()
    return 0.5 * PI - angle


@hot_kernel
def equation_19(pheromone: float, change: float, exponent: float) -> float:
    """Pheromone after the change of an ant's fitness: more where it grew, less where it fell.

    Differs: printed with the distance as fitness, which rewards an ant for moving away.
    """
    always_inlined()
    size = abs(change) if exponent == 1.0 else abs(change) ** exponent
    return pheromone + (size if change > 0.0 else -size)


@hot_kernel
def equation_20(pheromone: float, evaporation: float, deposit: float) -> float:
    """Pheromone after evaporation; ``deposit`` is the fitness of the best ant, and 0 of the others."""
    always_inlined()
    return (1.0 - evaporation) * pheromone + evaporation * deposit


@hot_kernel
def wrapped_angle(angle: float) -> float:
    """The same direction in [-pi, pi]."""
    return angle - TWO_PI * np.floor(angle / TWO_PI + 0.5)


@hot_kernel
def index_of(fraction: float, features: int) -> int:
    """The feature at a share of all from 0 to 1."""
    always_inlined()
    return max(0, min(int(fraction * features), features - 1))
