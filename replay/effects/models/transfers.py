"""Liquid on its way from one vessel to another, and the ledger that neither makes nor loses any."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final

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
