"""One ledger of matter: mol of every species and phase in every vessel, moved and changed, never made or lost.

A column is a dissolved species (``Ag+``), a solid (``AgCl(s)``), a gas (``H2(g)``) or what was brought under a formula,
followed for the reader and never changed (``HCl as brought``). Row -1 of the state is everything outside the vessels.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Final

import numpy as np

from cdcore.numerics import FloatArray, IntArray
from replay.effects.models.history import NEUTRALISATION, History, Load, Process
from replay.effects.models.solubility import solids_formed

BROUGHT: Final = " as brought"
SOLID, GAS = "(s)", "(g)"
OUTSIDE: Final = -1
PASSES: Final = 60
"""Rounds of reactions that feed each other; a chain of n equations ends in n."""
SPENT: Final = 1e-12
"""A rest below this share of what a vessel held goes with the last drop: it is rounding."""
TICK: Final = 0.02
"""Where a slow reaction meets others it goes in steps of this share of its time: 1 % of what reacts in one."""
LUMPS: Final = 64
"""Steps into which a flow is cut where what receives it reacts slowly or grows warm."""


@dataclass
class Ledger:
    """Vessels, columns and processes, and the state they are in."""

    vessels: Sequence[str]
    columns: Sequence[str]
    processes: Sequence[Process]
    along: float = 0.0  # share of a solid that goes along with the liquid
    volume_ml: FloatArray = field(init=False)
    amounts: FloatArray = field(init=False)
    loads: list[Load] = field(default_factory=list, init=False)

    def __post_init__(self) -> None:
        count, width = len(self.vessels) + 1, len(self.columns)
        self.volume_ml, self.amounts = np.zeros(count), np.zeros((count, width))
        self.extents = np.zeros((count, len(self.processes)))
        self.added_ml = np.zeros((count, count))
        self.clock = np.zeros(count)
        self.at = {name: place for place, name in enumerate(self.vessels)} | {"": len(self.vessels)}
        self.column = {name: place for place, name in enumerate(self.columns)}
        self.changes = np.zeros((len(self.processes), width))
        for row, one in enumerate(self.processes):
            for name, many in one.changes.items():
                self.changes[row, self.column[name]] = many
        self.moving = np.array([0.0 if c.endswith(GAS) else along_of(c, self.along) for c in self.columns])
        self.salts = [row for row, one in enumerate(self.processes) if one.product is not None]
        self.slow = [row for row, one in enumerate(self.processes) if one.rate is not None]
        self.quick = [row for row in range(len(self.processes)) if row not in (*self.salts, *self.slow)]
        self._blocks: list[list[tuple[Any, ...]]] = [[] for _ in range(count)]

    def fill(self, vessel: str, volume_ml: float, amounts: Mapping[str, float]) -> None:
        """Put something into a vessel at the begin."""
        place = self.at[vessel]
        self.volume_ml[place] += volume_ml
        for name, amount in amounts.items():
            self.amounts[place, self.column[name]] += amount

    def begin(self, time: float) -> None:
        """React what stands together at the first frame, and note it."""
        self.clock[:] = time
        for place in range(len(self.vessels)):
            self._react_here(place)
            self._note(place, 0, time)

    def advance(self, place: int, frame: int, time: float) -> None:
        """Let slow processes of a vessel go on to a time."""
        since = time - self.clock[place]
        begin, self.clock[place] = self.clock[place], max(time, self.clock[place])
        rates = [self.processes[row].rate or 0.0 for row in self.slow]
        if since <= 0.0 or not rates or not self.pending(self.amounts[place]).any():
            return
        alone = len(self.processes) <= 1 + (self.processes[0] is NEUTRALISATION)
        step = since if alone else TICK / max(rates)
        for tick in range(1, min(int(np.ceil(since / step)), int(50.0 / TICK)) + 1):
            done = min(since, tick * step)
            self._slowly(place, min(step, since - (tick - 1) * step))
            if not alone:
                self._note(place, frame, float(begin + done))
        # What is left after fifty times the reaction's own time is nothing to speak of.

    def step(self, frame: int, time: float, moves: Sequence[tuple[str, str, float]]) -> None:
        """Transfers (source, target, mL) of one step, all from the state before it, and what then reacts."""
        places = sorted({self.at[name] for source, target, _ in moves for name in (source, target)})
        for place in places:
            self.advance(place, frame, time)
        before_ml, before = self.volume_ml.copy(), self.amounts.copy()
        carried = []
        for source, target, volume in moves:
            a, b = self.at[source], self.at[target]
            # Amounts fall to exactly nothing with the last drop: no share of a rounded rest stays behind.
            share = min(1.0, volume / before_ml[a]) if before_ml[a] > 0.0 else 0.0
            part = np.minimum(share * self.moving * before[a], self.amounts[a])
            if self.volume_ml[a] - volume <= SPENT * before_ml[a]:
                part, volume = np.where(self.moving == 1.0, self.amounts[a], part), float(self.volume_ml[a])
            self.amounts[a] -= part
            self.amounts[b] += part
            self.volume_ml[a] -= volume
            self.volume_ml[b] += volume
            self.added_ml[b, a] += volume
            carried.append(part)
        extents = self.extents.copy()
        for place in places:
            if place != self.at[""]:
                self._react_here(place)
                self._note(place, frame, time)
        for (source, target, volume), part in zip(moves, carried, strict=True):
            b = self.at[target]
            reacted = self.extents[b] - extents[b]
            extents[b] = self.extents[b]  # booked once where several flows meet
            self.loads.append(
                Load(frame, time, time, source, target, volume, before_ml[b], part, before[b].copy(), reacted)
            )
            before_ml[b] += volume
            before[b] += part

    def flow(
        self, frames: IntArray, times: FloatArray, pairs: Sequence[tuple[str, str]], volume_ml: FloatArray
    ) -> None:
        """Flows (source, target) over frames (m,) with millilitres (m, pairs): each frame is a step, all at once.

        No source may be a target. Where something reacts slowly the flow goes in `LUMPS` steps.
        """
        cuts = np.unique(np.linspace(0, len(frames), min(len(frames), LUMPS) + 1).astype(np.int64))
        places = {self.at[name] for pair in pairs for name in pair}
        total = np.concatenate([np.zeros((1, len(pairs))), np.cumsum(volume_ml, axis=0)])
        if len(frames) == 1 or (self.slow and any(self._reacts_slowly(place, pairs) for place in places)):
            for first, stop in pairwise(cuts.tolist()):
                part = total[stop] - total[first]
                moves = [(*pair, float(one)) for pair, one in zip(pairs, part, strict=True) if one > 0.0]
                self.step(int(frames[stop - 1]), float(times[stop - 1]), moves)
            return
        was_ml, was, before = self.volume_ml.copy(), self.amounts.copy(), self.extents.copy()
        for place in sorted(places):
            volume, amounts = np.full(len(frames), was_ml[place]), np.tile(was[place], (len(frames), 1))
            added = np.tile(self.added_ml[place], (len(frames), 1))
            for column, (source, target) in enumerate(pairs):
                a, gone = self.at[source], total[1:, column]
                part = (gone / was_ml[a])[:, None] * (self.moving * was[a])
                if place == a:
                    volume, amounts = volume - gone, amounts - part
                if place == self.at[target]:
                    volume, amounts = volume + gone, amounts + part
                    added[:, a] += gone
            spent = volume <= SPENT * was_ml[place]
            volume = np.where(spent, 0.0, volume)
            amounts = np.where(spent[:, None] & (self.moving == 1.0), 0.0, np.maximum(0.0, amounts))
            extents = np.tile(before[place], (len(frames), 1))
            if place != self.at[""]:
                extents = extents + self._react(amounts, volume * 1e-3)
                self._blocks[place].append((times, frames, volume, amounts, extents, np.zeros_like(extents), added))
            self.volume_ml[place], self.amounts[place] = volume[-1], amounts[-1]
            self.extents[place], self.added_ml[place], self.clock[place] = extents[-1], added[-1], times[-1]
        self._note_loads(cuts, frames, times, pairs, total, (was_ml, was, before))

    def pending(self, amounts: FloatArray) -> FloatArray:
        """Mol (..., processes) that slow processes would go on for; 0 for the others."""
        found = np.zeros((*amounts.shape[:-1], len(self.processes)))
        for row in self.slow:
            found[..., row] = self._limit(row, amounts)
        return found

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

    def _limit(self, row: int, amounts: FloatArray) -> FloatArray:
        used = np.flatnonzero(self.changes[row] < 0.0)
        return np.asarray(np.maximum(0.0, (amounts[..., used] / -self.changes[row, used]).min(axis=-1)))

    def _apply(self, row: int, amounts: FloatArray, extent: FloatArray) -> None:
        """Change amounts in place; what limits ends at exactly nothing where all of it is used."""
        whole = amounts + extent[..., None] * self.changes[row]
        amounts[...] = np.where((self.changes[row] < 0.0) & (whole <= 4e-16 * amounts), 0.0, whole)

    def _react(self, amounts: FloatArray, litres: FloatArray) -> FloatArray:
        """Let (n, columns) react at once, in place; the extents (n, processes)."""
        extents = np.zeros((len(amounts), len(self.processes)))
        for _ in range(PASSES):
            most = 0.0
            for row in self.quick:
                extent = self._limit(row, amounts)
                self._apply(row, amounts, extent)
                extents[:, row] += extent
                most = max(most, float((extent / (1e-300 + amounts.max(axis=1))).max(initial=0.0)))
            if self.salts:
                fallen = self._fall_out(amounts, litres)
                extents[:, self.salts] += fallen
            if most <= 1e-15:
                break
        return extents

    def _fall_out(self, amounts: FloatArray, litres: FloatArray) -> FloatArray:
        changes = self.changes[self.salts]
        ions = np.flatnonzero((changes < 0.0).any(axis=0))
        solids = [int(np.flatnonzero(row > 0.0)[0]) for row in changes]
        made = changes[range(len(solids)), solids]
        uses = -changes[:, ions] / made[:, None]
        products = np.array([self.processes[row].product for row in self.salts], dtype=np.float64)
        there = amounts[:, solids]
        formed, left = solids_formed(amounts[:, ions] + there @ uses, litres, uses, products)
        dry = litres <= 0.0
        amounts[:, solids] = np.where(dry[:, None], there, formed)
        amounts[:, ions] = np.where(dry[:, None], amounts[:, ions], left)
        return np.asarray((amounts[:, solids] - there) / made)

    def _react_here(self, place: int) -> None:
        amounts = self.amounts[place : place + 1]
        self.extents[place] += self._react(amounts, self.volume_ml[place : place + 1] * 1e-3)[0]

    def _slowly(self, place: int, seconds: float) -> None:
        for row in self.slow:
            amounts = self.amounts[place]
            # 1 - exp(-rate dt) by expm1: for short steps the difference would lose its digits.
            extent = self._limit(row, amounts) * -np.expm1(-(self.processes[row].rate or 0.0) * seconds)
            self._apply(row, amounts, extent)
            self.extents[place, row] += extent
        self._react_here(place)

    def _reacts_slowly(self, place: int, pairs: Sequence[tuple[str, str]]) -> bool:
        """Whether a slow process goes on in a vessel, or could with what comes."""
        together = self.amounts[place] + sum(self.amounts[self.at[a]] for a, b in pairs if self.at[b] == place)
        return place != self.at[""] and bool(self.pending(together).any())

    def _note(self, place: int, frame: int, time: float) -> None:
        amounts = self.amounts[place : place + 1].copy()
        self._blocks[place].append((
            np.array([time]), np.array([frame]), self.volume_ml[place : place + 1].copy(), amounts,
            self.extents[place : place + 1].copy(), self.pending(amounts), self.added_ml[place : place + 1].copy(),
        ))  # fmt: skip

    def _note_loads(
        self, cuts: IntArray, frames: IntArray, times: FloatArray, pairs: Sequence[tuple[str, str]],
        total: FloatArray, was: tuple[FloatArray, FloatArray, FloatArray],
    ) -> None:  # fmt: skip
        """The parts of a flow that went all at once, each with what its target was like."""
        was_ml, amounts, extents = was
        for first, stop in pairwise(cuts.tolist()):
            for column, (source, target) in enumerate(pairs):
                a, b = self.at[source], self.at[target]
                volume = float(total[stop, column] - total[first, column])
                if volume <= 0.0:
                    continue
                part = volume / was_ml[a] * self.moving * amounts[a]
                before_ml, before, reacted = 0.0, np.zeros(len(part)), np.zeros(len(self.processes))
                if target:
                    block = self._blocks[b][-1]
                    before_ml = float(block[2][first - 1]) if first else float(was_ml[b])
                    before = block[3][first - 1] if first else amounts[b]
                    reacted = block[4][stop - 1] - (block[4][first - 1] if first else extents[b])
                end = stop - 1
                self.loads.append(Load(
                    int(frames[end]), float(times[first]), float(times[end]), source, target, volume, before_ml, part,
                    before, reacted,
                ))  # fmt: skip


def along_of(column: str, along: float) -> float:
    """Share of a column that goes along with the liquid."""
    return along if column.endswith(SOLID) else 1.0
