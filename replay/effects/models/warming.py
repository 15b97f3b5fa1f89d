"""Temperatures in closed form from row to row: heat in at a steady power, heat out in proportion to the excess."""

import math

import numpy as np

from cdcore.numerics import FloatArray


def cooled(celsius: float, seconds: float, *, power_w: float, capacity: float, loss: float, ambient: float) -> float:
    """Temperature after some seconds of m c dT/dt = P - k (T - Ta).

    ``capacity``: m c in J/K, above 0; ``loss`` k in W/K, at least 0: without loss it rises evenly.
    """
    exponent = loss * seconds / capacity
    # (1 - exp(-x)) / x by expm1, which is 1 at 0: no loss and short steps cost no digits.
    share = -math.expm1(-exponent) / exponent if exponent > 0.0 else 1.0
    return celsius + (power_w - loss * (celsius - ambient)) * seconds / capacity * share


def warmed(times: FloatArray, power_w: FloatArray, *, capacity: float, loss: float, ambient: float) -> FloatArray:
    """Temperature (n,) at each time, from ambient at the first; power (n,) holds from its time to the next."""
    found = np.full(len(times), ambient)
    for row in range(1, len(times)):
        step = float(times[row] - times[row - 1])
        found[row] = cooled(
            float(found[row - 1]), step, power_w=float(power_w[row - 1]), capacity=capacity, loss=loss, ambient=ambient
        )
    return found


def heat_given_off(acid_mol: float, water_mol: float, heat_j_mol: float, half: float) -> float:
    """Joule that ``acid_mol`` of an acid have given off in ``water_mol``: per mol Q = a n / (n + b), n water per acid.

    Written so that neither without acid nor without water anything is divided by zero.
    """
    parts = water_mol + half * acid_mol
    return heat_j_mol * acid_mol * water_mol / parts if parts > 0.0 else 0.0
