"""What one hand pressed, on the clock of its controller."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.errors import SessionError
from sessions.model.track import checked_column, checked_stamps, freeze


@dataclass(frozen=True, eq=False, init=False)
class HandTrack:
    """Trigger, grip and buttons of one hand of one participant; its pose is a body's track like any other.

    Parameters
    ----------
    times_ns : (n,) integers, nanoseconds, strictly increasing.
    trigger, grip : (n,) float64, 0 released to 1 pressed; ``None``: all 0.
    buttons : b names.
    pressed : (n, b) bool; ``None``: never pressed.

    Raises ``SessionError``: shapes that do not fit, or stamps that do not increase.
    """

    times_ns: NDArray[np.int64]
    trigger: NDArray[np.float64]
    grip: NDArray[np.float64]
    buttons: tuple[str, ...]
    pressed: NDArray[np.bool_]

    def __init__(
        self,
        times_ns: ArrayLike,
        trigger: ArrayLike | None = None,
        grip: ArrayLike | None = None,
        buttons: tuple[str, ...] = (),
        pressed: ArrayLike | None = None,
    ) -> None:
        stamps = checked_stamps(times_ns, "a hand")
        count, names = len(stamps), tuple(buttons)
        repeated = next((name for name in names if names.count(name) > 1), None)
        if repeated is not None:
            raise SessionError(f"a hand has button {repeated!r} twice; give each a name of its own")
        released, never = np.zeros(count), np.zeros((count, len(names)), dtype=np.bool_)
        trigger, grip = released if trigger is None else trigger, released if grip is None else grip
        down = never if pressed is None else pressed
        freeze(
            self,
            times_ns=stamps,
            trigger=checked_column(trigger, np.float64, (count,), "trigger of a hand"),
            grip=checked_column(grip, np.float64, (count,), "grip of a hand"),
            pressed=checked_column(down, np.bool_, (count, len(names)), "pressed of a hand"),
        )
        object.__setattr__(self, "buttons", names)

    def __len__(self) -> int:
        return len(self.times_ns)
