"""Velocities from local parabolas on true stamps: at least five samples, none across a gap, none just after a loss.

A difference of two samples of a tracker with 0.3 mm of noise at 90 Hz is off by 40 mm/s; a parabola through nine of
them by a few. Differs from a Savitzky-Golay filter in that the stamps need not be evenly spaced.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from replay.effects.output import FloatArray

LEAST_SAMPLES: Final = 5
"""A parabola has three coefficients: with five samples two are left to average the noise and to notice a misfit."""

HALF_WINDOW: Final = 4
"""Samples on each side: nine in all, 100 ms at 90 Hz, in which a hand's motion is a parabola to a millimetre."""

SETTLE_S: Final = 0.3
"""After a loss or a jump a tracker's pose drifts back: 5-30 mm that fall by 1/e in 60 ms reach its noise of 0.3 mm in
0.3 s. Samples from there are no evidence of a velocity. Source: Niehorster et al. 2017 (re-entry steps)."""


@dataclass(frozen=True, eq=False)
class Parabola:
    """A fit ``place(t) = c0 + c1 (t - at) + c2 (t - at)^2`` in k dimensions."""

    at: float  # seconds
    coefficients: FloatArray  # (3, k)
    misfit: float  # root mean square distance of the samples from it

    def place(self, time: float) -> FloatArray:
        """(k,)."""
        u = time - self.at
        return np.asarray((self.coefficients[2] * u + self.coefficients[1]) * u + self.coefficients[0])

    def velocity(self, time: float) -> FloatArray:
        """(k,)."""
        return np.asarray(2.0 * self.coefficients[2] * (time - self.at) + self.coefficients[1])


def fitted(times: FloatArray, places: FloatArray) -> Parabola:
    """The least-squares parabola through n >= 5 samples (n,) and (n, k), centred on the last one."""
    at = float(times[-1])
    width = float(times[-1] - times[0])
    u = (times - at) / width
    basis = np.stack([np.ones_like(u), u, u * u], axis=1)
    scaled, *_ = np.linalg.lstsq(basis, places, rcond=None)
    away = basis @ scaled - places
    misfit = float(np.sqrt((away * away).sum(axis=1).mean()))
    return Parabola(at, scaled / np.array([1.0, width, width * width])[:, None], misfit)


def settled_runs(times: FloatArray, valid: NDArray[np.bool_], linked: NDArray[np.bool_]) -> NDArray[np.int64]:
    """A number per frame, (T,): equal within a stretch of known path, -1 where there is no pose or it still drifts.

    A stretch begins at a frame whose path from the one before is not known. Where it follows a loss, a gap or a jump,
    its first ``SETTLE_S`` seconds count as drifting; at the begin of the recording nothing was lost.
    """
    number = np.cumsum(~linked)
    runs = np.where(valid, number, -1)
    begins = np.flatnonzero(~linked & valid)
    for row in begins.tolist():
        if row:
            stop = int(np.searchsorted(times, times[row] + SETTLE_S))
            runs[row:stop] = -1
    return runs.astype(np.int64)


def before(runs: NDArray[np.int64], frame: int, most: int = 2 * HALF_WINDOW + 1) -> NDArray[np.int64]:
    """The last frames up to ``frame`` of its stretch, at most ``most``; fewer than five count as none."""
    rows = np.arange(max(0, frame - most + 1), frame + 1)
    same = runs[rows] == runs[frame]
    if runs[frame] < 0:
        return rows[:0]
    bad = np.flatnonzero(~same)
    rows = rows[bad[-1] + 1 :] if len(bad) else rows
    return rows if len(rows) >= LEAST_SAMPLES else rows[:0]


def velocities(times: FloatArray, places: FloatArray, runs: NDArray[np.int64], frames: NDArray[np.int64]) -> FloatArray:
    """Velocity (n, k) at frames (n,) from the nine samples around each that belong to its stretch; NaN below five."""
    offsets = np.arange(-HALF_WINDOW, HALF_WINDOW + 1)
    rows = np.clip(frames[:, None] + offsets, 0, max(0, len(times) - 1))
    inside = (frames[:, None] + offsets == rows) & (runs[rows] == runs[frames, None]) & (runs[frames] >= 0)[:, None]
    enough = inside.sum(axis=1) >= LEAST_SAMPLES
    velocity = np.full((len(frames), places.shape[1]), np.nan)
    if not enough.any():
        return velocity
    rows, inside, frames = rows[enough], inside[enough], frames[enough]
    u = np.where(inside, times[rows] - times[frames, None], 0.0)
    width = np.abs(u).max(axis=1, keepdims=True)
    powers = np.stack([np.where(inside, (u / width) ** k, 0.0) for k in range(3)], axis=2)
    here = np.where(inside[..., None], places[rows] - places[frames][:, None], 0.0)
    normal = np.einsum("tni,tnj->tij", powers, powers)
    velocity[enough] = np.linalg.solve(normal, np.einsum("tni,tnk->tik", powers, here))[:, 1] / width
    return velocity
