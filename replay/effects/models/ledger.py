"""One ledger of matter and heat: all that is in every vessel, moved and changed, never made or lost.

A column is a part of what is dissolved (``Ag+``; of ``H+`` less than nothing is hydroxide), a solid (``AgCl(s)``), a
gas that left (``H2(g)``), what was brought under a formula, followed for the reader and never changed (``HCl as
brought``), or energy in J. Row -1 of the state is everything outside the vessels.

What came together reacts: equations without a constant to their end or at their rate, the rest to equilibrium.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain, pairwise
from typing import Final

import numpy as np

from cdcore.numerics import BoolArray, FloatArray, IntArray
from replay.effects.models.equilibrium import Equilibrium, Mixture, equilibrium
from replay.effects.models.speciation import GAS, PROTON, SOLID, Speciation
from replay.effects.models.warming import heat_given_off

BROUGHT: Final = " as brought"
SPENT: Final = 1e-12
"""A rest below this share of what a vessel held goes with the last drop: it is rounding."""
TICK: Final = 0.02
"""Where a slow reaction meets others it goes in steps of this share of its time at first: 1 % of what reacts in one."""
GROWTH: Final = 1.05
"""Of these steps, one to the next: what is left to react falls by itself."""
TIMES: Final = 50.0
"""What is left after so many times the reaction's own time is nothing to speak of."""
LUMPS: Final = 64
"""Steps into which a flow is cut where it runs over, or what receives it reacts slowly or grows warm."""


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


@dataclass(frozen=True)
class Process:
    """An equation in the ledger's own columns that no constant brings to equilibrium; what cancels is left out."""

    text: str = field(compare=False)
    changes: Mapping[str, float]  # column -> mol made by one mol of reaction, negative where it is used up
    rate: float | None = None  # first-order, 1/s; ``None``: at once
    # enthalpy of one mol of reaction; NaN: not known
    joule: float = field(default=float("nan"), compare=False)


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


class Ledger:
    """Vessels, columns and processes, and the state they are in.

    Parameters
    ----------
    vessels, columns : names; columns of processes and of the equilibrium are there anyway.
    processes : equations without a constant.
    speciation : what is at equilibrium.
    along : share of a solid that goes along with the liquid.
    warmth : how heat is followed.
    """

    def __init__(
        self, vessels: Sequence[str], columns: Sequence[str], processes: Sequence[Process], speciation: Speciation,
        along: float = 0.0, warmth: Warmth = UNFOLLOWED,
    ) -> None:  # fmt: skip
        self.vessels, self.processes, self.speciation, self.warmth = vessels, processes, speciation, warmth
        self.mixture = mixture = speciation.mixture
        made = [process.changes for process in processes]
        self.columns = tuple(dict.fromkeys(chain(columns, *made, *speciation.changes, mixture.parts, (HEAT, STORED))))
        self.at = {name: place for place, name in enumerate((*vessels, ""))}
        self.column = {name: place for place, name in enumerate(self.columns)}
        count = len(self.at)
        self._cuts = np.cumsum([1, len(self.columns), len(processes)])
        self.state = np.zeros((count, int(self._cuts[-1]) + count))  # as ``_parts`` names its columns
        volume, self.amounts, self.extents, _ = self._parts(self.state)
        self.volume_ml = volume[:, 0]
        self.clock = np.zeros(count)
        shares = {GAS: 0.0, SOLID: along}
        self.moving = np.array([shares.get(column[-3:], 1.0) for column in self.columns])
        self.glass = np.array([warmth.glass.get(name, 0.0) for name in self.at])
        self.changes, self.formation = self._table(made), self._table(speciation.changes)
        self.slow = [row for row, process in enumerate(processes) if process.rate is not None]
        self.quick = [row for row, process in enumerate(processes) if process.rate is None]
        self.parts, self.phases = (
            np.array([self.column[name] for name in names], dtype=np.int64) for names in (mixture.parts, mixture.phases)
        )
        self.gas = np.array([name.endswith(GAS) for name in mixture.phases], dtype=np.bool_)
        self.proton = self.column[PROTON]
        self.bound = np.zeros(len(self.columns))
        for part, protons in _held_at(mixture, NEUTRAL_PH).items():
            self.bound[self.column[part]] = protons
        # A slow process that nothing else touches is in closed form from one event to the next.
        self._alone = len(processes) == 1 and not len(self.phases) and not warmth.followed
        self._blocks: list[list[tuple[FloatArray, IntArray, FloatArray]]] = [[] for _ in range(count)]

    def fill(self, vessel: str, volume_ml: float, amounts: Mapping[str, float]) -> None:
        """Put something into a vessel at the begin."""
        place = self.at[vessel]
        self.volume_ml[place] += volume_ml
        for name, amount in amounts.items():
            self.amounts[place, self.column[name]] += amount

    def begin(self, time: float) -> None:
        """React what stands together at the first frame, and note it; what heat that gave is gone."""
        self.clock[:] = time
        for place, name in enumerate(self.vessels):
            self._react(place, self.state[place : place + 1])
            excess = self.warmth.excess.get(name, 0.0)
            self.amounts[place, self.column[HEAT]] = excess * float(self.capacity(place, self.volume_ml[place]))
            self._note(place, 0, time)

    def capacity(self, place: int, volume_ml: FloatArray | float) -> FloatArray:
        """Heat capacity, J/K, of a vessel with so much in it."""
        return self.warmth.per_ml * volume_ml + self.glass[place]

    def advance(self, place: int, frame: int, time: float) -> None:
        """Let slow processes and the loss of heat of a vessel go on to a time."""
        since = time - self.clock[place]
        begin, self.clock[place] = self.clock[place], max(time, self.clock[place])
        if since <= 0.0:
            return
        waiting = self.pending(self.amounts[place]) > 0.0
        rates = [self.processes[row].rate or 0.0 for row in self.slow if waiting[row]]
        done, step = 0.0, since if self._alone or not rates else TICK / max(rates)
        while rates and done < min(since, TIMES / max(rates)):
            part = min(step, since - done)
            self._cool(place, part)
            self._slowly(place, part)
            self._react(place, self.state[place : place + 1])
            done += part
            step *= GROWTH
            if not self._alone:
                self._note(place, frame, float(begin + done))
        self._cool(place, since - done)

    def flow(
        self, frames: IntArray, times: FloatArray, pairs: Sequence[tuple[str, str]], volume_ml: FloatArray,
        over: BoolArray,
    ) -> None:  # fmt: skip
        """Flows (source, target) over frames (m,) with millilitres (m, pairs): each frame is a step, all at once.

        ``over`` (pairs,): it runs over a brim, after the others. A chain, in which what gives also gets, goes frame by
        frame; where something runs over, reacts slowly or grows warm it goes in `LUMPS` steps.
        """
        ends = [(self.at[source], self.at[target]) for source, target in pairs]
        getting = {target for _, target in ends}
        chained = any(source in getting for (source, _), brim in zip(ends, over, strict=True) if not brim)
        slow = any(self._reacts_slowly(place, ends) for place in getting.union(source for source, _ in ends))
        if not (chained or over.any() or slow or self.warmth.followed):
            self._flow(frames, times, ends, volume_ml)
            return
        count = len(frames) if chained else min(len(frames), LUMPS)
        for first, stop in pairwise(np.linspace(0, len(frames), count + 1).astype(np.int64).tolist()):
            part, last = volume_ml[first:stop].sum(axis=0), slice(stop - 1, stop)
            for brim in (False, True):
                moving = np.flatnonzero((over == brim) & (part > 0.0))
                if len(moving):
                    self._flow(frames[last], times[last], [ends[k] for k in moving.tolist()], part[None, moving])

    def _flow(
        self, frames: IntArray, times: FloatArray, ends: Sequence[tuple[int, int]], volume_ml: FloatArray
    ) -> None:
        """Flows between places; in more than one frame no source may be a target."""
        # Row 0 of everything below is the state before.
        total = np.concatenate([np.zeros((1, len(ends))), np.cumsum(volume_ml, axis=0)])
        places = sorted({place for both in ends for place in both})
        for place in places:
            self.advance(place, int(frames[-1]), float(times[-1]))
        states = {place: np.repeat(self.state[place : place + 1], len(total), axis=0) for place in places}
        for (source, target), gone in zip(ends, total.T, strict=True):
            self._move(source, states[source], states[target], gone)
        for place, rows in states.items():
            if place != self.at[""]:
                self._react(place, rows[1:])
                self._blocks[place].append((times, frames, rows[1:]))
            self.state[place] = rows[-1]

    def history(self, vessel: str) -> History:
        """All that became of a vessel; of several rows of one time the last."""
        times, frames, rows = (np.concatenate(column) for column in zip(*self._blocks[self.at[vessel]], strict=True))
        last = np.append(np.diff(times) > 0.0, True)
        volume, amounts, extents, added = self._parts(rows[last])
        pending = self.pending(amounts)
        return History(times[last], frames[last].astype(np.int64), volume[:, 0], amounts, extents, pending, added)

    def end(self, frame: int, time: float) -> None:
        """Note every vessel at the last frame."""
        for place in range(len(self.vessels)):
            self.advance(place, frame, time)
            self._note(place, frame, time)

    def _parts(self, rows: FloatArray) -> list[FloatArray]:
        """Of rows of the state: millilitres (n, 1), amounts, extents, and millilitres that came from each place."""
        return np.split(rows, self._cuts, axis=1)

    def _move(self, source: int, giving: FloatArray, taking: FloatArray, gone: FloatArray) -> None:
        """Take from one place what is gone (m + 1,) mL, with its share of everything, and give it to another."""
        (volume, amounts, *_), held = self._parts(giving), self.volume_ml[source]
        share = np.minimum(1.0, gone / held) if held > 0.0 else np.zeros(len(gone))
        moving = self.moving
        if self.glass[source] > 0.0:
            # The vessel's own heat stays with it.
            liquid = self.warmth.per_ml * held
            moving = np.where(
                np.arange(len(moving)) == self.column[HEAT], liquid / (liquid + self.glass[source]), moving
            )
        part = share[:, None] * (moving * self.amounts[source])
        # Amounts fall to exactly nothing with the last drop: no share of a rounded rest stays behind.
        last = (gone > 0.0) & (volume[:, 0] - gone <= SPENT * held)
        part = np.where(last[:, None] & (moving == 1.0), amounts, part)
        moved = np.where(last, volume[:, 0], gone)
        for rows, sign in ((giving, -1.0), (taking, 1.0)):
            volume, amounts, _, added = self._parts(rows)
            volume[:, 0] += sign * moved
            amounts += sign * part
        added[:, source] += moved

    def pending(self, amounts: FloatArray) -> FloatArray:
        """Mol (..., processes) that slow processes would go on for; 0 for the others."""
        found = np.zeros((*amounts.shape[:-1], len(self.processes)))
        for row in self.slow:
            found[..., row] = self._limit(row, amounts)
        return found

    def _slowly(self, place: int, seconds: float) -> None:
        """Let slow processes of a vessel go on."""
        amounts = self.amounts[place]
        # 1 - exp(-rate dt) by expm1: for short steps the difference would lose its digits.
        shares = [-np.expm1(-(process.rate or 0.0) * seconds) for process in self.processes]
        extents = self.pending(amounts) * shares
        # All from the state before; together they take no more than there is.
        wanted = np.minimum(self.changes, 0.0) * extents[:, None]
        wanted[:, self.proton] = 0.0
        need = -wanted.sum(axis=0)
        short = float(np.max(need / np.where(need > 0.0, np.maximum(amounts, 1e-300), 1.0), initial=0.0))
        extents /= max(1.0, short)
        self._apply(amounts, extents @ self.changes)
        amounts[self.column[HEAT]] -= float(sum(extents[row] * self._joule(row) for row in self.slow))
        self.extents[place] += extents

    def _react(self, place: int, rows: FloatArray) -> None:
        """Let rows of the state of a place, which follow each other in time, react at once, in place.

        A vessel without a liquid does not react. What would heat it beyond boiling leaves it.
        """
        volume, every, extents, _ = self._parts(rows)
        wet = np.flatnonzero(volume[:, 0] > 0.0)
        if len(wet) and (self.quick or len(self.phases) or self.warmth.followed):
            amounts, done = every[wet], np.zeros((len(wet), len(self.processes)))
            before = self._stored(amounts)
            # What is solid is thought dissolved, so that the outcome hangs on what there is and not on how it came.
            standing = amounts[:, self.phases] * ~self.gas
            amounts -= standing @ self.formation
            for _ in self.quick:
                for row in self.quick:
                    extent = self._limit(row, amounts)
                    self._apply(amounts, extent[:, None] * self.changes[row])
                    done[:, row] += extent
            if len(self.phases) or self.warmth.reacting:
                found = self._settle(amounts, volume[wet, 0] * 1e-3)
                if self.warmth.reacting:
                    amounts[:, self.column[STORED]] = found.species @ self.speciation.joule[: found.species.shape[1]]
            stored = amounts[:, self.column[STORED]]
            amounts[:, self.column[STORED]] = stored * self.warmth.reacting - self._diluted(amounts)
            given = before - self._stored(amounts)
            for row in self.quick:
                given -= done[:, row] * self._joule(row)
            amounts[:, self.column[HEAT]] += given
            every[wet] = amounts
            extents[wet] += done
        if self.warmth.most < np.inf:
            heat = every[:, self.column[HEAT]]
            every[:, self.column[HEAT]] = np.minimum(heat, self.warmth.most * self.capacity(place, volume[:, 0]))

    def _settle(self, rows: FloatArray, litres: FloatArray) -> Equilibrium:
        """Bring rows to equilibrium, in place."""
        totals = rows[:, self.parts].copy()
        found = equilibrium(self.mixture, totals, litres)
        formed = found.phases
        gone = np.zeros(len(self.phases))
        first = 0
        while self.gas.any():
            gas = formed[:, self.gas]
            most = np.maximum.accumulate(gas[first:], axis=0)
            back = np.flatnonzero((gas[first:] < most * (1.0 - FEWER)).any(axis=1))
            if not len(back):
                break
            # From here on what left before is gone, and the rest is at equilibrium without it.
            first += int(back[0])
            gone[self.gas] = formed[first - 1, self.gas]
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
        if self.proton in used:
            free = amounts[..., self.proton] - amounts @ self.bound
            there = np.where(used == self.proton, free[..., None], there)
        return np.maximum(0.0, (there / -changes[used]).min(axis=-1))

    def _apply(self, amounts: FloatArray, moved: FloatArray) -> None:
        """Add what was made to amounts, in place; what limits ends at exactly nothing where all of it is used."""
        whole = amounts + moved
        used_up = (moved < 0.0) & (whole <= 4e-16 * amounts)
        used_up[..., self.proton] = False
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

    def _cool(self, place: int, seconds: float) -> None:
        capacity = float(self.capacity(place, self.volume_ml[place]))
        if capacity > 0.0:
            self.amounts[place, self.column[HEAT]] *= np.exp(-self.warmth.loss * seconds / capacity)

    def _reacts_slowly(self, place: int, ends: Sequence[tuple[int, int]]) -> bool:
        """Whether a slow process goes on in a vessel, or could with what comes."""
        together = self.amounts[place] + sum(self.amounts[a] for a, b in ends if b == place)
        return bool(self.slow) and place != self.at[""] and bool(self.pending(together).any())

    def _note(self, place: int, frame: int, time: float) -> None:
        self._blocks[place].append((np.array([time]), np.array([frame]), self.state[place : place + 1].copy()))

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
