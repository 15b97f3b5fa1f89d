"""One ledger of matter and heat: all that is in every vessel, moved and changed, never made or lost.

A column is a part of what is dissolved (``Ag+``; of ``H+`` less than nothing is hydroxide), a solid (``AgCl(s)``), a
gas that left (``H2(g)``), what was brought under a formula, followed for the reader and never changed (``HCl as
brought``), or energy in J. Row -1 of the state is everything outside the vessels.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray, IntArray
from replay.effects.models.history import UNFOLLOWED, History, Process, Warmth
from replay.effects.models.reacting import HEAT, STORED, Reactor
from replay.effects.models.speciation import GAS, NOTHING, SOLID, Speciation

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
    speciation: Speciation = NOTHING
    along: float = 0.0  # share of a solid that goes along with the liquid
    warmth: Warmth = UNFOLLOWED
    state: FloatArray = field(init=False)  # (places, 1 + columns + processes + places), as ``_parts`` names them

    def __post_init__(self) -> None:
        tables = [*(process.changes for process in self.processes), *self.speciation.changes]
        named = [column for table in tables for column in table]
        self.columns = tuple(dict.fromkeys((*self.columns, *named, *self.speciation.mixture.parts, HEAT, STORED)))
        self.at = {name: place for place, name in enumerate((*self.vessels, ""))}
        self.column = {name: place for place, name in enumerate(self.columns)}
        count = len(self.at)
        self._cuts = np.cumsum([1, len(self.columns), len(self.processes)])
        self.state = np.zeros((count, int(self._cuts[-1]) + count))
        volume, self.amounts, self.extents, _ = self._parts(self.state)
        self.volume_ml = volume[:, 0]
        self.clock = np.zeros(count)
        self.reactor = Reactor(self.column, self.processes, self.speciation, self.warmth)
        shares = {GAS: 0.0, SOLID: self.along}
        self.moving = np.array([shares.get(column[-3:], 1.0) for column in self.columns])
        self.glass = np.array([self.warmth.glass.get(name, 0.0) for name in self.at])
        # A slow process that nothing else touches is in closed form from one event to the next.
        self._alone = len(self.processes) == 1 and not len(self.reactor.phases) and not self.warmth.followed
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
        waiting = self.reactor.pending(self.amounts[place]) > 0.0
        rates = [self.processes[row].rate or 0.0 for row in self.reactor.slow if waiting[row]]
        done, step = 0.0, since if self._alone or not rates else TICK / max(rates)
        while rates and done < min(since, TIMES / max(rates)):
            part = min(step, since - done)
            self._cool(place, part)
            self.extents[place] += self.reactor.slowly(self.amounts[place], part)
            self._react(place, self.state[place : place + 1])
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
        ends = [(self.at[source], self.at[target]) for source, target in pairs]
        places = sorted({place for both in ends for place in both})
        # Row 0 of everything below is the state before.
        total = np.concatenate([np.zeros((1, len(pairs))), np.cumsum(volume_ml, axis=0)])
        in_steps = self.warmth.followed or any(self._reacts_slowly(place, ends) for place in places)
        if len(frames) > 1 and in_steps:
            for first, stop in lumps(len(frames)):
                last = slice(stop - 1, stop)
                self.flow(frames[last], times[last], pairs, total[stop : stop + 1] - total[first : first + 1])
            return
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
        pending = self.reactor.pending(amounts)
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

    def _react(self, place: int, rows: FloatArray) -> None:
        """React rows of the state of a place, in place; what would heat it beyond boiling leaves it."""
        volume, amounts, extents, _ = self._parts(rows)
        extents += self.reactor.react(amounts, volume[:, 0] * 1e-3)
        if self.warmth.most < np.inf:
            heat = amounts[:, self.column[HEAT]]
            amounts[:, self.column[HEAT]] = np.minimum(heat, self.warmth.most * self.capacity(place, volume[:, 0]))

    def _cool(self, place: int, seconds: float) -> None:
        capacity = float(self.capacity(place, self.volume_ml[place]))
        if capacity > 0.0:
            self.amounts[place, self.column[HEAT]] *= np.exp(-self.warmth.loss * seconds / capacity)

    def _reacts_slowly(self, place: int, ends: Sequence[tuple[int, int]]) -> bool:
        """Whether a slow process goes on in a vessel, or could with what comes."""
        together = self.amounts[place] + sum(self.amounts[a] for a, b in ends if b == place)
        return bool(self.reactor.slow) and place != self.at[""] and bool(self.reactor.pending(together).any())

    def _note(self, place: int, frame: int, time: float) -> None:
        self._blocks[place].append((np.array([time]), np.array([frame]), self.state[place : place + 1].copy()))


def lumps(count: int, most: int = LUMPS) -> Iterator[tuple[int, int]]:
    """First and stop of each of at most so many parts of ``count`` frames."""
    return pairwise(np.unique(np.linspace(0, count, min(count, most) + 1).astype(np.int64)).tolist())
