"""The samples of one body on its own clock."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.errors import SessionError


@dataclass(frozen=True, eq=False, init=False)
class Track:
    """One body's samples, on the device's own stamps.

    Parameters
    ----------
    times_ns : (n,) integers, nanoseconds, strictly increasing.
    positions : (n, 3) metres.
    quaternions_xyzw : (n, 4).
    valid : (n,) bool, False where the tracker had lost the body; ``None``: all valid.

    Raises ``SessionError``: shapes that do not fit, or stamps that do not increase.
    """

    times_ns: NDArray[np.int64]
    positions: NDArray[np.float64]
    quaternions_xyzw: NDArray[np.float64]
    valid: NDArray[np.bool_]

    def __init__(
        self, times_ns: ArrayLike, positions: ArrayLike, quaternions_xyzw: ArrayLike, valid: ArrayLike | None = None
    ) -> None:
        stamps = checked_stamps(times_ns, "a track")
        count = len(stamps)
        mask = np.ones(count, dtype=np.bool_) if valid is None else valid
        freeze(
            self,
            times_ns=stamps,
            positions=checked_column(positions, np.float64, (count, 3), "positions of a track"),
            quaternions_xyzw=checked_column(quaternions_xyzw, np.float64, (count, 4), "quaternions_xyzw of a track"),
            valid=checked_column(mask, np.bool_, (count,), "valid of a track"),
        )

    def __len__(self) -> int:
        return len(self.times_ns)


def freeze(frozen: object, **arrays: NDArray[Any]) -> None:
    """Set attributes of a frozen dataclass to arrays that nobody can write to."""
    for name, array in arrays.items():
        array.setflags(write=False)
        object.__setattr__(frozen, name, array)


def checked_column(given: ArrayLike, kind: type[np.generic], shape: tuple[int, ...], what: str) -> NDArray[Any]:
    """A copy as an array of this type and shape, one row per stamp; one sentence where that cannot be."""
    try:
        array = np.array(given, dtype=kind)
    except (TypeError, ValueError):
        raise SessionError(f"{what} cannot be read as numbers; give an array of shape {shape}") from None
    if array.shape != shape:
        raise SessionError(f"{what} has shape {array.shape}; {shape[0]} stamps need {shape}")
    return array


def checked_stamps(times_ns: ArrayLike, what: str) -> NDArray[np.int64]:
    """Integer nanoseconds that increase, as int64 (n,); one sentence where they are not."""
    given = np.asarray(times_ns)
    if given.size and given.dtype.kind not in "iu":
        raise SessionError(f"the stamps of {what} are {given.dtype}, not integers; give nanoseconds as int64")
    if given.ndim != 1:
        raise SessionError(f"the stamps of {what} have shape {given.shape}; give (n,) nanoseconds")
    if given.size and int(given.max()) > np.iinfo(np.int64).max:
        raise SessionError(f"the stamps of {what} go beyond int64; give nanoseconds since the epoch or the start")
    stamps = given.astype(np.int64)
    step = np.flatnonzero(np.diff(stamps) <= 0)
    if len(step):
        row = int(step[0]) + 1
        raise SessionError(
            f"sample {row} of {what} at {stamps[row]} ns does not come after {stamps[row - 1]} ns; "
            "sort the samples and drop repeats"
        )
    return stamps
