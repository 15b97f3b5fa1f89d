"""Taps of a known depth and duration, planted between two tests of a slow detector."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sessions.synthetic.looks import looks
from sessions.synthetic.paths import Tap, knock_interval
from sessions.synthetic.truth import Interval, Pair, PlantedEpisode, levelled

SLOW_RATE_HZ = 22.5


@dataclass(frozen=True)
class Dent:
    """How a tap goes in: ``depth`` metres beyond first contact, in contact for ``seconds``.

    ``amplitude`` is the whole way out, so ``amplitude - depth`` lies between the resting place and first contact.
    """

    depth: float
    seconds: float
    amplitude: float

    @property
    def period(self) -> float:
        """Duration of the whole knock: sin^2 is beyond 1 - depth / amplitude for this share of it."""
        share = 2.0 / math.pi * math.asin(math.sqrt(self.depth / self.amplitude))
        return self.seconds / share

    @property
    def apart(self) -> float:
        """How far from first contact the body rests before and after."""
        return self.amplitude - self.depth

    def intervals(self, tap: Tap, level: float) -> list[Interval]:
        """When the tapping body is at most ``level`` short of contact."""
        share = knock_interval((self.apart - level) / self.amplitude)
        return [] if share is None else [(tap.start + share[0] * tap.period, tap.start + share[1] * tap.period)]

    def episodes(
        self, pair: Pair, tap: Tap, blur: float, clock: tuple[float, float], note: str
    ) -> list[PlantedEpisode]:
        """The episode this tap plants; see `levelled` for ``blur`` and ``clock``."""
        found = levelled(pair, "contact", lambda level: self.intervals(tap, level), blur, 0.0, clock)
        return [replace(episode, note=note) for episode in found]


@dataclass(frozen=True, eq=False)
class Blinks:
    """The times between the looks of a slow detector, as recorded: ``latency_s`` later than a pose happens.

    ``frames`` (T,) are the seconds of all recorded frames.
    """

    frames: NDArray[np.float64]
    latency_s: float

    def centre(self, earliest: float, half_width: float) -> float:
        """Time of the first motion, not before ``earliest``, that is recorded on a frame midway between two looks.

        From it to either look lies at least ``half_width`` seconds. ValueError where the recording ends before.
        """
        rows = looks(np.rint(self.frames * 1e9).astype(np.int64), SLOW_RATE_HZ)
        seen = self.frames[rows]
        for k in range(int(np.searchsorted(seen, earliest + self.latency_s)), len(rows) - 1):
            between = self.frames[rows[k] + 1 : rows[k + 1]]
            room = np.minimum(between - seen[k], seen[k + 1] - between)
            if room.max(initial=-np.inf) > half_width:
                return float(between[room.argmax()]) - self.latency_s
        raise ValueError(f"no frame after {earliest} s lies {half_width} s from both looks; lengthen the session")
