"""A hand's script (go there, wait, tap: each step begins where and when the one before ended) and its buttons."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.geometry.rotations import IDENTITY, Array
from sessions.model.session import HandTrack
from sessions.synthetic.paths import (
    Key,
    KeyPath,
    Overlay,
    Tap,
    Tremor,
    minimum_jerk,
    minimum_jerk_inverse,
)
from sessions.synthetic.truth import Interval

# Slower than this a reach of an adult looks hesitant, faster it looks thrown: comfortable reaches of 0.2-0.6 m take
# 0.6-1.3 s.
REACH_SPEED = 0.45
SHORTEST_REACH_S = 0.35
TREMOR_M = 0.0002


PARTICIPANT = "student"

# From first movement to fully pressed. A press is planned so that it passes 0.6, the level at which a grasp counts,
# at the planned time.
PRESS_S = 0.12
GRASP_LEVEL, RELEASE_LEVEL = 0.6, 0.4


class Script:
    """Builds the path of one body step by step from where it rests at time 0.

    ``pace`` is a factor on the time that reaches take when no duration is given.
    """

    def __init__(self, position: ArrayLike, quaternion: ArrayLike = IDENTITY, *, pace: float = 1.0) -> None:
        self.pace = pace
        self._keys = [Key(0.0, position, quaternion)]
        self.overlays: list[Overlay] = []
        self.quiet: list[Interval] = []

    @property
    def now(self) -> float:
        """When it has come so far."""
        return self._keys[-1].time

    @property
    def position(self) -> Array:
        """The current position."""
        return np.asarray(self._keys[-1].position)

    @property
    def quaternion(self) -> Array:
        """How it is turned now."""
        return np.asarray(self._keys[-1].quaternion)

    def wait(self, seconds: float) -> None:
        """Rest."""
        self.wait_until(self.now + seconds)

    def wait_until(self, time: float) -> None:
        """Rest until a time; one that has passed changes nothing."""
        if time > self.now:
            self._keys.append(Key(time, self.position, self.quaternion))

    def go(
        self,
        position: ArrayLike,
        seconds: float | None = None,
        *,
        quaternion: ArrayLike | None = None,
        arc: float = 0.0,
        ease: str = "minimum-jerk",
    ) -> None:
        """Reach for a pose; without ``seconds`` in the time an unhurried person would take straight there."""
        if seconds is None:
            distance = float(np.linalg.norm(np.asarray(position) - self.position))
            seconds = self.pace * max(SHORTEST_REACH_S, distance / REACH_SPEED)
        rotation = self.quaternion if quaternion is None else quaternion
        self._keys.append(Key(self.now + seconds, position, rotation, ease, arc))

    def over(self, position: ArrayLike, height: float, *, quaternion: ArrayLike | None = None) -> None:
        """Go up to a height, across, and down, so that nothing lower than ``height`` is in the way."""
        x, y, z = np.asarray(position)
        x0, y0, z0 = self.position
        if y0 < height:
            self.go((x0, height, z0))
        self.go((x, max(height, y0), z), quaternion=quaternion)
        if y < height:
            self.go((x, y, z))

    def tap(self, tap: Tap) -> None:
        """Knock; before, the body rests where it is.

        ValueError where the knock would begin before the script has come this far.
        """
        if tap.start < self.now:
            raise ValueError(f"a knock from {tap.start} s begins before {self.now} s; plant it later")
        self.overlays.append(tap)
        self.quiet.append((tap.start, tap.start + tap.period))
        self.wait_until(tap.start + tap.period)

    def path(self, tremor: np.random.Generator) -> KeyPath:
        """The path so far, with tremor outside the windows that must be quiet."""
        return KeyPath(self._keys, [*self.overlays, Tremor(tremor, TREMOR_M, self.quiet)])


def controllers(presses: Mapping[str, Sequence[Interval]], stamps_ns: NDArray[np.int64]) -> Mapping[str, HandTrack]:
    """The reports of the controllers at the stamps; the first stamp is the zero of all times.

    ``presses``, by side: the trigger passes `GRASP_LEVEL` at the start of each and falls below `RELEASE_LEVEL` at its
    end. The grip follows the trigger at 0.9 of its way, as a closing hand does.
    """
    times = (stamps_ns - stamps_ns[0]) * 1e-9
    hands = {}
    for side, spans in presses.items():
        pressed = np.zeros_like(times)
        for start, end in spans:
            down = minimum_jerk((times - start) / PRESS_S + minimum_jerk_inverse(GRASP_LEVEL))
            up = minimum_jerk((end - times) / PRESS_S + minimum_jerk_inverse(RELEASE_LEVEL))
            pressed = np.maximum(pressed, np.minimum(down, up))
        trigger = np.round(pressed * 255.0) / 255.0
        hands[f"{PARTICIPANT}/{side}"] = HandTrack(stamps_ns, trigger, np.round(trigger * 0.9, 6))
    return hands
