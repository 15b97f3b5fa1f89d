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
        volumes = np.array([[volume for *_, volume in moves]])
        self.flow(np.array([frame]), np.array([time]), [(a, b) for a, b, _ in moves], volumes)

    def flow(
        self, frames: IntArray, times: FloatArray, pairs: Sequence[tuple[str, str]], volume_ml: FloatArray
    ) -> None:
        """Flows (source, target) over frames (m,) with millilitres (m, pairs): each frame is a step, all at once.

        In more than one frame no source may be a target. Where something reacts slowly it goes in `LUMPS` steps.
        """
        cuts = np.unique(np.linspace(0, len(frames), min(len(frames), LUMPS) + 1).astype(np.int64)).tolist()
        ends = [(self.at[source], self.at[target]) for source, target in pairs]
        places = sorted({place for both in ends for place in both})
        # Row 0 of everything below is the state before.
        total = np.concatenate([np.zeros((1, len(pairs))), np.cumsum(volume_ml, axis=0)])
        if len(frames) > 1 and self.slow and any(self._reacts_slowly(place, ends) for place in places):
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
        carried = [self._move(*both, gone, state) for both, gone in zip(ends, total.T, strict=True)]
        for place in places:
            if place != self.at[""]:
                rows = [one[place][1:] for one in (volume, amounts, extents, added)]
                rows[2] += self._react(rows[1], rows[0] * 1e-3)
                self._blocks[place].append((times, frames, *rows[:3], self.pending(rows[1]), rows[3]))
            self.volume_ml[place], self.amounts[place] = volume[place][-1], amounts[place][-1]
            self.extents[place], self.added_ml[place] = extents[place][-1], added[place][-1]
        for first, stop in pairwise(cuts):
            met: dict[int, tuple[float, FloatArray, FloatArray]] = {}
            for pair, (_, b), gone, part in zip(pairs, ends, total.T, carried, strict=True):
                more, more_ml = part[stop] - part[first], float(gone[stop] - gone[first])
                now = float(volume[b][first]), amounts[b][first], extents[b][stop] - extents[b][first]
                before_ml, before, reacted = met.get(b, now)
                span = int(frames[stop - 1]), float(times[first]), float(times[stop - 1])
                self.loads.append(Load(*span, *pair, more_ml, before_ml, more, before, reacted))
                # Of several flows that meet the later finds the earlier there, and what reacted is booked once.
                met[b] = before_ml + more_ml, before + more, np.zeros_like(reacted)

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
        limit = (amounts[..., used] / -self.changes[row, used]).min(axis=-1)
        if anion := self.processes[row].bound:
            kept = self.processes[row].changes["H+"] / self.processes[row].changes[anion] - 1.0
            free = amounts[..., self.column["H+"]] - kept * amounts[..., self.column[anion]]
            limit = np.minimum(limit, free)
        return np.asarray(np.maximum(0.0, limit))

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

    def _move(self, a: int, b: int, gone: FloatArray, state: list[dict[int, FloatArray]]) -> FloatArray:
        """Take from one place what is gone (m + 1,) mL, and give it to another; mol (m + 1, columns) that go along."""
        volume, amounts, added, _ = state
        share = np.minimum(1.0, gone / self.volume_ml[a]) if self.volume_ml[a] > 0.0 else np.zeros(len(gone))
        part = np.minimum(share[:, None] * (self.moving * self.amounts[a]), amounts[a])
        # Amounts fall to exactly nothing with the last drop: no share of a rounded rest stays behind.
        last = (gone > 0.0) & (volume[a] - gone <= SPENT * self.volume_ml[a])
        part = np.where(last[:, None] & (self.moving == 1.0), amounts[a], part)
        moved = np.where(last, volume[a], gone)
        for place, sign in ((a, -1.0), (b, 1.0)):
            volume[place] += sign * moved
            amounts[place] += sign * part
        added[b][:, a] += moved
        return part

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

    def _reacts_slowly(self, place: int, ends: Sequence[tuple[int, int]]) -> bool:
        """Whether a slow process goes on in a vessel, or could with what comes."""
        together = self.amounts[place] + sum(self.amounts[a] for a, b in ends if b == place)
        return place != self.at[""] and bool(self.pending(together).any())

    def _note(self, place: int, frame: int, time: float) -> None:
        amounts = self.amounts[place : place + 1].copy()
        self._blocks[place].append((
            np.array([time]), np.array([frame]), self.volume_ml[place : place + 1].copy(), amounts,
            self.extents[place : place + 1].copy(), self.pending(amounts), self.added_ml[place : place + 1].copy(),
        ))  # fmt: skip


def along_of(column: str, along: float) -> float:
    """Share of a column that goes along with the liquid."""
    return along if column.endswith(SOLID) else 1.0
