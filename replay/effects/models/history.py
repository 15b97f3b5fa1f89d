"""What a ledger is told, and what it tells: processes, heat, the rows of each vessel, and what flows carried."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cdcore.numerics import FloatArray, IntArray


@dataclass(frozen=True)
class Process:
    """An equation in the ledger's own columns that no constant brings to equilibrium; what cancels is left out."""

    text: str
    changes: Mapping[str, float]  # column -> mol made by one mol of reaction, negative where it is used up
    rate: float | None = None  # first-order, 1/s; ``None``: at once
    joule: float = float("nan")  # enthalpy of one mol of reaction; NaN: not known

    def same(self, other: "Process") -> bool:
        """Whether it does the same, whatever it is called."""
        return (self.changes, self.rate) == (other.changes, other.rate)


@dataclass(frozen=True, eq=False)
class History:
    """One vessel, a row wherever it changed, and at the first and last time.

    Parameters
    ----------
    times, frames, volume_ml : (n,).
    amounts : (n, columns) mol, of heat J.
    extents : (n, processes) mol of reaction so far.
    pending : (n, processes) mol of reaction still to come of a slow process if nothing is added.
    added_ml : (n, vessels) millilitres that ever came from each.
    """

    times: FloatArray
    frames: IntArray
    volume_ml: FloatArray
    amounts: FloatArray
    extents: FloatArray
    pending: FloatArray
    added_ml: FloatArray

    def rows(self, times: FloatArray) -> IntArray:
        """The row (n,) that holds at each time."""
        return np.maximum(0, np.searchsorted(self.times, times, side="right") - 1)


@dataclass(frozen=True, eq=False)
class Warmth:
    """How liquids keep, lose and gain heat; energies are above that of the room."""

    per_ml: float  # J/(mL K) of the liquids
    glass: Mapping[str, float]  # vessel -> J/K of the vessel itself, its calorimeter constant
    excess: Mapping[str, float]  # vessel -> kelvin above the room at first
    loss: float  # W/K
    most: float  # kelvin above the room at which it boils
    reacting: bool  # whether equilibria and processes give heat
    solute: str = ""  # column of an acid whose dilution gives heat: a n / (n + b) J per mol of it in n mol of water
    water: str = ""
    a: float = 0.0
    b: float = 1.0
    followed: bool = True  # whether anybody asks


UNFOLLOWED = Warmth(0.0, {}, {}, 0.0, np.inf, reacting=False, followed=False)
"""Where nobody asks how warm anything is."""
