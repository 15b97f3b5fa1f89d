"""Series on a clock of their own: poses of a body, presses of a hand, gaze, numbers."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.errors import SessionError


class Column(NamedTuple):
    """The input for a column: the shape of a row, its type, and the default for ``None``."""

    given: ArrayLike | None
    width: tuple[int, ...] = ()
    kind: type[np.generic] = np.float64
    otherwise: float = 0.0


@dataclass(frozen=True, eq=False, init=False)
class Samples:
    """n stamps and columns of n rows that nobody can write to.

    Parameters
    ----------
    times_ns : (n,) integers, nanoseconds, strictly increasing.

    Raises ``SessionError``: shapes that do not fit, or stamps that do not increase.
    """

    times_ns: NDArray[np.int64]

    def _fill(self, what: str, times_ns: ArrayLike, **columns: Column) -> None:
        arrays: dict[str, NDArray[Any]] = {"times_ns": checked_stamps(times_ns, what)}
        for name, column in columns.items():
            shape = (len(arrays["times_ns"]), *column.width)
            given = np.full(shape, column.otherwise) if column.given is None else column.given
            arrays[name] = _checked_column(given, column.kind, shape, f"{name} of {what}")
        for name, array in arrays.items():
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return len(self.times_ns)


@dataclass(frozen=True, eq=False, init=False)
class Track(Samples):
    """One body's samples, on the device's own stamps.

    Parameters
    ----------
    positions : (n, 3) metres.
    quaternions_xyzw : (n, 4).
    valid : (n,) bool, False where the tracker had lost the body; ``None``: all valid.
    """

    positions: NDArray[np.float64]
    quaternions_xyzw: NDArray[np.float64]
    valid: NDArray[np.bool_]

    def __init__(
        self, times_ns: ArrayLike, positions: ArrayLike, quaternions_xyzw: ArrayLike, valid: ArrayLike | None = None
    ) -> None:
        self._fill(
            "a track",
            times_ns,
            positions=Column(positions, (3,)),
            quaternions_xyzw=Column(quaternions_xyzw, (4,)),
            valid=Column(valid, (), np.bool_, True),
        )


@dataclass(frozen=True, eq=False, init=False)
class HandTrack(Samples):
    """Trigger, grip and buttons of one hand of one participant; its pose is a body's track like any other.

    Parameters
    ----------
    trigger, grip : (n,) float64, 0 released to 1 pressed; ``None``: all 0.
    buttons : b names.
    pressed : (n, b) bool; ``None``: never pressed.
    """

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
        names = tuple(buttons)
        repeated = next((name for name in names if names.count(name) > 1), None)
        if repeated is not None:
            raise SessionError(f"a hand has button {repeated!r} twice; give each a name of its own")
        down = Column(pressed, (len(names),), np.bool_, False)
        self._fill("a hand", times_ns, trigger=Column(trigger), grip=Column(grip), pressed=down)
        object.__setattr__(self, "buttons", names)


@dataclass(frozen=True, eq=False, init=False)
class GazeTrack(Samples):
    """The gaze of one participant: a ray per sample, in the world.

    Parameters
    ----------
    origins : (n, 3) metres.
    directions : (n, 3), of length 1.
    valid : (n,) bool, False where the eyes were closed or lost; ``None``: all valid.
    bodies : n names: the first body hit, as the recording program said; "" where it did not; ``None``: nowhere.
    """

    origins: NDArray[np.float64]
    directions: NDArray[np.float64]
    valid: NDArray[np.bool_]
    bodies: tuple[str, ...]

    def __init__(
        self,
        times_ns: ArrayLike,
        origins: ArrayLike,
        directions: ArrayLike,
        valid: ArrayLike | None = None,
        bodies: Sequence[str] | None = None,
    ) -> None:
        flags = Column(valid, (), np.bool_, True)
        self._fill("a gaze", times_ns, origins=Column(origins, (3,)), directions=Column(directions, (3,)), valid=flags)
        count = len(self)
        names = ("",) * count if bodies is None else tuple(bodies)
        if len(names) != count:
            raise SessionError(f"a gaze has {len(names)} bodies; {count} stamps need {count}")
        object.__setattr__(self, "bodies", names)

    @property
    def usable(self) -> NDArray[np.bool_]:
        """Samples that are valid and hold a ray, (n,)."""
        with np.errstate(over="ignore", invalid="ignore"):
            length = np.sqrt((self.directions**2).sum(axis=1))
        return self.valid & np.isfinite(self.origins).all(axis=1) & np.isfinite(length) & (length > 0.0)


@dataclass(frozen=True, eq=False, init=False)
class ScalarTrack(Samples):
    """A number over time, on the stamps of its source: a heart rate, a marker, a channel of an EEG.

    Parameters
    ----------
    values : (n,) float64; NaN where nothing was measured.
    unit : as the source calls it, or ``""``.
    """

    values: NDArray[np.float64]
    unit: str

    def __init__(self, times_ns: ArrayLike, values: ArrayLike, unit: str = "") -> None:
        self._fill("a scalar", times_ns, values=Column(values))
        object.__setattr__(self, "unit", unit)


def _checked_column(given: ArrayLike, kind: type[np.generic], shape: tuple[int, ...], what: str) -> NDArray[Any]:
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
