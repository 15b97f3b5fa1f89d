"""What one hand pressed, on the clock of its controller."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.errors import SessionError
from sessions.track import checked_stamps


@dataclass(frozen=True, eq=False, init=False)
class HandTrack:
    """Trigger, grip and buttons of one hand of one participant; its pose is a body's track like any other.

    Parameters
    ----------
    times_ns : (n,) integers, nanoseconds, strictly increasing.
    trigger, grip : (n,) float64, 0 released to 1 pressed; ``None``: all 0.
    buttons : b names.
    pressed : (n, b) bool; ``None``: never pressed.

    Raises
    ------
    SessionError
        Shapes that do not fit, or stamps that do not increase.
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
        values = {
            "times_ns": stamps,
            "trigger": np.zeros(count) if trigger is None else np.array(trigger, dtype=np.float64),
            "grip": np.zeros(count) if grip is None else np.array(grip, dtype=np.float64),
            "pressed": np.zeros((count, len(names)), np.bool_) if pressed is None else np.array(pressed, np.bool_),
        }
        shapes = {"trigger": (count,), "grip": (count,), "pressed": (count, len(names))}
        for name, array in values.items():
            if array.shape != shapes.get(name, (count,)):
                raise SessionError(f"{name} of a hand has shape {array.shape}; {count} stamps need {shapes[name]}")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        object.__setattr__(self, "buttons", names)

    def __len__(self) -> int:
        return len(self.times_ns)
