"""Columns of the ledger that are no matter, and what is known of heat at first."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray

ADDED_SUFFIX: Final = " added"
"""End of the name of a column of what was added under a formula, followed for the reader and never changed."""

HEAT_COLUMN: Final = "heat above the room"
ENTHALPY_COLUMN: Final = "enthalpy of what is dissolved"
LATENT_HEAT_COLUMN: Final = "heat of steam and ice"
"""Columns of energy, J; the last above 0 of what boils, below 0 of ice: it comes back as the vessel cools or warms."""

HEAT_CAPACITY_COLUMN: Final = "heat capacity of solids and solutes"
"""Column, J/K, of what was brought as solid, whether it has dissolved since or not, and of solutes where they count."""

ENERGY_COLUMNS: Final = (HEAT_COLUMN, ENTHALPY_COLUMN, LATENT_HEAT_COLUMN, HEAT_CAPACITY_COLUMN)

WITHOUT_HEAT_C: Final = 25.0
"""Temperature at which PHREEQC is asked where no effect heat follows one: that of its constants."""


@dataclass(frozen=True, eq=False)
class Flame:
    """Heat that a flame gives a vessel: watts (n,), each from its time (n,) on; and the vessel's loss, W/K."""

    times: FloatArray
    power_w: FloatArray
    loss: float

    def power(self, times: FloatArray | float) -> FloatArray:
        """Watts (...) from times on."""
        rows = np.searchsorted(self.times, times, side="right") - 1
        return np.where(rows >= 0, self.power_w[np.maximum(0, rows)], 0.0)


@dataclass(frozen=True, eq=False)
class Warmth:
    """How liquids keep, lose and gain heat; energies are above that of the room."""

    per_ml: float | None  # J/(mL K) of the liquids as declared; ``None``: that of their water and solutes
    glass: Mapping[str, float]  # vessel -> J/K of the vessel itself, its calorimeter constant
    excess: Mapping[str, float]  # vessel -> kelvin above the room at first
    loss: float  # W/K
    most: float  # kelvin above the room at which it boils
    room: float = WITHOUT_HEAT_C  # degC
    solids: Mapping[str, float] = field(default_factory=dict)  # vessel -> J/K of the solids in it at first
    solutes: Mapping[str, float] = field(default_factory=dict)  # vessel -> J/K of what is dissolved in it at first
    solute: str = ""  # column of an acid whose dilution gives heat
    dilution: Mapping[float, float] = field(default_factory=dict)  # mol of water for one of it -> J/mol
    flames: Mapping[str, Flame] = field(default_factory=dict)  # vessel -> the flame that heats it
    declared: tuple[str, ...] = ()  # formulas whose heat of dissolving the scene declares
    followed: bool = True  # whether anybody asks


UNFOLLOWED_WARMTH = Warmth(0.0, {}, {}, 0.0, np.inf, followed=False)
"""Where nobody asks how warm anything is."""


def changes_table(rows: Sequence[Mapping[str, float]], column: Mapping[str, int]) -> FloatArray:
    """Mol of each column of the ledger that a mol of each row makes, (rows, columns)."""
    table = np.zeros((len(rows), len(column)))
    for row, changes in enumerate(rows):
        for name, moles in changes.items():
            table[row, column[name]] = moles
    return table
