"""Amount of a solid that still dissolves where an equation with a rate dissolves it: up to PHREEQC's equilibrium."""

from collections.abc import Mapping

import numpy as np

from cdcore.numerics import FloatArray
from replay.effects.chemistry.components import WATER
from replay.effects.chemistry.mixture import SOLID
from replay.effects.chemistry.solver import Solver, has_answer


class Saturation:
    """Equilibria of rows of a ledger with the solids that dissolve slowly.

    Parameters
    ----------
    solver : PHREEQC with these solids beside all that is at equilibrium at once.
    column : name of a column of the ledger -> its place.
    """

    def __init__(self, solver: Solver, column: Mapping[str, int]) -> None:
        mixture = solver.mixture
        self._solver, self._column = solver, column
        self._solids = {
            phase.column: index for index, phase in enumerate(mixture.phases) if phase.column.endswith(SOLID)
        }
        self._components = [column[name] for name in mixture.components]

    def dissolves(self, solid: str, amounts: FloatArray, celsius: FloatArray) -> FloatArray:
        """Mol (n,) of a solid that dissolve until it is saturated, of rows (n, columns); NaN where nobody knows.

        Below 0: the solution is beyond saturation.
        """
        standing = amounts[:, self._column[solid]]
        room = np.zeros(len(amounts))
        rows = np.flatnonzero((standing > 0.0) & (amounts[:, self._column[WATER]] > 0.0))
        if not len(rows):
            return room
        present = amounts[rows]
        totals = present[:, self._components]
        uses = self._solver.mixture.uses
        for name, index in self._solids.items():
            totals = totals + present[:, self._column[name], None] * uses[index]
        equilibrium = self._solver.equilibrium(totals, present[:, self._column[WATER]], celsius[rows])
        settled = equilibrium.phases[:, self._solids[solid]]
        room[rows] = np.where(has_answer(equilibrium), standing[rows] - settled, np.nan)
        return room
