"""The offset of another clock: the shift at which most reported begins and ends fall on true ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from replay.errors import AuditError

WINDOW: Final = 0.05
"""Seconds within which differences support the same shift: four frames at 90 Hz, the delay of a slow engine."""

Moments = Mapping[tuple[str, str, str], Sequence[float]]
"""(body, body, ``begin`` or ``end``), names sorted -> seconds."""


@dataclass(frozen=True)
class ClockOffset:
    """What to add to the other clock.

    Parameters
    ----------
    seconds : added to its stamps.
    residual : the middle 95 % of the reports that found a partner lie within this many seconds of it after that.
    matched, of : reports that found a partner, and reports there are.
    """

    seconds: float
    residual: float
    matched: int
    of: int

    def __str__(self) -> str:
        return (
            f"clock offset {self.seconds:+.4f} s, residual {1e3 * self.residual:.1f} ms, "
            f"{self.matched} of {self.of} begins and ends found their partner"
        )


def estimate_offset(reported: Moments, truth: Moments, offset: float | None = None) -> ClockOffset:
    """Estimate the offset of a clock from the begins and ends of contacts that two sides report.

    A constant delay of the engine and an offset of its clock have the same effect: the estimate is their sum. Contacts
    that come at equal intervals support several shifts equally; of those the smallest is taken.

    Parameters
    ----------
    reported, truth : moments per pair and kind, each on its own clock.
    offset : take this one, and only say how well it fits.

    Raises ``AuditError``: no pair is on both sides, so that nothing can be estimated.
    """
    total = sum(map(len, reported.values()))
    # True minus reported seconds, (reported, true), for every pair and kind.
    both = ((np.array(moments, dtype=np.float64), truth.get(key, ())) for key, moments in reported.items())
    every = [np.array(true, dtype=np.float64)[None] - said[:, None] for said, true in both]
    differences = np.sort(np.concatenate([part.ravel() for part in every])) if every else np.zeros(0)
    if offset is None:
        if not len(differences):
            raise AuditError(
                "no reported contact is of a pair that truly touches, so its clock cannot be estimated; "
                "check the body names, or say the offset with --offset SECONDS"
            )
        offset = _densest(differences)
    left = np.concatenate([np.zeros(0), *(_nearest(part, offset) for part in every)])
    held = np.abs(left[np.abs(left) <= WINDOW])
    return ClockOffset(offset, float(np.quantile(held, 0.95)) if len(held) else 0.0, len(held), total)


def _densest(differences: NDArray[np.float64]) -> float:
    """The middle of the window that holds most differences; of equal ones the nearest to no shift at all."""
    count = np.searchsorted(differences, differences + WINDOW, side="right") - np.arange(len(differences))
    best = np.flatnonzero(count == count.max())
    middle = [float(np.median(differences[k : k + count[k]])) for k in best.tolist()]
    return min(middle, key=abs)


def _nearest(table: NDArray[np.float64], offset: float) -> NDArray[np.float64]:
    """What is left of each report's best difference after the shift."""
    if not table.size:
        return np.zeros(0)
    left = table - offset
    nearest: NDArray[np.float64] = left[np.arange(len(left)), np.abs(left).argmin(axis=1)]
    return nearest
