"""Solids beside their solution, all at once: what falls out, what dissolves again, one salt at the cost of another."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdcore.numerics import FloatArray

MOST_STEPS: Final = 300
"""Newton steps, each of which may take an ion down to a hundredth: 1e-300 is reached in 150."""

LEAST_BARRIER: Final = 1e-30
"""Of the barrier, as a share of what could form: where it ends, far below the rounding of any amount."""

LEAST: Final = 1e-300
GONE: Final = 1e-14
"""A solid that would bind less than this share of its scarcest ion is none: the barrier's trace."""


def dissolved_all(
    amounts: FloatArray, litres: FloatArray, uses: FloatArray, log_product: FloatArray
) -> NDArray[np.bool_]:
    """(n,) whether no solid can be: every ion product is at most its solubility product."""
    # The least float stands for none: its logarithm times 0, for a solid without that ion, is 0.
    logs = np.log(np.maximum(amounts, LEAST)) - np.log(litres)[:, None]
    return np.asarray((logs @ uses.T <= log_product).all(axis=1))


def solids_formed(
    amounts: FloatArray, litres: FloatArray, uses: FloatArray, products: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mol (n, s) of each solid at equilibrium, and mol (n, k) of each ion that stays dissolved.

    ``amounts``: (n, k) mol of each ion, dissolved and solid together.
    ``litres``: (n,) of the solution.
    ``uses``: (s, k) how many of each ion are in one formula of a solid.
    ``products``: (s,) solubility products in mol/L to the sum of the exponents, above 0.

    Gibbs energy is convex in the amounts of solids; Newton's method with a barrier at 0 finds its least value. An ion
    is followed by its own small amount, not as a difference, so that one part in 1e15 left in solution has its digits.
    Source: Boyd and Vandenberghe, Convex Optimization, 2004, sections 9.5 and 11.2.
    """
    solid, dissolved = np.zeros((len(amounts), len(products))), amounts.copy()
    log_product = np.log(products)
    wet = (litres > 0.0) & (amounts >= 0.0).all(axis=1)
    rows = np.flatnonzero(wet)
    rows = rows[~dissolved_all(amounts[rows], litres[rows], uses, log_product)]
    if len(rows):
        # A solid one of whose ions is missing cannot be; its ions are not looked at for it.
        can = ((amounts[rows][:, None, :] > 0.0) | (uses[None] == 0.0)).all(axis=2)
        for pattern in np.unique(can, axis=0):
            same = (can == pattern).all(axis=1)
            there, ions = rows[same], np.flatnonzero((uses[pattern] > 0.0).any(axis=0))
            formed, left = _newton(
                amounts[np.ix_(there, ions)], litres[there], uses[pattern][:, ions], log_product[pattern]
            )
            solid[np.ix_(there, np.flatnonzero(pattern))] = formed
            # Where most of an ion stays the difference has its digits, and keeps the sum; where little stays, ``left``.
            rest = amounts[np.ix_(there, ions)] - formed @ uses[pattern][:, ions]
            dissolved[np.ix_(there, ions)] = np.where(left > 1e-6 * amounts[np.ix_(there, ions)], rest, left)
    return solid, dissolved


def _newton(
    total: FloatArray, litres: FloatArray, uses: FloatArray, log_product: FloatArray
) -> tuple[FloatArray, FloatArray]:
    # Begin with a thousandth of what could form, shared among the solids.
    most = np.where(uses[None] > 0.0, total[:, None, :] / np.maximum(uses[None], 1e-300), np.inf).min(axis=2)
    solid = most * (1e-3 / len(log_product))
    left = np.maximum(total - solid @ uses, LEAST)
    volume = np.log(litres)[:, None]
    least = LEAST_BARRIER * most.min(axis=1)
    barrier = most.max(axis=1)
    ions, salts = total.shape[1], len(log_product)
    matrix = np.zeros((len(total), ions + salts, ions + salts))
    wanted = np.zeros((len(total), ions + salts, 1))
    for _ in range(MOST_STEPS):
        # Unknown are the changes of the ions' logarithms and of the solids in units of what could form. Not reduced to
        # the solids alone: with an ion at 1e-20 of the others that matrix would be singular to rounding.
        bound = uses.T[None] * most[:, None, :]
        size = left + bound.sum(axis=2)
        matrix[:, range(ions), range(ions)] = left / size
        matrix[:, :ions, ions:] = bound / size[:, :, None]
        matrix[:, ions:, :ions] = uses
        matrix[:, range(ions, ions + salts), range(ions, ions + salts)] = -barrier[:, None] * most / solid**2
        wanted[:, ions:, 0] = log_product - (np.log(left) - volume) @ uses.T - barrier[:, None] / solid
        weight = np.abs(matrix).max(axis=2, keepdims=True)
        found = np.linalg.solve(matrix / weight, wanted / weight)[..., 0]
        # An ion changes by its own factor: the difference of what salts give and take has no digits of a small one.
        factor, step = found[:, :ions], found[:, ions:] * most
        with np.errstate(divide="ignore"):
            room = 0.99 / np.maximum(np.max(-factor, axis=1), np.max(-step / solid, axis=1)).clip(1e-300)
        share = np.minimum(1.0, room)[:, None]
        # An ion that vanishes has no logarithm; of a solid no more can form than its scarcest ion gives.
        solid, left = solid + share * step, np.maximum(left * (1.0 + share * factor), LEAST)
        moved = np.where(solid > GONE * most, np.abs(share * step / solid), 0.0).max(axis=1) + np.abs(factor).max(
            axis=1
        )
        if (moved < 1e-9).all() and (barrier <= least).all():
            break
        barrier = np.where(share[:, 0] > 0.5, np.maximum(0.01 * barrier, least), barrier)
    return np.where(solid <= GONE * most, 0.0, np.minimum(solid, most)), left
