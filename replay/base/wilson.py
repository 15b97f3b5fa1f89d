"""The interval behind every share that is printed: it stays within 0 and 1, and is not empty at 0 of n."""

from __future__ import annotations

from math import sqrt
from typing import Any, Final

Z95: Final = 1.959963984540054
"""Quantile of the normal distribution that leaves 2.5 % above: intervals are at 95 %."""


def wilson(count: float, of: float) -> tuple[float, float]:
    """Wilson's score interval at 95 % of the share ``count / of``; nothing was counted: anything from 0 to 1.

    Source: E. B. Wilson, Probable inference, the law of succession, and statistical inference, JASA 22 (1927), 209-212.

    Examples
    --------
    >>> low, high = wilson(0, 10)
    >>> low, round(high, 4)
    (0.0, 0.2775)
    """
    if of <= 0:
        return 0.0, 1.0
    share, spread = count / of, Z95 * Z95 / of
    middle = share + spread / 2
    half = Z95 * sqrt((share * (1 - share) + spread / 4) / of)
    low, high = (middle - half) / (1 + spread), (middle + half) / (1 + spread)
    return (0.0 if count == 0 else max(0.0, low)), (1.0 if count == of else min(1.0, high))


def share(count: int, of: int) -> dict[str, Any]:
    """A share as plain data: ``count``, ``of``, ``share`` (null of nothing), ``low`` and ``high`` at 95 %."""
    low, high = wilson(count, of)
    return {"count": count, "of": of, "share": count / of if of else None, "low": low, "high": high}
