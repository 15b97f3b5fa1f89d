"""Liquid on its way from one vessel to another, and the ledger that neither makes nor loses any."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray, IntArray
from replay.effects.output import Vector

GAP_S: Final = 0.5
"""A flow that stops for less is the same flow: a glass held at its greatest tilt goes on dribbling with the tremor of
the hand. With 0.3 s one pour of twelve came out as two."""


@dataclass(frozen=True)
class Transfer:
    """Liquid that left a vessel by one frame."""

    # frame, time: when, ``time`` in seconds since the session's first frame
    frame: int
    time: float
    # source, target: vessels; target ``""``: it was spilled
    source: str
    target: str
    volume_ml: float  # above 0
    point: Vector  # world metres, where it left the source, or where it landed if it was spilled


@dataclass(frozen=True)
class Liquids:
    """What one effect moved, for those that need it."""

    initial_ml: Mapping[str, float]  # vessel -> volume at the first frame, of every vessel it speaks of
    transfers: tuple[Transfer, ...]  # in order of time


@dataclass
class Ledger:
    """Volumes by vessel in millilitres, and what was spilled; their sum stays as it was."""

    volume_ml: dict[str, float]
    spilled_ml: float = 0.0
    transfers: list[Transfer] = field(default_factory=list)

    def move(self, transfer: Transfer) -> None:
        """Book a transfer; a target that is not in the ledger begins empty."""
        self.volume_ml[transfer.source] -= transfer.volume_ml
        if transfer.target:
            self.volume_ml[transfer.target] = self.volume_ml.get(transfer.target, 0.0) + transfer.volume_ml
        else:
            self.spilled_ml += transfer.volume_ml
        self.transfers.append(transfer)


def flows(transfers: Iterable[Transfer], least_ml: float, gap_s: float = GAP_S) -> list[tuple[Transfer, ...]]:
    """Transfers of one source and target that follow each other within ``gap_s``; less than ``least_ml`` is no flow."""
    running: dict[tuple[str, str], list[list[Transfer]]] = {}
    for one in transfers:
        parts = running.setdefault((one.source, one.target), [])
        if parts and one.time - parts[-1][-1].time <= gap_s:
            parts[-1].append(one)
        else:
            parts.append([one])
    found = [tuple(part) for parts in running.values() for part in parts if total_ml(part) >= least_ml]
    return sorted(found, key=lambda part: (part[0].frame, part[0].source, part[0].target))


def total_ml(transfers: Iterable[Transfer]) -> float:
    """Their volumes together."""
    return sum(one.volume_ml for one in transfers)


@dataclass
class Contents:
    """What is in a vessel."""

    volume_ml: float = 0.0  # of the liquid
    # formula -> mol dissolved, as brought: what has become of them is a reaction's affair
    amounts: dict[str, float] = field(default_factory=dict)
    solids: dict[str, float] = field(default_factory=dict)  # formula -> mol that stay when liquid is poured off

    def taken(self, volume_ml: float) -> dict[str, float]:
        """Take a part out; formula -> mol that go with it. Taking all leaves exactly nothing."""
        if volume_ml >= self.volume_ml:
            parts, self.volume_ml, self.amounts = self.amounts, 0.0, dict.fromkeys(self.amounts, 0.0)
            return parts
        share = volume_ml / self.volume_ml
        parts = {formula: share * amount for formula, amount in self.amounts.items()}
        for formula, part in parts.items():
            self.amounts[formula] -= part
        self.volume_ml -= volume_ml
        return parts

    def add(self, volume_ml: float, parts: Mapping[str, float]) -> None:
        """Mix something in; volumes add."""
        self.volume_ml += volume_ml
        for formula, part in parts.items():
            self.amounts[formula] = self.amounts.get(formula, 0.0) + part


@dataclass(frozen=True, eq=False)
class History:
    """One vessel, a row wherever it changed, and at the first and last time."""

    # times, frames: (n,)
    times: FloatArray
    frames: IntArray
    # volume_ml, added_ml: (n,) what is in it, and all that ever came in
    volume_ml: FloatArray
    added_ml: FloatArray
    amounts: Mapping[str, FloatArray]  # formula -> (n,) mol, as brought

    def amount(self, formula: str) -> FloatArray:
        """(n,) mol; zeros for what never was in it."""
        return self.amounts.get(formula, np.zeros(len(self.times)))


@dataclass(frozen=True)
class Load:
    """A transfer, what it carried, and what the target was like just before."""

    transfer: Transfer
    amounts: Mapping[str, float]
    # before_ml, before: volume and amounts of the target
    before_ml: float
    before: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class Mixture:
    """What became of all vessels."""

    histories: Mapping[str, History]  # vessel -> history
    loads: tuple[Load, ...]  # in order of time


def mixture(initial: Mapping[str, Contents], transfers: Iterable[Transfer], times: FloatArray) -> Mixture:
    """Follow transfers in order of time; ``times`` (T,) are those of the frames."""
    there = {name: Contents(one.volume_ml, dict(one.amounts), dict(one.solids)) for name, one in initial.items()}
    logs = {name: _History(contents) for name, contents in there.items()}
    loads: list[Load] = []
    for name, log in logs.items():
        if len(times):
            log.note(0, float(times[0]), there[name])
    for one in sorted(transfers, key=lambda transfer: transfer.frame):
        parts = there[one.source].taken(one.volume_ml)
        target = there[one.target] if one.target else Contents()
        loads.append(Load(one, parts, target.volume_ml, dict(target.amounts)))
        target.add(one.volume_ml, parts)
        logs[one.source].note(one.frame, one.time, there[one.source])
        if one.target:
            logs[one.target].added_ml += one.volume_ml
            logs[one.target].note(one.frame, one.time, target)
    for name, log in logs.items():
        if len(times):
            log.note(len(times) - 1, float(times[-1]), there[name])
    return Mixture({name: log.history() for name, log in logs.items()}, tuple(loads))


class _History:
    def __init__(self, contents: Contents) -> None:
        self.rows: dict[int, tuple[float, float, float, dict[str, float]]] = {}
        self.solids, self.added_ml = contents.solids, 0.0

    def note(self, frame: int, time: float, contents: Contents) -> None:
        self.rows[frame] = (time, contents.volume_ml, self.added_ml, {**contents.amounts, **self.solids})

    def history(self) -> History:
        rows = list(self.rows.values())
        formulas = dict.fromkeys(formula for row in rows for formula in row[3])
        amounts = {formula: np.array([row[3].get(formula, 0.0) for row in rows]) for formula in formulas}
        columns = [np.array([row[k] for row in rows], dtype=np.float64) for k in range(3)]
        return History(columns[0], np.array(list(self.rows), dtype=np.int64), columns[1], columns[2], amounts)
