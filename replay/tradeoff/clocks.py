"""Honest time: the clock stands outside the detector, online ones get one frame after the other, in order."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdcore import Detection, Detector, Motion, join
from replay.audit.wilson import Z95, share

BUDGET_MS = 1000.0 / 90.0
"""One frame at 90 Hz."""


@dataclass(frozen=True, eq=False)
class Pass:
    """One pass of a detector over a motion.

    Parameters
    ----------
    seconds : wall clock of the whole pass; of an online detector the sum over its frames.
    frames : (T,) seconds of every frame of an online detector; ``None`` of one that sees the whole motion at once.
    """

    seconds: float
    frames: NDArray[np.float64] | None


def timed(detector: Detector, motion: Motion, *, faces: bool) -> tuple[Detection, Pass]:
    """Detect once and say what it took: frame by frame where the detector decides so, else in one piece."""
    if not detector.online:
        began = perf_counter()
        detection = detector.detect(motion, faces=faces)
        return detection, Pass(perf_counter() - began, None)
    parts, seconds = [], np.zeros(len(motion))
    answers = detector.stream(iter([motion.frames(k, k + 1) for k in range(len(motion))]), faces=faces)
    for frame in range(len(motion)):
        began = perf_counter()
        part = next(answers)
        seconds[frame] = perf_counter() - began
        parts.append(part)
    return join(parts), Pass(float(seconds.sum()), seconds)


def figures(passes: list[Pass]) -> dict[str, Any]:
    """Milliseconds of one or several passes as plain data.

    ``ms_per_frame`` is the median pass, ``ms_low`` and ``ms_high`` the quickest and slowest; of online detectors there
    are also quantiles over all frames of all passes with intervals of their order statistics, and the share of frames
    over the budget of 90 Hz.

    Raises
    ------
    ValueError
        No pass.
    """
    frames = [one.frames for one in passes if one.frames is not None]
    seconds = [one.seconds for one in passes]
    told: dict[str, Any] = {"passes": len(passes), "seconds": float(np.median(seconds))}
    told |= {"seconds_low": min(seconds), "seconds_high": max(seconds)}
    pooled = np.sort(np.concatenate(frames)) * 1e3 if frames else None
    for name, level in (("p50", 0.50), ("p95", 0.95), ("p99", 0.99)):
        middle, low, high = (None, None, None) if pooled is None else quantile(pooled, level)
        told |= {f"{name}_ms": middle, f"{name}_low": low, f"{name}_high": high}
    over = None if pooled is None else share(int((pooled > BUDGET_MS).sum()), len(pooled))
    keys = ("share", "low", "high")
    return told | {f"over_{key}": None if over is None else over[key] for key in keys}


def quantile(ordered: NDArray[np.float64], level: float) -> tuple[float, float, float]:
    """A quantile of ordered values and its 95 % interval, whatever their distribution.

    Source: order statistics, W. J. Conover, Practical Nonparametric Statistics, 3rd ed. 1999, section 3.2.

    Examples
    --------
    >>> quantile(np.arange(1.0, 101.0), 0.5)
    (50.0, 40.0, 61.0)
    """
    count = len(ordered)
    middle, half = level * count, Z95 * sqrt(count * level * (1 - level))
    at = [int(np.ceil(place)) - 1 for place in (middle, middle - half, middle + half + 1)]
    found = [float(ordered[min(max(k, 0), count - 1)]) for k in at]
    return found[0], found[1], found[2]
