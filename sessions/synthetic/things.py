"""What becomes of a thing on the bench: it stands, is held, falls; each phase begins at a stamp and gives a pose."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sessions.geometry.rotations import IDENTITY, Array
from sessions.synthetic.experiments.pouring import GRAVITY
from sessions.synthetic.paths import Poses, carried

PosesAt = Callable[[Array, Mapping[str, Poses]], Poses]
"""Times (n,) of the recorded clock and the recorded poses of the hands at them -> poses of the thing."""


@dataclass(frozen=True)
class Standing:
    """It stays where it is."""

    position: ArrayLike
    quaternion: ArrayLike = IDENTITY

    def __call__(self, times: Array, _hands: Mapping[str, Poses]) -> Poses:
        """Poses at these times."""
        return np.tile(self.position, (len(times), 1)), np.tile(self.quaternion, (len(times), 1))


@dataclass(frozen=True)
class Held:
    """It rides on a hand: its pose in the hand's frame is constant."""

    hand: str
    offset: ArrayLike
    turn: ArrayLike = IDENTITY

    def __call__(self, _times: Array, hands: Mapping[str, Poses]) -> Poses:
        """Poses at these times."""
        return carried(hands[self.hand], self.offset, self.turn)


@dataclass(frozen=True)
class Falling:
    """It falls freely from rest at ``start`` down to the height ``floor`` and stays there."""

    start: float
    position: Array
    quaternion: Array
    floor: float

    def time_at(self, height: float) -> float:
        """When it passes a height between where it starts and ``floor``."""
        return self.start + float(np.sqrt(2.0 * (self.position[1] - height) / GRAVITY))

    def speed_at(self, height: float) -> float:
        """How fast it passes a height, m/s."""
        return float(np.sqrt(2.0 * GRAVITY * (self.position[1] - height)))

    def __call__(self, times: Array, _hands: Mapping[str, Poses]) -> Poses:
        """Poses at these times."""
        place, turn = Standing(self.position, self.quaternion)(times, _hands)
        place[:, 1] = np.maximum(self.floor, place[:, 1] - 0.5 * GRAVITY * (times - self.start) ** 2)
        return place, turn


def placed_by(phases: Sequence[tuple[float, PosesAt]], times: Array, hands: Mapping[str, Poses]) -> Poses:
    """Poses (n, 3) and (n, 4) of a thing at all frames; each phase (start, placing) lasts until the next one starts."""
    position, quaternion = phases[0][1](times, hands)
    for start, placing in phases[1:]:
        begun = (times >= start)[:, None]
        later = placing(times, hands)
        position, quaternion = np.where(begun, later[0], position), np.where(begun, later[1], quaternion)
    return position, quaternion
