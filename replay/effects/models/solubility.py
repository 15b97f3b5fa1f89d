"""How much of a salt falls out: the one extent at which the ion product equals the solubility product."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

HALVINGS = 200
"""Of the logarithm of what stays dissolved, between 1e-300 and all: more than doubles tell apart."""

LEAST = 1e-300


def amount_fallen(amounts: Mapping[str, Array], exponents: Mapping[str, float], litres: Array, product: float) -> Array:
    """Mol (n,) of solid from mol (n,) of each ion brought into ``litres`` (n,).

    ``exponents``: ion -> how often it is in one formula of the solid; same names as ``amounts``.
    ``product``: solubility product in mol/L to the sum of the exponents, above 0.
    """
    ions = list(exponents)
    powers = np.array([exponents[ion] for ion in ions])[:, None]
    there = np.stack([np.maximum(0.0, amounts[ion]) for ion in ions]) / powers
    least = there.min(axis=0)
    excess = there - least
    volume = np.where(litres > 0.0, litres, np.inf)
    # Searched for is what stays of the scarcest ion, on a logarithmic scale: all but a billionth of it falls out, and
    # the small rest, found as a difference, would have no digits.
    low, high = np.full(len(litres), np.log(LEAST)), np.log(np.maximum(least, LEAST))
    goal = np.log(product)
    dissolved = _log_product(high, excess, powers, volume) <= goal
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        over = _log_product(middle, excess, powers, volume) > goal
        low, high = np.where(over, low, middle), np.where(over, middle, high)
    fallen = least - np.exp(0.5 * (low + high))
    return np.asarray(np.where(dissolved | (least <= LEAST) | (litres <= 0.0), 0.0, np.maximum(0.0, fallen)))


def _log_product(log_left: Array, excess: Array, powers: Array, volume: Array) -> Array:
    left = powers * (excess + np.exp(log_left))
    with np.errstate(divide="ignore"):
        return np.asarray((powers * (np.log(left) - np.log(volume))).sum(axis=0))
