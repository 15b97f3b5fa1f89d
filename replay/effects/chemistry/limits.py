"""Mol of an equation without a constant that can still run, and what ends it: a reagent, acid, base, or saturation."""

from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray
from replay.effects.chemistry.components import PROTON, WATER
from replay.effects.chemistry.equilibrium_extent import EquilibriumExtents
from replay.effects.chemistry.processes import Process
from replay.effects.chemistry.salts import WATER_KG, settled_solid
from replay.effects.chemistry.saturation import Saturation
from replay.effects.chemistry.solver import Solver

NEUTRAL_PH: Final = 7.0
"""An equation without a constant uses up protons down to this pH: those that weaker acids hold there stay."""

BASIC_PH: Final = 13.0
"""Where it uses up hydroxide, that which metal ions hold at this pH is used already."""


class Cause(StrEnum):
    """An end of a process other than that a reagent is used up."""

    ACID = "acid"
    HYDROXIDE = "hydroxide"
    SATURATION = "saturation"
    CATALYST = "catalyst"


class Limits:
    """Limits of the processes of a ledger.

    Parameters
    ----------
    processes, changes : (p, columns) what a mol of each makes.
    column : name of a column of the ledger -> its place.
    solver : PHREEQC, which knows what holds protons; ``None``: nothing does.
    slow_solids : PHREEQC with the solids that a process dissolves at its rate; ``None``: there are none.
    room_c : temperature where no other is given.
    """

    def __init__(
        self,
        processes: Sequence[Process],
        changes: FloatArray,
        column: Mapping[str, int],
        solver: Solver | None,
        slow_solids: Solver | None,
        room_c: float,
    ) -> None:
        self._processes, self.changes, self._column, self._room_c = processes, changes, column, room_c
        self._proton, self._water = column[PROTON], column[WATER]
        self._saturation = None if slow_solids is None else Saturation(slow_solids, column)
        self._holds_acid = _bound_protons(solver, column, NEUTRAL_PH, hydroxides=False)
        self._holds_base = _bound_protons(solver, column, BASIC_PH, hydroxides=True)
        self._kept_protons = [self._protons_kept(process) for process in processes]
        self._equilibria = EquilibriumExtents(processes, changes, column, solver, self._holds_acid)

    def extent(self, row: int, amounts: FloatArray, celsius: FloatArray | None = None) -> FloatArray:
        """Mol (...) of a process until it is at equilibrium, or the first of what it uses is used up; water never is.

        Of rows (..., columns); below 0 where it runs back.
        """
        most_extent = self.extent_to_the_end(row, amounts, celsius)
        if not self._equilibria.known(row):
            return most_extent
        rows = np.atleast_2d(amounts)
        extents = self._equilibria.extent(row, rows, np.atleast_1d(most_extent), self._celsius(rows, celsius))
        return extents.reshape(amounts.shape[:-1])

    def extent_to_the_end(self, row: int, amounts: FloatArray, celsius: FloatArray | None = None) -> FloatArray:
        """Mol (...) of a process until the first of what it uses is used up, of rows (..., columns)."""
        process = self._processes[row]
        limits = self.by_cause(row, amounts, celsius)
        dissolved_gas = process.gas_solubility * WATER_KG * amounts[..., self._water]
        return np.maximum(0.0, np.min(list(limits.values()), axis=0) - dissolved_gas)

    def has_equilibrium(self, row: int) -> bool:
        """Whether a process ends at an equilibrium that is computed."""
        return self._equilibria.known(row)

    def by_cause(
        self, row: int, amounts: FloatArray, celsius: FloatArray | None = None
    ) -> dict[str | Cause, FloatArray]:
        """Column of a reagent, or another cause -> mol (...) of a process at which it ends by that."""
        process, changes = self._processes[row], self.changes[row]
        limit_of_cause: dict[str | Cause, FloatArray] = {
            name: amounts[..., index] / -changes[index]
            for name, index in self._column.items()
            if changes[index] < 0.0 and index not in (self._proton, self._water)
        }
        # A product may hold the acid that was used: SO2 stands as hydrogensulfite at the pH at which no acid is free.
        holds_acid = self._kept_protons[row]
        used_acid = float(changes @ holds_acid - changes[self._proton])
        if process.acid > 0.0 and used_acid > 0.0:
            limit_of_cause[Cause.ACID] = (amounts[..., self._proton] - amounts @ holds_acid) / used_acid
        if process.acid < 0.0:
            limit_of_cause[Cause.HYDROXIDE] = (amounts @ self._holds_base - amounts[..., self._proton]) / -process.acid
        if process.salt is not None:
            limit_of_cause[Cause.SATURATION] = self._salt_room(process, amounts, celsius)
        for catalyst in process.catalysts:
            limit_of_cause[Cause.CATALYST] = np.minimum(
                limit_of_cause.get(Cause.CATALYST, np.array(np.inf)),
                self._catalyst_limit(self._column[catalyst], amounts),
            )
        if process.dissolving_solid:
            dissolving_room = (
                self._slow_room(process.dissolving_solid, amounts, celsius)
                / -changes[self._column[process.dissolving_solid]]
            )
            # Where PHREEQC has no answer the acid limits it.
            has_answer = ~np.isnan(dissolving_room)
            limit_of_cause = {cause: np.where(has_answer, np.inf, limit) for cause, limit in limit_of_cause.items()}
            limit_of_cause[Cause.SATURATION] = np.where(has_answer, dissolving_room, np.inf)
        return limit_of_cause

    def _protons_kept(self, process: Process) -> FloatArray:
        """Protons (columns,) that no acid gives to a process: an anion that leaves as a gas keeps its last but one."""
        bound_protons = self._holds_acid.copy()
        for column, many in process.changes.items() if process.gas_solubility else ():
            if many < 0.0 and column not in (PROTON, WATER):
                bound_protons[self._column[column]] = max(0.0, process.changes.get(PROTON, 0.0) / many - 1.0)
        return bound_protons

    def _salt_room(self, process: Process, amounts: FloatArray, celsius: FloatArray | None) -> FloatArray:
        """Mol (...) of a salt that dissolve until its solution is saturated."""
        assert process.salt is not None
        rows = np.atleast_2d(amounts)
        solid_mol = rows[:, self._column[process.salt.column]]
        dissolved_rows = rows.copy()
        for name, many in process.salt.changes.items():
            dissolved_rows[:, self._column[name]] -= solid_mol * many
        remaining_room = solid_mol - settled_solid(
            process.salt, self._column, dissolved_rows, self._celsius(rows, celsius)
        )
        return remaining_room.reshape(amounts.shape[:-1])

    def _slow_room(self, solid: str, amounts: FloatArray, celsius: FloatArray | None) -> FloatArray:
        """Mol (...) of a solid of PHREEQC's that dissolve until its solution is saturated; NaN: it has no answer."""
        assert self._saturation is not None
        rows = np.atleast_2d(amounts)
        remaining_room = self._saturation.dissolves(solid, rows, self._celsius(rows, celsius))
        return remaining_room.reshape(amounts.shape[:-1])

    def _catalyst_limit(self, column: int, amounts: FloatArray) -> FloatArray:
        """No limit (...) where a catalyst is there, else 0; protons that weak acids hold are none."""
        amount = amounts[..., column]
        if column == self._proton:
            amount = amount - amounts @ self._holds_acid
        return np.where(amount > 0.0, np.inf, 0.0)

    def _celsius(self, rows: FloatArray, celsius: FloatArray | None) -> FloatArray:
        return np.full(len(rows), self._room_c) if celsius is None else celsius


def _bound_protons(solver: Solver | None, column: Mapping[str, int], ph: float, *, hydroxides: bool) -> FloatArray:
    """Protons (columns,) that each column holds at a pH; ``hydroxides``: with those that it takes from water."""
    bound_protons = np.zeros(len(column))
    if solver is not None:
        for component, protons in solver.mixture.protons_at(ph, hydroxides=hydroxides).items():
            bound_protons[column[component]] = protons
    return bound_protons
