"""One coordinate as a formula of time, and the times at which the formula lies between two values."""

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from sessions.geometry.rotations import Array
from sessions.synthetic.truth import Interval


@dataclass(frozen=True)
class Swing:
    """middle + amplitude cos(2 pi (t - start) / period), with a positive amplitude."""

    middle: float
    amplitude: float
    period: float
    start: float = 0.0

    def __call__(self, times: Array) -> Array:
        """Value at each time."""
        return self.middle + self.amplitude * np.cos(2.0 * np.pi * (times - self.start) / self.period)

    def between(self, lower: float, upper: float, seconds: float) -> list[Interval]:
        """Intervals by the arc cosine, period by period."""
        upper_cosine, lower_cosine = (upper - self.middle) / self.amplitude, (lower - self.middle) / self.amplitude
        if upper_cosine < -1.0 or lower_cosine > 1.0 or lower > upper:
            return []
        first = math.acos(min(1.0, upper_cosine)) / (2.0 * math.pi)
        last = math.acos(max(-1.0, lower_cosine)) / (2.0 * math.pi)
        last_period = math.ceil((seconds - self.start) / self.period)
        periods = range(math.floor(-self.start / self.period) - 1, last_period + 1)
        spans = [span for k in periods for span in ((k + first, k + last), (k + 1 - last, k + 1 - first))]
        return joined_intervals(
            [(self.start + a * self.period, self.start + b * self.period) for a, b in spans], seconds
        )


@dataclass(frozen=True)
class Polyline:
    """Straight from value to value at the given times, held before the first and after the last."""

    times: tuple[float, ...]
    values: tuple[float, ...]

    def __call__(self, times: Array) -> Array:
        """Value at each time."""
        return np.interp(times, self.times, self.values)

    def between(self, lower: float, upper: float, seconds: float) -> list[Interval]:
        """Intervals segment by segment."""
        ends = ((0.0, self.values[0]), *zip(self.times, self.values, strict=True), (seconds, self.values[-1]))
        spans = []
        for (t0, v0), (t1, v1) in itertools.pairwise(ends):
            if v0 == v1:
                if lower <= v0 <= upper and t0 < t1:
                    spans.append((t0, t1))
                continue
            fractions = sorted(((lower - v0) / (v1 - v0), (upper - v0) / (v1 - v0)))
            start, end = max(0.0, fractions[0]), min(1.0, fractions[1])
            if start <= end and lower <= upper:
                spans.append((t0 + start * (t1 - t0), t0 + end * (t1 - t0)))
        return joined_intervals(spans, seconds)


MotionProfile = Swing | Polyline
"""A coordinate over time: called with times (n,) it gives values (n,).

``between(low, high, seconds)`` gives the maximal intervals within [0, seconds] in which the value lies between.
"""


def joined_intervals(spans: Iterable[Interval], seconds: float) -> list[Interval]:
    """Intervals clipped to [0, seconds], in order, touching ones made one."""
    result: list[Interval] = []
    for start, end in sorted(spans):
        start, end = max(0.0, start), min(seconds, end)
        if start > end:
            continue
        if result and start <= result[-1][1]:
            result[-1] = (result[-1][0], max(end, result[-1][1]))
        else:
            result.append((start, end))
    return result


def passes(speeds: Sequence[float], rests: Sequence[float], reach: float) -> Polyline:
    """Passes from +reach to -reach and back at these speeds, each after a rest of these seconds."""
    times, values, now, side = [0.0], [reach], 0.0, 1.0
    for speed, rest in zip(speeds, rests, strict=True):
        now += rest
        times.append(now)
        values.append(side * reach)
        now += 2.0 * reach / speed
        side = -side
        times.append(now)
        values.append(side * reach)
    return Polyline(tuple(times), tuple(values))
