"""A hand's script (go there, wait, tap: each step begins where and when the one before ended) and its buttons."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.geometry.rotations import IDENTITY
from sessions.model.track import HandTrack
from sessions.synthetic.paths import (
    Key,
    KeyPath,
    Overlay,
    Point,
    Quaternion,
    Tap,
    Tremor,
    minimum_jerk,
    minimum_jerk_inverse,
    point,
    quaternion_of,
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
        self.now = 0.0
        self.pace = pace
        self._keys = [Key(0.0, point(position), quaternion_of(quaternion))]
        self.overlays: list[Overlay] = []
        self.quiet: list[Interval] = []

    @property
    def position(self) -> Point:
        """Where it rests now."""
        return self._keys[-1].position

    @property
    def quaternion(self) -> Quaternion:
        """How it is turned now."""
        return self._keys[-1].quaternion

    def wait(self, seconds: float) -> None:
        """Rest."""
        self.wait_until(self.now + seconds)

    def wait_until(self, time: float) -> None:
        """Rest until a time; one that has passed changes nothing."""
        if time > self.now:
            self._append(time, self.position, self.quaternion)

    def go(
        self,
        position: ArrayLike,
        seconds: float | None = None,
        *,
        quaternion: ArrayLike | None = None,
        arc: float = 0.0,
        ease: str = "minimum-jerk",
    ) -> None:
        """Reach for a pose; without ``seconds`` in the time an unhurried person would take."""
        goal = point(position)
        if seconds is None:
            way = float(np.linalg.norm(np.asarray(goal) - np.asarray(self.position))) + 2.0 * abs(arc)
            seconds = self.pace * max(SHORTEST_REACH_S, way / REACH_SPEED)
        turn = self.quaternion if quaternion is None else quaternion_of(quaternion)
        self._append(self.now + seconds, goal, turn, ease, arc)

    def over(self, position: ArrayLike, height: float, *, quaternion: ArrayLike | None = None) -> None:
        """Go up to a height, across, and down, so that nothing lower than ``height`` is in the way."""
        x, y, z = point(position)
        x0, y0, z0 = self.position
        if y0 < height:
            self.go((x0, height, z0))
        self.go((x, max(height, y0), z), quaternion=quaternion)
        if y < height:
            self.go((x, y, z))

    def tap(self, centre: float, period: float, direction: Sequence[float], amplitude: float) -> Tap:
        """Knock along a direction, farthest at ``centre``; before, the body rests where it is.

        ValueError where the knock would begin before the script has come this far.
        """
        start = centre - period / 2.0
        if start < self.now:
            raise ValueError(f"a knock from {start} s begins before {self.now} s; plant it later")
        tap = Tap(start, period, point(direction), amplitude)
        self.overlays.append(tap)
        self.quiet.append((start, start + period))
        self.wait_until(start + period)
        return tap

    def path(self, tremor: np.random.Generator | None = None) -> KeyPath:
        """The path so far, with tremor outside the windows that must be quiet."""
        shake = [Tremor(tremor, TREMOR_M, self.quiet)] if tremor is not None else []
        return KeyPath(self._keys, [*self.overlays, *shake])

    def _append(
        self, time: float, position: Point, quaternion: Quaternion, ease: str = "minimum-jerk", arc: float = 0.0
    ) -> None:
        self._keys.append(Key(time, position, quaternion, ease, arc))
        self.now = time


class Buttons:
    """Presses of the trigger by side; the grip follows the trigger at 0.9 of its way, as a closing hand does."""

    def __init__(self) -> None:
        self._presses: dict[str, list[tuple[float, float]]] = {"left": [], "right": []}

    def hold(self, side: str, start: float, end: float) -> None:
        """The trigger passes `GRASP_LEVEL` at ``start`` and falls below `RELEASE_LEVEL` at ``end`` (seconds)."""
        self._presses[side].append((start, end))

    def trigger(self, side: str, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """How far the trigger is pressed at these times, 0 to 1."""
        value = np.zeros_like(times)
        for start, end in self._presses[side]:
            down = minimum_jerk((times - start) / PRESS_S + minimum_jerk_inverse(GRASP_LEVEL))
            up = minimum_jerk((end - times) / PRESS_S + minimum_jerk_inverse(RELEASE_LEVEL))
            value = np.maximum(value, np.minimum(down, up))
        return value

    def tracks(self, stamps_ns: NDArray[np.int64]) -> Mapping[str, HandTrack]:
        """What both controllers report at the stamps; the first stamp is the zero of all times here."""
        times = (stamps_ns - stamps_ns[0]) * 1e-9
        hands = {}
        for side in self._presses:
            trigger = np.round(self.trigger(side, times) * 255.0) / 255.0
            hands[f"{PARTICIPANT}/{side}"] = HandTrack(stamps_ns, trigger, np.round(trigger * 0.9, 6))
        return hands
