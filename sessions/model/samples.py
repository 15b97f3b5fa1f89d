"""Samples of a session as arrays: series on clocks of their own, and frames, which hold a sample of every body."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from enum import IntEnum
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


class Status(IntEnum):
    """Quality of a body's sample in a frame (stored as uint8)."""

    ABSENT = 0
    """The frame holds no sample of this body."""
    VALID = 1
    """Measured."""
    LOST = 2
    """Flagged as lost by the tracker or the source; the raw numbers are kept and never used."""
    HELD = 3
    """The source repeated an earlier pose and said so."""
    INTERPOLATED = 4
    """The source computed the pose from its neighbours and said so."""


@dataclass(frozen=True, eq=False)
class Frames:
    """T consecutive frames of N bodies, exactly as recorded.

    A frame is one ``/tf`` message with its stamp. Each body's sample in it carries its own device time.

    Parameters
    ----------
    names : N body names.
    stamp_ns : (T,) int64, the frame's time (``publish_time``).
    log_ns : (T,) int64, the recorder's clock (``log_time``).
    sample_ns : (T, N) int64, device time of each sample; 0 where absent.
    position : (T, N, 3) float64, metres; NaN where absent.
    quaternion_xyzw : (T, N, 4) float64 as recorded, not renormalised; NaN where absent.
    status : (T, N) uint8, values of ``Status``.
    """

    names: tuple[str, ...]
    stamp_ns: NDArray[np.int64]
    log_ns: NDArray[np.int64]
    sample_ns: NDArray[np.int64]
    position: NDArray[np.float64]
    quaternion_xyzw: NDArray[np.float64]
    status: NDArray[np.uint8]

    def __post_init__(self) -> None:
        for item in fields(self)[1:]:
            getattr(self, item.name).setflags(write=False)

    def __len__(self) -> int:
        return len(self.stamp_ns)

    def segment(self, start: int, stop: int) -> "Frames":
        """Frames ``start <= t < stop`` as views."""
        arrays = [getattr(self, item.name)[start:stop] for item in fields(self)[1:]]
        return Frames(self.names, *arrays)

    def take(self, rows: NDArray[np.bool_] | NDArray[np.int64]) -> "Frames":
        """The frames of a mask (T,), or of these numbers, as copies."""
        arrays = [getattr(self, item.name)[rows] for item in fields(self)[1:]]
        return Frames(self.names, *arrays)

    def blocks(self, frames: int) -> "Iterator[Frames]":
        """These frames in consecutive blocks of at most this many."""
        for start in range(0, len(self), frames):
            yield self.segment(start, start + frames)

    def track(self, column: int) -> Track:
        """The samples of one body on its own clock; those that a frame repeats are there once."""
        present = np.flatnonzero(self.status[:, column] != Status.ABSENT)
        stamps, first = np.unique(self.sample_ns[present, column], return_index=True)
        rows = present[first]
        valid = self.status[rows, column] != Status.LOST
        return Track(stamps, self.position[rows, column], self.quaternion_xyzw[rows, column], valid)

    @classmethod
    def from_tracks(cls, tracks: Mapping[str, Track]) -> "Frames":
        """A frame for every stamp that any body has."""
        names = tuple(tracks)
        if not names:
            return cls.empty(names)
        stamps = _different_stamps([track.times_ns for track in tracks.values()])
        sample, position, quaternion, status = absent_samples(len(stamps), len(names))
        for column, track in enumerate(tracks.values()):
            rows = np.searchsorted(stamps, track.times_ns)
            sample[rows, column] = track.times_ns
            position[rows, column] = track.positions
            quaternion[rows, column] = track.quaternions_xyzw
            status[rows, column] = np.where(track.valid, Status.VALID, Status.LOST)
        return cls(names, stamps, stamps.copy(), sample, position, quaternion, status)

    @classmethod
    def join(cls, blocks: "list[Frames]") -> "Frames":
        """Blocks after each other; all have the same bodies."""
        arrays = [np.concatenate([getattr(block, item.name) for block in blocks]) for item in fields(cls)[1:]]
        return cls(blocks[0].names, *arrays)

    @classmethod
    def empty(cls, names: tuple[str, ...]) -> "Frames":
        """No frame of these bodies."""
        none = np.zeros(0, dtype=np.int64)
        return cls(names, none, none.copy(), *absent_samples(0, len(names)))


def absent_samples(
    frames: int, bodies: int
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64], NDArray[np.uint8]]:
    """``sample_ns``, ``position``, ``quaternion_xyzw`` and ``status`` of frames in which every body is absent."""
    shape = (frames, bodies)
    position, quaternion = np.full((*shape, 3), np.nan), np.full((*shape, 4), np.nan)
    return np.zeros(shape, np.int64), position, quaternion, np.zeros(shape, np.uint8)


def _different_stamps(stamps_of_tracks: Sequence[NDArray[np.int64]]) -> NDArray[np.int64]:
    """All stamps in order, each once; `numpy.unique` would import masked arrays for it, in 13 ms."""
    stamps = np.sort(np.concatenate(stamps_of_tracks))
    is_first = np.ones(len(stamps), dtype=np.bool_)
    is_first[1:] = stamps[1:] != stamps[:-1]
    return stamps[is_first]
