"""Temperatures in closed form from row to row: heat in at a steady power, heat out in proportion to the excess."""

from collections.abc import Mapping
from itertools import pairwise
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray
from replay.effects.chemistry.formulas import atoms

WATER_BOILS_C: Final = 100.0

WATER_J_PER_ML_K: Final = 4.18
"""Heat capacity of liquids where the scene does not tell it. Source: CRC Handbook, water at 20 degC."""

KOPP_J_PER_MOL_K: Final = {"H": 9.6, "B": 11.3, "C": 7.5, "O": 16.7, "F": 20.9, "Si": 15.9, "P": 22.6, "S": 22.6}
"""What an atom adds to the heat capacity of a solid. Source: H. Kopp, Phil. Trans. R. Soc. 155, 1865."""

HALF_HEAT_WATER_MOL: Final = 1.8
"""mol of water that give half of the heat of a mol of sulfuric acid in much water."""

HEAVY_ATOM_J_PER_MOL_K: Final = 26.0
"""The same of any other atom."""


def solid_j_per_mol_k(formula: str) -> float:
    """Returns the heat capacity of a mol of a solid, by Kopp's rule: of salts within a tenth or so."""
    return sum(many * KOPP_J_PER_MOL_K.get(element, HEAVY_ATOM_J_PER_MOL_K) for element, many in atoms(formula).items())


def temperature_after_seconds(
    celsius: FloatArray | float,
    seconds: FloatArray | float,
    *,
    power_w: FloatArray | float = 0.0,
    capacity: FloatArray | float,
    loss: float,
    ambient: float = 0.0,
) -> FloatArray:
    """Temperature after some seconds of m c dT/dt = P - k (T - Ta); all may be arrays.

    Without power it is Newton's law of cooling, which holds for an excess in J as for one in K.

    ``capacity``: m c in J/K, above 0; ``loss`` k in W/K, at least 0: without loss it rises evenly.
    """
    decay_exponent = np.asarray(loss * np.asarray(seconds) / capacity, dtype=np.float64)
    # (1 - exp(-x)) / x by expm1, which is 1 at 0: no loss and short steps cost no digits.
    fraction = np.where(
        decay_exponent > 0.0, -np.expm1(-decay_exponent) / np.where(decay_exponent > 0.0, decay_exponent, 1.0), 1.0
    )
    rate_k_per_s = (power_w - loss * (np.asarray(celsius) - ambient)) / capacity
    return np.asarray(celsius + rate_k_per_s * seconds * fraction)


def heating_curve(
    times: FloatArray, power_w: FloatArray, *, capacity: float, loss: float, ambient: float, boils: float
) -> FloatArray:
    """Temperature (n,) at each time, from ambient at the first; power (n,) holds from its time to the next.

    At ``boils`` it stays: what is heated further boils off.
    """
    celsius = np.full(len(times), ambient)
    power_changes = [0, *(np.flatnonzero(np.diff(power_w)) + 1).tolist(), len(times)]
    for first, last in pairwise(power_changes):
        segment = slice(first + 1, last + 1)
        seconds_since_change = times[segment] - times[first]
        celsius[segment] = np.minimum(
            boils,
            temperature_after_seconds(
                celsius[first],
                seconds_since_change,
                power_w=float(power_w[first]),
                capacity=capacity,
                loss=loss,
                ambient=ambient,
            ),
        )
    return celsius


def heat_given_off(acid_mol: FloatArray, water_mol: FloatArray, heats: Mapping[float, float]) -> FloatArray:
    """Joule (n,) that an acid has given off to water; ``heats``: mol of water for one of acid -> J/mol.

    Between them the heat follows n / (n + 1.8), with n mol of water, and a factor that changes slowly.
    Source: J. Thomsen, Thermochemische Untersuchungen, vol. 3, 1883, for the form.
    """
    ratios = np.array(list(heats))
    heat_factors = np.array(list(heats.values())) * (ratios + HALF_HEAT_WATER_MOL) / ratios
    ratio = np.minimum(ratios[-1], water_mol / np.maximum(acid_mol, 1e-300))
    factor = np.interp(np.log(np.maximum(ratio, 1e-300)), np.log(ratios), heat_factors)
    return np.asarray(acid_mol * factor * ratio / (ratio + HALF_HEAT_WATER_MOL))
