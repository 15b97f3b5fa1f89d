"""Mean, standard deviation and variance, each under its own name, with how sure the mean is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from sessions.synthetic.streams import random_stream

RESAMPLES: Final = 1000


@dataclass(frozen=True)
class Spread:
    """What n values are like: ``sd`` and ``variance`` divide by n - 1; ``low`` to ``high`` holds the mean at 95 %."""

    n: int
    mean: float
    low: float
    high: float
    sd: float
    variance: float


def spread(values: Sequence[float], seed: int = 0) -> Spread:
    """The spread of one value or more; the interval is a percentile bootstrap of ``RESAMPLES`` draws.

    Raises
    ------
    ValueError
        There is no value.

    Examples
    --------
    >>> spread([1.0, 3.0]).variance
    2.0
    """
    if not len(values):
        raise ValueError("nothing was measured; give one value or more")
    given = np.asarray(values, dtype=np.float64)
    draws = random_stream(seed, "paper/bootstrap").integers(0, len(given), size=(RESAMPLES, len(given)))
    low, high = np.quantile(given[draws].mean(axis=1), [0.025, 0.975])
    variance = float(given.var(ddof=1)) if len(given) > 1 else 0.0
    return Spread(len(given), float(given.mean()), float(low), float(high), variance**0.5, variance)


def quartiles(values: Sequence[float]) -> tuple[float, float, float]:
    """Lower quartile, median, upper quartile."""
    low, middle, high = np.quantile(np.asarray(values, dtype=np.float64), [0.25, 0.5, 0.75])
    return float(low), float(middle), float(high)
