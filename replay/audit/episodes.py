"""A contact is an episode: a stretch of frames without a frame between in which the pair is not in contact."""

from __future__ import annotations

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
    border = np.zeros((1, mask.shape[1]), dtype=np.int8)
    change = np.diff(np.concatenate([border, mask.view(np.int8), border]), axis=0)
    # Column by column, begins and ends alternate: the k-th of one belongs to the k-th of the other.
    column, first = np.nonzero(change.T == 1)
    _, stop = np.nonzero(change.T == -1)
    order = np.lexsort((column, first))
    return Runs(column[order], first[order], stop[order] - 1)


def episodes(detection: Detection) -> tuple[Episode, ...]:
    """Every contact of a detection, in order of time, then pair.

    Nothing is bridged: a single frame without contact, or without a pose, ends an episode. Flicker of a resting contact
    is a finding about the recording or the detector, and hysteresis belongs to effects.
    """
    found = runs(counts_as_contact(detection.verdict))
    times = detection.times
    return tuple(
        Episode(pair, first, last, float(times[first]), float(times[last]))
        for pair, first, last in zip(found.column.tolist(), found.first.tolist(), found.last.tolist(), strict=True)
    )
