"""Reactions that a liquid has at once, at its temperature: equations without a rate, salts, PHREEQC's equilibrium."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray
from replay.effects.chemistry.components import PROTON, WATER
from replay.effects.chemistry.heats import Heats
from replay.effects.chemistry.ledger_columns import ENTHALPY_COLUMN, HEAT_COLUMN, changes_table
from replay.effects.chemistry.limits import Limits
from replay.effects.chemistry.mixture import GAS
from replay.effects.chemistry.processes import Process
from replay.effects.chemistry.salts import Salt, settled_solid
from replay.effects.chemistry.solver import Solver, has_answer

MOST_ROUNDS: Final = 60
SOLID_TOLERANCE: Final = 1e-6
"""Rounds of salts and gases, and the share of a salt by which its solid may still change in the last: a gas that leaves
makes room for more of a salt, as bicarbonate in acid."""

SCARCE_FRACTION: Final = 1e-6
"""Where less than this share of a part stays dissolved the equilibrium's own figure is taken, not a difference."""

DIFFERENCE_ROUNDING: Final = 1e-14
"""Of a difference, as a share of what it is taken from: what differs by more is no rounding."""

GAS_ROUNDING: Final = 1e-9
"""A gas that left by less than this share of the row before is the same: rounding of the equilibrium."""


class QuickReactions:
    """Brings rows of a ledger to the state in which nothing more happens at once.

    Parameters
    ----------
    processes : equations without a constant; those without a rate happen at once.
    salts : solids that dissolve up to their solubility.
    solver : what is at equilibrium by PHREEQC; ``None``: nothing is.
    column : name of a column of the ledger -> its place.
    limits : how far each process goes.
    heats : enthalpies of what is dissolved, of solids and of gases.
    follows_heat : whether what reacts warms or cools its liquid.
    """

    def __init__(
        self,
        processes: Sequence[Process],
        salts: Sequence[Salt],
        solver: Solver | None,
        column: Mapping[str, int],
        limits: Limits,
        heats: Heats,
        *,
        follows_heat: bool,
    ) -> None:
        self.processes, self.salts, self.solver, self.column = processes, salts, solver, column
        self.limits, self.heats, self.follows_heat = limits, heats, follows_heat
        self.proton, self.water = column[PROTON], column[WATER]
        self.changes = limits.changes
        self.formation = changes_table(() if solver is None else solver.mixture.changes, column)
        self.salt_changes = changes_table([salt.changes for salt in salts], column)
        self.salt_columns = np.array([column[salt.column] for salt in salts], dtype=np.int64)
        dissolving_columns = {process.salt.column for process in processes if process.salt is not None}
        self.dissolves_slowly = np.array([salt.column in dissolving_columns for salt in salts], dtype=np.bool_)
        components = () if solver is None else solver.mixture.components
        phases = () if solver is None else tuple(phase.column for phase in solver.mixture.phases)
        self.components = np.array([column[name] for name in components], dtype=np.int64)
        self.phases = np.array([column[name] for name in phases], dtype=np.int64)
        self.gas = np.array([name.endswith(GAS) for name in phases], dtype=np.bool_)
        self.has_phases_or_salts = bool(len(phases) or len(salts))
        self.quick_processes = [row for row, process in enumerate(processes) if process.rate is None]
        # What one equation takes up lets another that had come to its equilibrium go on.
        has_equilibria = any(limits.has_equilibrium(row) for row in self.quick_processes)
        has_several_processes = len(self.quick_processes) > 1
        self._most_process_rounds = (
            MOST_ROUNDS if has_equilibria and has_several_processes else len(self.quick_processes)
        )

    def react(self, amounts_before: FloatArray, celsius: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Rows (n, columns) as they are when all has reacted at a temperature (n,), and extents (n, processes)."""
        amounts = amounts_before.copy()
        enthalpy = self.heats.enthalpy(amounts)
        # What is solid is thought dissolved, so that the outcome hangs on what there is and not on how it came.
        standing_solids = amounts[:, self.phases] * ~self.gas
        amounts -= standing_solids @ self.formation
        rested_amounts = amounts.copy()
        self._dissolve_for_equations(amounts)
        extents_done = self.run_processes(amounts, celsius)
        # Where nothing reacted, ions beside much solid keep their digits.
        has_no_reaction = ~extents_done.any(axis=1)
        amounts[has_no_reaction] = rested_amounts[has_no_reaction]
        self._crystallise(amounts, celsius)
        if self.solver is not None and (len(self.phases) or self.follows_heat):
            self._settle_beside_salts(amounts, standing_solids, celsius)
        if self.solver is None and self.follows_heat:
            amounts[:, self.column[ENTHALPY_COLUMN]] = self.heats.dissolved_enthalpy(
                amounts, np.zeros((len(amounts), 0))
            )
        heat_given = enthalpy - self.heats.enthalpy(amounts)
        for row in self.quick_processes:
            heat_given -= extents_done[:, row] * self.process_joule(row)
        amounts[:, self.column[HEAT_COLUMN]] += heat_given
        return amounts, extents_done

    def run_processes(self, amounts: FloatArray, celsius: FloatArray | None = None) -> FloatArray:
        """Bring equations without a rate to their end in rows (n, columns), in place: extents (n, processes)."""
        extents_done = np.zeros((len(amounts), len(self.processes)))
        for round_number in range(self._most_process_rounds):
            before_round = extents_done.copy()
            for row in self.quick_processes:
                extent = self.limits.extent(row, amounts, celsius)
                self.add_changes(amounts, extent[:, None] * self.changes[row])
                extents_done[:, row] += extent
            changed = np.abs(extents_done - before_round).max(initial=0.0)
            if (
                round_number + 1 >= len(self.quick_processes)
                and changed <= SOLID_TOLERANCE * np.abs(extents_done).max()
            ):
                break
        return extents_done

    def _dissolve_for_equations(self, amounts: FloatArray) -> None:
        """Dissolve salts, in place, whose ions an equation at once uses: as it uses them up more of the solid follows.

        One that an equation with a rate dissolves does so by itself.
        """
        for index, changes, slow in zip(self.salt_columns, self.salt_changes, self.dissolves_slowly, strict=True):
            ions = np.flatnonzero(changes < 0.0)
            ions = ions[(ions != self.proton) & (ions != self.water)]
            if not slow and (self.changes[np.ix_(self.quick_processes, ions)] < 0.0).any():
                self.add_changes(amounts, -amounts[:, [index]] * changes)

    def _crystallise(self, amounts: FloatArray, celsius: FloatArray) -> None:
        """Bring salts to saturation, in place: what is beyond is solid, what is solid dissolves if there is room."""
        for salt, index, changes, slow in zip(
            self.salts, self.salt_columns, self.salt_changes, self.dissolves_slowly, strict=True
        ):
            standing_solids = amounts[:, index]
            settled_amount = settled_solid(salt, self.column, amounts - standing_solids[:, None] * changes, celsius)
            if slow:
                # Its own equation dissolves it.
                settled_amount = np.maximum(settled_amount, standing_solids)
            # Only the difference is moved: beside a mol of solid the ions of a micromol would lose their digits.
            self.add_changes(amounts, (settled_amount - standing_solids)[:, None] * changes)

    def _settle_beside_salts(self, amounts: FloatArray, standing_solids: FloatArray, celsius: FloatArray) -> None:
        """Bring rows to PHREEQC's equilibrium, in place, and salts to saturation in what gases leave of it."""
        dissolved = amounts.copy()
        self._settle_equilibrium(amounts, standing_solids, celsius)
        for _ in range(MOST_ROUNDS if len(self.salts) and self.gas.any() else 0):
            total_amounts = amounts - (amounts[:, self.phases] * ~self.gas) @ self.formation
            solids = total_amounts[:, self.salt_columns].copy()
            self._crystallise(total_amounts, celsius)
            change = total_amounts[:, self.salt_columns] - solids
            if np.abs(change).max(initial=0.0) <= SOLID_TOLERANCE * np.abs(solids).max(initial=0.0):
                return
            dissolved += change @ self.salt_changes
            amounts[...] = dissolved
            self._settle_equilibrium(amounts, standing_solids, celsius)

    def _settle_equilibrium(self, rows: FloatArray, standing_solids: FloatArray, celsius: FloatArray) -> None:
        """Bring rows to PHREEQC's equilibrium, in place; where it has no answer, solids stay as they are."""
        assert self.solver is not None
        mixture = self.solver.mixture
        totals = rows[:, self.components].copy()
        water = rows[:, self.water].copy()
        equilibrium = self.solver.equilibrium(totals, water, celsius)
        formed = equilibrium.phases.copy()
        species = equilibrium.species.copy()
        has_known_answer = has_answer(equilibrium)
        gone_mol = np.zeros(len(self.phases))
        first = 0
        while self.gas.any():
            gas = formed[:, self.gas]
            most = np.maximum.accumulate(gas[first:], axis=0)
            rows_with_less_gas = np.flatnonzero((gas[first:] < most * (1.0 - GAS_ROUNDING)).any(axis=1))
            if not len(rows_with_less_gas):
                break
            # From here on what left before is gone, and the rest is at equilibrium without it.
            first += int(rows_with_less_gas[0])
            gone_mol[self.gas] = formed[first - 1, self.gas]
            later_rows = slice(first, None)
            remaining_amounts = rows[later_rows] + gone_mol @ self.formation
            second_equilibrium = self.solver.equilibrium(
                remaining_amounts[:, self.components], water[later_rows], celsius[later_rows]
            )
            species[later_rows], formed[later_rows] = second_equilibrium.species, second_equilibrium.phases + gone_mol
            has_known_answer[later_rows] = has_answer(second_equilibrium)
        formed[~has_known_answer] = standing_solids[~has_known_answer]
        dissolved = species @ mixture.powers
        rows += formed @ self.formation
        remaining_amounts = rows[:, self.components]
        is_scarce = (
            (dissolved < SCARCE_FRACTION * totals)
            & (np.abs(dissolved - remaining_amounts) <= DIFFERENCE_ROUNDING * totals)
            & has_known_answer[:, None]
        )
        # Protons are a difference of what gives and what takes them.
        is_scarce[:, :1] = False
        rows[:, self.components] = np.where(is_scarce, dissolved, remaining_amounts)
        if self.follows_heat:
            rows[:, self.column[ENTHALPY_COLUMN]] = self.heats.dissolved_enthalpy(rows, species)

    def add_changes(self, amounts: FloatArray, moved: FloatArray) -> None:
        """Add what was made to amounts, in place; what limits ends at exactly nothing where all of it is used."""
        summed_amounts = amounts + moved
        used_up = (moved < 0.0) & (summed_amounts <= 4e-16 * amounts)
        used_up[..., self.proton] = False
        amounts[...] = np.where(used_up, 0.0, summed_amounts)

    def process_joule(self, row: int) -> float:
        """J that a mol of a process takes up, where heat is followed."""
        joule = self.processes[row].joule
        return joule if self.follows_heat and np.isfinite(joule) else 0.0
