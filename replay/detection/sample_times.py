"""The frames on which a detector runs, and the quantiles of its time over them: one definition for every output."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdcore.numerics import BoolArray, FloatArray
from cdcore.protocol import ZeroOrderHold

P99: Final = 0.99
"""Quantile of the time of a sample that 1 in 100 samples exceeds."""


def sampled_frames(times: FloatArray, rate_hz: float | None, sampling_offset_s: float = 0.0) -> BoolArray:
    """Return the frames (T,) on which a detector of a rate runs: those at its ticks; all frames without a rate.

    In the frames between, a detector only repeats its last answer: 99 of 100 frames of a detector at 0.5 Hz take
    nothing, so they are in no quantile.
    """
    is_sampled: BoolArray = ZeroOrderHold(0, rate_hz, sampling_offset_s).sampled(times)
    return is_sampled


def sample_quantiles(seconds: NDArray[np.float64]) -> dict[str, float]:
    """Return the median, the 95th and 99th percentile and the maximum of the seconds of samples."""
    median, p95, p99, maximum = np.quantile(seconds, [0.5, 0.95, P99, 1.0]).tolist()
    return {"median": median, "p95": p95, "p99": p99, "max": maximum}
