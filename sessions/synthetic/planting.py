"""Taps of a known depth and duration."""

import math
from dataclasses import dataclass, replace

from sessions.synthetic.paths import Tap, knock_interval
from sessions.synthetic.truth import Interval, Pair, PlantedEpisode, levelled


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
