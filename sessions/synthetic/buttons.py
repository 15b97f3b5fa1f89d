"""Trigger and grip of two controllers, pressed and let go as fingers do: over a tenth of a second, not at once."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from sessions.hand import HandTrack
from sessions.synthetic.easing import minimum_jerk, minimum_jerk_inverse

PARTICIPANT = "student"

# From first movement to fully pressed. A press is planned so that it passes 0.6, the level at which a grasp counts,
# at the planned time.
PRESS_S = 0.12
GRASP_LEVEL, RELEASE_LEVEL = 0.6, 0.4


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
