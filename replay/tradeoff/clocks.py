"""Honest time: the clock stands outside the detector, online ones get one frame after the other, in order."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from time import perf_counter, process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdcore import Detection, Detector, Motion, join
from replay.audit.wilson import Z95, wilson

BUDGET_MS = 1000.0 / 90.0
"""One frame at 90 Hz."""


@dataclass(frozen=True, eq=False)
class Pass:
    """One pass of a detector over a motion.

    Parameters
    ----------
    seconds : wall clock of the whole pass; of an online detector the sum over its frames.
    frames : (T,) seconds of every frame of an online detector; ``None`` of one that sees the whole motion at once.
    processor : seconds that this process was at work meanwhile; less than the wall clock where others were.
    """

    seconds: float
    frames: NDArray[np.float64] | None
    processor: float


def timed(detector: Detector, motion: Motion, *, faces: bool) -> tuple[Detection, Pass]:
    """Detect once and say what it took: frame by frame where the detector decides so, else in one piece."""
    at_work = process_time()
    if not detector.online:
        began = perf_counter()
        detection = detector.detect(motion, faces=faces)
        return detection, Pass(perf_counter() - began, None, process_time() - at_work)
    parts, seconds = [], np.zeros(len(motion))
    answers = detector.stream(iter([motion.frames(k, k + 1) for k in range(len(motion))]), faces=faces)
    for frame in range(len(motion)):
        began = perf_counter()
        part = next(answers)
        seconds[frame] = perf_counter() - began
        parts.append(part)
    at_work = process_time() - at_work
    return join(parts), Pass(float(seconds.sum()), seconds, at_work)


def figures(passes: list[Pass]) -> dict[str, Any]:
    """Milliseconds of one or several passes as plain data.

    ``seconds`` is the quickest pass, because the same work is done in every one and others on the machine can only add
    to it; ``seconds_median`` and ``seconds_high`` say how much they did. Of online detectors there are also quantiles
    over all frames of all passes, nothing left out, and the share of frames over the budget of 90 Hz. Their intervals
    are as wide as one pass makes them: the same frames once more are no new frames.

    Source: best of repeated runs as in M. Aumueller, E. Bernhardsson, A. Faithfull, ANN-Benchmarks, Information Systems
    87 (2020).

    Raises
    ------
    ValueError
        No pass.
    """
    frames = [one.frames for one in passes if one.frames is not None]
    seconds = [one.seconds for one in passes]
    told: dict[str, Any] = {"passes": len(passes), "seconds": min(seconds), "seconds_median": float(np.median(seconds))}
    told |= {"seconds_high": max(seconds), "processor_seconds": min(one.processor for one in passes)}
    pooled = np.sort(np.concatenate(frames)) * 1e3 if frames else None
    for name, level in (("p50", 0.50), ("p95", 0.95), ("p99", 0.99)):
        middle, low, high = (None, None, None) if pooled is None else quantile(pooled, level, passes=len(frames))
        told |= {f"{name}_ms": middle, f"{name}_low": low, f"{name}_high": high}
    if pooled is None:
        return told | dict.fromkeys(("over_share", "over_low", "over_high"))
    late = int((pooled > BUDGET_MS).sum())
    low, high = wilson(late / len(frames), len(pooled) / len(frames))
    return told | {"over_share": late / len(pooled), "over_low": low, "over_high": high}


def quantile(ordered: NDArray[np.float64], level: float, passes: int = 1) -> tuple[float, float, float]:
    """A quantile of ordered values and its 95 % interval, whatever their distribution.

    Parameters
    ----------
    ordered : (n,) ascending.
    level : share of the values below it.
    passes : how many times the same things were measured; the interval is that of ``n / passes`` values.

    Source: order statistics, W. J. Conover, Practical Nonparametric Statistics, 3rd ed. 1999, section 3.2.

    Examples
    --------
    >>> quantile(np.arange(1.0, 101.0), 0.5)
    (50.0, 40.0, 61.0)
    """
    count = len(ordered)
    middle, half = level * count, Z95 * sqrt(count * passes * level * (1 - level))
    at = [int(np.ceil(place)) - 1 for place in (middle, middle - half, middle + half + passes)]
    found = [float(ordered[min(max(k, 0), count - 1)]) for k in at]
    return found[0], found[1], found[2]
