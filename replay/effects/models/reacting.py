"""What a vessel becomes when what came together reacts: equations to their end, the rest to equilibrium; its heat."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray, IntArray
from replay.effects.models.equilibrium import Equilibrium, Mixture, equilibrium
from replay.effects.models.history import Process, Warmth
from replay.effects.models.speciation import GAS, PROTON, Speciation
from replay.effects.models.warming import heat_given_off

HEAT: Final = "heat above the room"
STORED: Final = "enthalpy of what is dissolved"
"""Columns of energy, J."""

NEUTRAL_PH: Final = 7.0
"""An equation without a constant uses up protons down to this pH: those that weaker acids hold there stay."""

SCARCE: Final = 1e-6
"""Where less than this share of a part stays dissolved the equilibrium's own figure is taken, not a difference."""

ROUNDING: Final = 1e-14
"""Of a difference, as a share of what it is taken from: what differs by more is no rounding."""

FEWER: Final = 1e-9
"""A gas that left by less than this share of the row before is the same: rounding of the equilibrium."""


class Reactor:
    """Processes and an equilibrium over the columns of a ledger; amounts are rows (n, columns) of it.

    ``column``: name -> place.
    """

    def __init__(
        self, column: Mapping[str, int], processes: Sequence[Process], speciation: Speciation,
        warmth: Warmth,
    ) -> None:  # fmt: skip
        self.column, self.processes, self.speciation, self.warmth = column, processes, speciation, warmth
        self.changes = self._table([process.changes for process in processes])
        self.slow = [row for row, process in enumerate(processes) if process.rate is not None]
        self.quick = [row for row, process in enumerate(processes) if process.rate is None]
        self.mixture = mixture = speciation.mixture
        self.formation = self._table(speciation.changes)
        self.parts = self._places(mixture.parts)
        self.phases = self._places(mixture.phases)
        # A gas that bubbles does not come back; one that the air holds does.
        self.leaves = np.array([name.endswith(GAS) for name in mixture.phases], dtype=np.bool_) & ~mixture.held
        self.solid = np.array([not name.endswith(GAS) for name in mixture.phases], dtype=np.bool_)
        self.bound = np.zeros(len(column))
        for part, protons in _held_at(mixture, NEUTRAL_PH).items():
            self.bound[column[part]] = protons

    def pending(self, amounts: FloatArray) -> FloatArray:
        """Mol (..., processes) that slow processes would go on for; 0 for the others."""
        found = np.zeros((*amounts.shape[:-1], len(self.processes)))
        for row in self.slow:
            found[..., row] = self._limit(row, amounts)
        return found

    def slowly(self, amounts: FloatArray, seconds: float) -> FloatArray:
        """Let slow processes of one vessel (columns,) go on, in place; the extents (processes,)."""
        # 1 - exp(-rate dt) by expm1: for short steps the difference would lose its digits.
        shares = [-np.expm1(-(self.processes[row].rate or 0.0) * seconds) for row in self.slow]
        extents = np.zeros(len(self.processes))
        extents[self.slow] = self.pending(amounts)[self.slow] * shares
        # All from the state before; together they take no more than there is.
        wanted = np.minimum(self.changes, 0.0) * extents[:, None]
        wanted[:, self.column.get(PROTON, 0)] = 0.0
        need = -wanted.sum(axis=0)
        short = float(np.max(need / np.where(need > 0.0, np.maximum(amounts, 1e-300), 1.0), initial=0.0))
        extents /= max(1.0, short)
        self._apply(amounts, extents)
        amounts[self.column[HEAT]] -= float(sum(extents[row] * self._joule(row) for row in self.slow))
        return extents

    def react(self, amounts: FloatArray, litres: FloatArray) -> FloatArray:
        """Let rows react at once, in place; the extents (n, processes). Rows follow each other in time.

        A vessel without a liquid does not react.
        """
        extents = np.zeros((len(amounts), len(self.processes)))
        wet = np.flatnonzero(litres > 0.0)
        at_rest = not self.quick and not len(self.phases) and not self.warmth.followed
        if at_rest or not len(wet):
            return extents
        rows = amounts[wet]
        before = self._stored(rows)
        # What is solid is thought dissolved, so that the outcome hangs on what there is and not on how it came.
        standing = rows[:, self.phases] * self.solid
        rows -= standing @ self.formation
        for _ in self.quick:
            for row in self.quick:
                extent = self._limit(row, rows)
                self._apply(rows, extent[:, None] * np.eye(len(self.processes))[row])
                extents[wet, row] += extent
        if len(self.phases) or self.warmth.reacting:
            found = self._settle(rows, litres[wet])
            if self.warmth.reacting:
                rows[:, self.column[STORED]] = found.species @ self.speciation.joule[: found.species.shape[1]]
        rows[:, self.column[STORED]] = rows[:, self.column[STORED]] * self.warmth.reacting - self._diluted(rows)
        given = before - self._stored(rows)
        for row in self.quick:
            given -= extents[wet, row] * self._joule(row)
        rows[:, self.column[HEAT]] += given
        amounts[wet] = rows
        return extents

    def _settle(self, rows: FloatArray, litres: FloatArray) -> Equilibrium:
        """Bring rows to equilibrium, in place."""
        totals = rows[:, self.parts].copy()
        found = equilibrium(self.mixture, totals, litres)
        formed = found.phases
        gone = np.zeros(len(self.phases))
        first = 0
        while self.leaves.any():
            gas = formed[:, self.leaves]
            most = np.maximum.accumulate(gas[first:], axis=0)
            back = np.flatnonzero((gas[first:] < most * (1.0 - FEWER)).any(axis=1))
            if not len(back):
                break
            # From here on what left before is gone, and the rest is at equilibrium without it.
            first += int(back[0])
            gone[self.leaves] = formed[first - 1, self.leaves]
            later = slice(first, None)
            rest = rows[later] + gone @ self.formation
            again = equilibrium(self.mixture, rest[:, self.parts], litres[later])
            found.species[later], formed[later] = again.species, again.phases + gone
            found.ph[later] = again.ph
        dissolved = found.species @ self.mixture.powers
        rows += formed @ self.formation
        rest = rows[:, self.parts]
        scarce = (dissolved < SCARCE * totals) & (np.abs(dissolved - rest) <= ROUNDING * totals)
        # Protons are a difference of what gives and what takes them.
        scarce[:, :1] = False
        rows[:, self.parts] = np.where(scarce, dissolved, rest)
        return found

    def _limit(self, row: int, amounts: FloatArray) -> FloatArray:
        """Mol (...) of a process until the first of what it uses is used up."""
        changes = self.changes[row]
        used = np.flatnonzero(changes < 0.0)
        there = amounts[..., used]
        proton = self.column.get(PROTON, -1)
        if proton in used:
            there = np.where(used == proton, (amounts[..., proton] - amounts @ self.bound)[..., None], there)
        return np.maximum(0.0, (there / -changes[used]).min(axis=-1))

    def _apply(self, amounts: FloatArray, extents: FloatArray) -> None:
        """Change amounts in place; what limits ends at exactly nothing where all of it is used."""
        moved = extents @ self.changes
        whole = amounts + moved
        used_up = (moved < 0.0) & (whole <= 4e-16 * amounts)
        used_up[..., self.column.get(PROTON, 0)] = False
        amounts[...] = np.where(used_up, 0.0, whole)

    def _joule(self, row: int) -> float:
        return self.processes[row].joule if self.warmth.reacting else 0.0

    def _stored(self, rows: FloatArray) -> FloatArray:
        """J (n,) of what is dissolved, of solids and of gases that left, above the parts they are made of."""
        stored = rows[:, self.column[STORED]].copy()
        if self.warmth.reacting:
            stored += rows[:, self.phases] @ self.speciation.joule[len(self.mixture.species) :]
        return stored

    def _diluted(self, rows: FloatArray) -> FloatArray:
        """J (n,) that the solute has given off to the water it is in."""
        if not self.column.keys() >= {self.warmth.solute, self.warmth.water}:
            return np.zeros(len(rows))
        acid, water = (rows[:, self.column[name]] for name in (self.warmth.solute, self.warmth.water))
        return heat_given_off(acid, water, self.warmth.a, self.warmth.b)

    def _places(self, names: Sequence[str]) -> IntArray:
        return np.array([self.column[name] for name in names], dtype=np.int64)

    def _table(self, rows: Sequence[Mapping[str, float]]) -> FloatArray:
        table = np.zeros((len(rows), len(self.column)))
        for row, changes in enumerate(rows):
            for name, many in changes.items():
                table[row, self.column[name]] = many
        return table


def _held_at(mixture: Mixture, ph: float) -> dict[str, float]:
    """Mean number of protons that each part holds at a pH, where nothing else competes for it."""
    found: dict[str, float] = {}
    for place, part in enumerate(mixture.parts[1:], start=1):
        mine = np.flatnonzero((mixture.powers[:, place] == 1.0) & (mixture.powers[:, 0] >= 0.0))
        protons = mixture.powers[mine, 0]
        logs = mixture.constants[mine] - protons * ph * np.log(10.0)
        weights = np.exp(logs - logs.max(initial=-np.inf))
        found[part] = float((weights * protons).sum() / weights.sum())
    return found
