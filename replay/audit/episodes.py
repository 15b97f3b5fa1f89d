"""A contact is an episode: a stretch of frames without a frame between in which the pair is not in contact."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cdcore import Detection
from cdcore.protocol import counts_as_contact
from replay.audit.outcome import Episode


@dataclass(frozen=True, eq=False)
class Runs:
    """Maximal stretches of True down the columns of a table.

    Parameters
    ----------
    column, first, last : (n,) int64, both ends included; sorted by first, then column.
    """

    column: NDArray[np.int64]
    first: NDArray[np.int64]
    last: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.column)


def runs(mask: NDArray[np.bool_]) -> Runs:
    """Maximal stretches of True down the columns of a (T, P) table."""
    return joined_runs(column_runs(mask[:, column], column) for column in range(mask.shape[1]))


def column_runs(mask: NDArray[np.bool_], column: int) -> Runs:
    """Maximal stretches of True in one column (T,)."""
    change = np.diff(mask.astype(np.int8), prepend=0, append=0)
    first = np.flatnonzero(change == 1)
    return Runs(np.full(len(first), column, dtype=np.int64), first, np.flatnonzero(change == -1) - 1)


def joined_runs(parts: Iterable[Runs]) -> Runs:
    """Stretches of several columns in order of time, then column."""
    found = list(parts) or [Runs(*(np.zeros(0, dtype=np.int64) for _ in range(3)))]
    column, first, last = (
        np.concatenate([getattr(part, name) for part in found]) for name in ("column", "first", "last")
    )
    order = np.lexsort((column, first))
    return Runs(column[order], first[order], last[order])


def episodes(detection: Detection) -> tuple[Episode, ...]:
    """Every contact of a detection, in order of time, then pair.

    Nothing is bridged: a single frame without contact, or without a pose, ends an episode. Flicker of a resting contact
    is a finding about the recording or the detector, and hysteresis belongs to effects.
    """
    # Column by column: a table of flags for hours of frames would double the memory that the verdicts take.
    verdict = detection.verdict
    found = joined_runs(column_runs(counts_as_contact(verdict[:, p]), p) for p in range(verdict.shape[1]))
    times = detection.times
    return tuple(
        Episode(pair, first, last, float(times[first]), float(times[last]))
        for pair, first, last in zip(found.column.tolist(), found.first.tolist(), found.last.tolist(), strict=True)
    )
