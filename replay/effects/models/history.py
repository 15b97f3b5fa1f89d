"""What a ledger is told, and what it tells: processes, the rows of each vessel, and what flows carried."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray, IntArray


@dataclass(frozen=True)
class Process:
    """An equation in the ledger's own columns; what cancels is left out."""

    text: str
    changes: Mapping[str, float]  # column -> mol made by one mol of reaction, negative where it is used up
    rate: float | None = None  # first-order, 1/s; ``None``: at once
    bound: str = ""  # anion that keeps all protons but the last: carbonate, of which only H2CO3 gives gas
    product: float | None = None  # solubility product: it goes both ways, and makes its one solid


NEUTRALISATION: Final = Process("H+ + OH- -> H2O", {"H+": -1.0, "OH-": -1.0, "H2O": 1.0})


@dataclass(frozen=True, eq=False)
class History:
    """One vessel, a row wherever it changed, and at the first and last time.

    Parameters
    ----------
    times, frames, volume_ml : (n,).
    amounts : (n, columns) mol.
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
class Load:
    """A part of a flow, what it carried, and what the target was like just before and just after."""

    # frame, begin, time: the last of its frames, and when it began and was over
    frame: int
    begin: float
    time: float
    source: str
    target: str
    volume_ml: float
    before_ml: float
    # carried, before: (columns,) mol
    carried: FloatArray
    before: FloatArray
    reacted: FloatArray  # (processes,) mol of reaction in the target since the part before
