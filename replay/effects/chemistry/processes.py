"""Reactions that PHREEQC does not bring to equilibrium, and what became of a vessel in which they ran."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from cdcore.numerics import FloatArray, IntArray
from replay.effects.chemistry.salts import Salt


@dataclass(frozen=True)
class Process:
    """An equation in the ledger's own columns that PHREEQC does not bring to equilibrium; what cancels is left out."""

    text: str = field(compare=False)
    changes: Mapping[str, float]  # column -> mol made by one mol of reaction, negative where it is used up
    rate: float | None = None  # first-order, 1/s; ``None``: at once
    # enthalpy of one mol of reaction; NaN: not known
    joule: float = field(default=float("nan"), compare=False)
    # protons that its reagents bring; below 0 hydroxide, and it ends with it; 0: it needs neither
    acid: float = field(default=0.0, compare=False)
    # log10 of its constant between the columns at 25 degC, in mol/kg; NaN: not known, it runs to its end
    log_k: float = field(default=float("nan"), compare=False)
    is_ester: bool = field(default=False, compare=False)  # log_k is one of mol, of ester and water by acid and alcohol
    salt: Salt | None = field(default=None, compare=False)  # that it dissolves, up to its solubility
    catalysts: frozenset[str] = frozenset()  # columns without which it does not proceed
    gas_solubility: float = 0.0  # mol of reaction, by kg of water, whose gas stays dissolved
    # column of a solid that it dissolves at its rate, as far as PHREEQC's equilibrium lets it; ``""``: another process
    dissolving_solid: str = ""


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
