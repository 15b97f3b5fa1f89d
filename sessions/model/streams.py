"""What was recorded beside poses: where somebody looked, and any number over time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.errors import SessionError
from sessions.model.track import checked_column, checked_stamps, freeze


@dataclass(frozen=True, eq=False, init=False)
class GazeTrack:
    """Where one participant looked: a ray per sample, in the world.

    Parameters
    ----------
    times_ns : (n,) integers, nanoseconds, strictly increasing.
    origins : (n, 3) metres.
    directions : (n, 3), of length 1.
    valid : (n,) bool, False where the eyes were closed or lost; ``None``: all valid.
    bodies : n names: the first body hit, as the recording program said; "" where it did not; ``None``: nowhere.

    Raises ``SessionError``: shapes that do not fit, or stamps that do not increase.
    """

    times_ns: NDArray[np.int64]
    origins: NDArray[np.float64]
    directions: NDArray[np.float64]
    valid: NDArray[np.bool_]
    bodies: tuple[str, ...]

    def __init__(
        self, times_ns: ArrayLike, origins: ArrayLike, directions: ArrayLike, valid: ArrayLike | None = None,
        bodies: Sequence[str] | None = None,
    ) -> None:  # fmt: skip
        stamps = checked_stamps(times_ns, "a gaze")
        count = len(stamps)
        freeze(
            self,
            times_ns=stamps,
            origins=checked_column(origins, np.float64, (count, 3), "origins of a gaze"),
            directions=checked_column(directions, np.float64, (count, 3), "directions of a gaze"),
            valid=checked_column(np.ones(count) if valid is None else valid, np.bool_, (count,), "valid of a gaze"),
        )
        names = ("",) * count if bodies is None else tuple(bodies)
        if len(names) != count:
            raise SessionError(f"a gaze has {len(names)} bodies; {count} stamps need {count}")
        object.__setattr__(self, "bodies", names)

    def __len__(self) -> int:
        return len(self.times_ns)

    @property
    def usable(self) -> NDArray[np.bool_]:
        """Samples that are valid and hold a ray, (n,)."""
        with np.errstate(over="ignore", invalid="ignore"):
            length = np.sqrt((self.directions**2).sum(axis=1))
        return self.valid & np.isfinite(self.origins).all(axis=1) & np.isfinite(length) & (length > 0.0)


@dataclass(frozen=True, eq=False, init=False)
class ScalarTrack:
    """A number over time, on the stamps of its source: a heart rate, a marker, a channel of an EEG.

    Parameters
    ----------
    times_ns : (n,) integers, nanoseconds, strictly increasing.
    values : (n,) float64; NaN where nothing was measured.
    unit : as the source calls it, or ``""``.

    Raises ``SessionError``: shapes that do not fit, or stamps that do not increase.
    """

    times_ns: NDArray[np.int64]
    values: NDArray[np.float64]
    unit: str

    def __init__(self, times_ns: ArrayLike, values: ArrayLike, unit: str = "") -> None:
        stamps = checked_stamps(times_ns, "a scalar")
        freeze(self, times_ns=stamps, values=checked_column(values, np.float64, stamps.shape, "values of a scalar"))
        object.__setattr__(self, "unit", unit)

    def __len__(self) -> int:
        return len(self.times_ns)
