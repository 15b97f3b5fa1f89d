"""Velocities from local parabolas on true stamps: at least five samples, none across a gap, none just after a loss.

A difference of two samples of a tracker with 0.3 mm of noise at 90 Hz is off by 40 mm/s; a parabola through nine of
them by a few. Differs from a Savitzky-Golay filter in that the stamps need not be evenly spaced.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.polynomial.polynomial import polyder, polyfit, polyval

from cdcore.numerics import BoolArray, IntArray
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

    def position(self, time: float) -> FloatArray:
        """(k,)."""
        return np.asarray(polyval(time - self.at, self.coefficients))

    def velocity(self, time: float) -> FloatArray:
        """(k,)."""
        return np.asarray(polyval(time - self.at, polyder(self.coefficients)))


def fit_parabola(times: FloatArray, points: FloatArray) -> Parabola:
    """The least-squares parabola through n >= 5 samples (n,) and (n, k), centred on the last one."""
    centre_time = float(times[-1])
    coefficients = np.asarray(polyfit(times - centre_time, points, 2), dtype=np.float64)
    residuals = polyval(times - centre_time, coefficients).T - points
    return Parabola(centre_time, coefficients, float(np.sqrt((residuals * residuals).sum(axis=1).mean())))


def settled_runs(times: FloatArray, valid: BoolArray, linked: BoolArray) -> IntArray:
    """A number per frame, (T,): equal within a stretch of known path, -1 where there is no pose or it still drifts.

    A stretch begins at a frame whose path from the one before is not known. Where it follows a loss, a gap or a jump,
    its first ``SETTLE_S`` seconds count as drifting; at the begin of the recording nothing was lost.
    """
    run_of_frame = np.where(valid, np.cumsum(~linked), -1)
    for row in np.flatnonzero(~linked[1:] & valid[1:]) + 1:
        run_of_frame[row : np.searchsorted(times, times[row] + SETTLE_S)] = -1
    return run_of_frame


def rows_before(runs: IntArray, frame: int) -> IntArray:
    """The last frames up to ``frame`` of its stretch, nine at most; fewer than five count as none."""
    frames_before = np.arange(max(0, frame - 2 * HALF_WINDOW), frame + 1)
    is_same_run = np.logical_and.accumulate(runs[frames_before][::-1] == runs[frame])[::-1]
    frames_before = frames_before[is_same_run & (runs[frame] >= 0)]
    return frames_before if len(frames_before) >= LEAST_SAMPLES else frames_before[:0]


def velocities(times: FloatArray, points: FloatArray, runs: IntArray, frames: IntArray) -> FloatArray:
    """Velocity (n, k) at frames (n,) from the nine samples around each that belong to its stretch; NaN below five."""
    offsets = np.arange(-HALF_WINDOW, HALF_WINDOW + 1)
    nearby_frames = frames[:, None] + offsets
    rows = np.clip(nearby_frames, 0, len(times) - 1)
    is_in_run = (nearby_frames == rows) & (runs[rows] == runs[frames, None]) & (runs[frames, None] >= 0)
    seconds_from_centre = np.where(is_in_run, times[rows] - times[frames, None], 0.0)
    power_terms = is_in_run[..., None] * seconds_from_centre[..., None] ** np.arange(3)
    # The least-squares parabola of each frame; what is outside weighs nothing.
    fit_coefficients = np.linalg.pinv(power_terms) @ np.where(is_in_run[..., None], points[rows], 0.0)
    return np.where(is_in_run.sum(axis=1)[:, None] >= LEAST_SAMPLES, fit_coefficients[:, 1], np.nan)
