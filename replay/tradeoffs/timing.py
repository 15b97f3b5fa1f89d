"""Timing from outside the detector: the whole motion at once, and of an online one each frame, one after the other."""

from dataclasses import dataclass
from math import sqrt
from time import perf_counter, process_time
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdcore import Detection, Detector, Motion, detect_live
from replay.base.constants import BUDGET_MS
from replay.base.wilson import Z95, wilson

LEVELS: Final = {"p50": 0.50, "p95": 0.95, "p99": 0.99}

OF_FRAMES: Final = (
    *(f"{name}_{what}" for name in LEVELS for what in ("ms", "low", "high")),
    "p99_all_ms", "over_share", "over_low", "over_high",
)  # fmt: skip
"""Figures of detectors that are timed frame by frame."""


@dataclass(frozen=True, eq=False)
class Pass:
    """Wall clock of one pass over a motion, and seconds that this process was at work meanwhile.

    ``frames`` (T,) are seconds of every frame, in a pass of its own; ``None`` of one that sees all at once only.
    """

    seconds: float
    frames: NDArray[np.float64] | None
    processor: float


def timed(detector: Detector, motion: Motion, *, faces: bool) -> tuple[Detection, Pass]:
    """Detect in one call and measure the time; then ask an online detector frame by frame too, without faces."""
    at_work, began = process_time(), perf_counter()
    detection = detector.detect(motion, faces=faces)
    seconds, at_work = perf_counter() - began, process_time() - at_work
    if not detector.online:
        return detection, Pass(seconds, None, at_work)
    stages = np.array(list(detect_live(detector, motion).seconds.values()))
    return detection, Pass(seconds, stages.sum(axis=0), at_work)


def figures(passes: list[Pass]) -> dict[str, Any]:
    """Milliseconds of one or several passes as plain data.

    ``seconds`` is the quickest pass: every pass does the same work, and other processes can only add to it;
    ``seconds_median`` and ``seconds_high`` say how much they did. For online detectors ``p50_ms``, ``p95_ms`` and
    ``p99_ms`` are over the quickest pass of each frame (else a p99 shows only a scheduler that switches every 4 ms);
    ``p99_all_ms`` and the share of frames over the budget are over all passes. Intervals are those of one pass: the
    same frames once more are no new frames.

    Source: best of repeated runs as in M. Aumueller, E. Bernhardsson, A. Faithfull, ANN-Benchmarks, Information Systems
    87 (2020).

    Raises ``ValueError``: no pass.
    """
    frames = [one.frames for one in passes if one.frames is not None]
    seconds = [one.seconds for one in passes]
    of_frames = _of_frames(np.stack(frames) * 1e3) if frames else dict.fromkeys(OF_FRAMES)
    return {
        "passes": len(passes), "seconds": min(seconds), "seconds_median": float(np.median(seconds)),
        "seconds_high": max(seconds), "processor_seconds": min(one.processor for one in passes), **of_frames,
    }  # fmt: skip


def _of_frames(ms: NDArray[np.float64]) -> dict[str, float]:
    """Quantiles of the quickest pass of each frame, and what all passes (k, T) say."""
    best = np.sort(ms.min(axis=0))
    late = float((ms > BUDGET_MS).sum(axis=1).mean())
    quantiles = [value for level in LEVELS.values() for value in quantile(best, level)]
    every = quantile(np.sort(ms, axis=None), 0.99)[0]
    values = (*quantiles, every, late / ms.shape[1], *wilson(late, ms.shape[1]))
    return dict(zip(OF_FRAMES, values, strict=True))


def quantile(ordered: NDArray[np.float64], level: float) -> tuple[float, float, float]:
    """A quantile of ordered values and its 95 % interval, whatever their distribution.

    Source: order statistics, W. J. Conover, Practical Nonparametric Statistics, 3rd ed. 1999, section 3.2.

    Examples
    --------
    >>> quantile(np.arange(1.0, 101.0), 0.5)
    (50.0, 41.0, 61.0)
    """
    count = len(ordered)
    middle, half = level * count, Z95 * sqrt(count * level * (1 - level))
    at = [int(np.ceil(place)) - 1 for place in (middle, middle - half, middle + half + 1)]
    found = [float(ordered[min(max(k, 0), count - 1)]) for k in at]
    return found[0], found[1], found[2]
