"""One ledger of matter and heat: all that is in every vessel, moved and changed, never made or lost.

A column is a part of what is dissolved (``Ag+``; of ``H+`` less than nothing is hydroxide), a solid (``AgCl(s)``), a
gas that left (``H2(g)``), what was brought under a formula, followed for the reader and never changed (``HCl as
brought``), or energy in J. Row -1 of the state is everything outside the vessels.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Final

import numpy as np

from cdcore.numerics import FloatArray, IntArray
from replay.effects.models.history import History, Process, Warmth
from replay.effects.models.reacting import HEAT, STORED, Reactor
from replay.effects.models.speciation import GAS, SOLID, Speciation

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
"""Steps into which a flow is cut where what receives it reacts slowly or is followed in its warmth."""


@dataclass
class Ledger:
    """Vessels, columns and processes, and the state they are in."""

    vessels: Sequence[str]
    columns: Sequence[str]
    processes: Sequence[Process] = ()
    speciation: Speciation | None = None  # ``None``: nothing is at equilibrium
    along: float = 0.0  # share of a solid that goes along with the liquid
    warmth: Warmth | None = None  # ``None``: nobody asks how warm anything is
    volume_ml: FloatArray = field(init=False)
    amounts: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        if self.warmth is not None:
            self.columns = (*self.columns, HEAT, STORED)
        count, width = len(self.vessels) + 1, len(self.columns)
        self.volume_ml, self.amounts = np.zeros(count), np.zeros((count, width))
        self.extents = np.zeros((count, len(self.processes)))
        self.added_ml = np.zeros((count, count))
        self.clock = np.zeros(count)
        self.at = {name: place for place, name in enumerate(self.vessels)} | {"": len(self.vessels)}
        self.column = {name: place for place, name in enumerate(self.columns)}
        self.reactor = Reactor(self.column, self.processes, self.speciation, self.warmth)
        shares = {GAS: 0.0, SOLID: self.along}
        self.moving = np.array([shares.get(column[-3:], 1.0) for column in self.columns])
        glass = {} if self.warmth is None else self.warmth.glass
        self.glass = np.array([glass.get(name, 0.0) for name in self.at])
        # A slow process that nothing else touches is in closed form from one event to the next.
        self._alone = len(self.processes) == 1 and not len(self.reactor.phases) and self.warmth is None
        self._blocks: list[list[tuple[Any, ...]]] = [[] for _ in range(count)]

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
            self._react_here(place)
            if self.warmth is not None:
                excess = self.warmth.excess.get(name, 0.0)
                self.amounts[place, self.column[HEAT]] = excess * float(self.capacity(place, self.volume_ml[place]))
            self._note(place, 0, time)

    def capacity(self, place: int, volume_ml: FloatArray | float) -> FloatArray:
        """Heat capacity, J/K, of a vessel with so much in it."""
        per_ml = 0.0 if self.warmth is None else self.warmth.per_ml
        return per_ml * volume_ml + self.glass[place]

    def advance(self, place: int, frame: int, time: float) -> None:
        """Let slow processes and the loss of heat of a vessel go on to a time."""
        since = time - self.clock[place]
        begin, self.clock[place] = self.clock[place], max(time, self.clock[place])
        if since <= 0.0:
            return
        waiting = self.reactor.pending(self.amounts[place]) > 0.0
        rates = [self.processes[row].rate or 0.0 for row in self.reactor.slow if waiting[row]]
        done, step = 0.0, since if self._alone or not rates else TICK / max(rates)
        while rates and done < min(since, TIMES / max(rates)):
            part = min(step, since - done)
            self._cool(place, part)
            self.extents[place] += self.reactor.slowly(self.amounts[place], part)
            self._react_here(place)
            done += part
            step *= GROWTH
            if not self._alone:
                self._note(place, frame, float(begin + done))
        self._cool(place, since - done)

    def flow(
        self, frames: IntArray, times: FloatArray, pairs: Sequence[tuple[str, str]], volume_ml: FloatArray
    ) -> None:
        """Flows (source, target) over frames (m,) with millilitres (m, pairs): each frame is a step, all at once.

        In more than one frame no source may be a target. Where something reacts slowly or grows warm it goes in `LUMPS`
        steps.
        """
        cuts = np.unique(np.linspace(0, len(frames), min(len(frames), LUMPS) + 1).astype(np.int64)).tolist()
        ends = [(self.at[source], self.at[target]) for source, target in pairs]
        places = sorted({place for both in ends for place in both})
        # Row 0 of everything below is the state before.
        total = np.concatenate([np.zeros((1, len(pairs))), np.cumsum(volume_ml, axis=0)])
        in_steps = self.warmth is not None or any(self._reacts_slowly(place, ends) for place in places)
        if len(frames) > 1 and in_steps:
            for first, stop in pairwise(cuts):
                last = slice(stop - 1, stop)
                self.flow(frames[last], times[last], pairs, total[stop : stop + 1] - total[first : first + 1])
            return
        for place in places:
            self.advance(place, int(frames[-1]), float(times[-1]))
        volume, amounts, added, extents = state = [
            {place: np.repeat(one[place : place + 1], len(total), axis=0) for place in places}
            for one in (self.volume_ml, self.amounts, self.added_ml, self.extents)
        ]
        for both, gone in zip(ends, total.T, strict=True):
            self._move(*both, gone, state)
        for place in places:
            if place != self.at[""]:
                rows = [one[place][1:] for one in (volume, amounts, extents, added)]
                rows[2] += self.reactor.react(rows[1], rows[0] * 1e-3)
                self._boil(place, rows[0], rows[1])
                self._blocks[place].append((times, frames, *rows[:3], self.reactor.pending(rows[1]), rows[3]))
            self.volume_ml[place], self.amounts[place] = volume[place][-1], amounts[place][-1]
            self.extents[place], self.added_ml[place] = extents[place][-1], added[place][-1]

    def history(self, vessel: str) -> History:
        """All that became of a vessel; of several rows of one time the last."""
        blocks = self._blocks[self.at[vessel]]
        whole = [np.concatenate([block[k] for block in blocks]) for k in range(7)]
        last = np.append(np.diff(whole[0]) > 0.0, True)
        times, frames, volume, amounts, extents, pending, added = (column[last] for column in whole)
        return History(times, frames.astype(np.int64), volume, amounts, extents, pending, added)

    def end(self, frame: int, time: float) -> None:
        """Note every vessel at the last frame."""
        for place in range(len(self.vessels)):
            self.advance(place, frame, time)
            self._note(place, frame, time)

    def _move(self, a: int, b: int, gone: FloatArray, state: list[dict[int, FloatArray]]) -> None:
        """Take from one place what is gone (m + 1,) mL, with its share of everything, and give it to another."""
        volume, amounts, added, _ = state
        share = np.minimum(1.0, gone / self.volume_ml[a]) if self.volume_ml[a] > 0.0 else np.zeros(len(gone))
        moving = self.moving
        if self.warmth is not None and self.glass[a] > 0.0:
            # The vessel's own heat stays with it.
            liquid = self.warmth.per_ml * self.volume_ml[a]
            moving = np.where(np.arange(len(moving)) == self.column[HEAT], liquid / (liquid + self.glass[a]), moving)
        part = share[:, None] * (moving * self.amounts[a])
        # Amounts fall to exactly nothing with the last drop: no share of a rounded rest stays behind.
        last = (gone > 0.0) & (volume[a] - gone <= SPENT * self.volume_ml[a])
        part = np.where(last[:, None] & (moving == 1.0), amounts[a], part)
        moved = np.where(last, volume[a], gone)
        for place, sign in ((a, -1.0), (b, 1.0)):
            volume[place] += sign * moved
            amounts[place] += sign * part
        added[b][:, a] += moved

    def _react_here(self, place: int) -> None:
        amounts = self.amounts[place : place + 1]
        self.extents[place] += self.reactor.react(amounts, self.volume_ml[place : place + 1] * 1e-3)[0]
        self._boil(place, self.volume_ml[place : place + 1], amounts)

    def _cool(self, place: int, seconds: float) -> None:
        capacity = float(self.capacity(place, self.volume_ml[place]))
        if self.warmth is not None and seconds > 0.0 and capacity > 0.0:
            self.amounts[place, self.column[HEAT]] *= np.exp(-self.warmth.loss * seconds / capacity)

    def _boil(self, place: int, volume_ml: FloatArray, amounts: FloatArray) -> None:
        """Let go of what would heat it beyond boiling."""
        if self.warmth is not None and self.warmth.most < np.inf:
            heat = amounts[:, self.column[HEAT]]
            amounts[:, self.column[HEAT]] = np.minimum(heat, self.warmth.most * self.capacity(place, volume_ml))

    def _reacts_slowly(self, place: int, ends: Sequence[tuple[int, int]]) -> bool:
        """Whether a slow process goes on in a vessel, or could with what comes."""
        together = self.amounts[place] + sum(self.amounts[a] for a, b in ends if b == place)
        return bool(self.reactor.slow) and place != self.at[""] and bool(self.reactor.pending(together).any())

    def _note(self, place: int, frame: int, time: float) -> None:
        amounts = self.amounts[place : place + 1].copy()
        self._blocks[place].append((
            np.array([time]), np.array([frame]), self.volume_ml[place : place + 1].copy(), amounts,
            self.extents[place : place + 1].copy(), self.reactor.pending(amounts),
            self.added_ml[place : place + 1].copy(),
        ))  # fmt: skip
