"""A recorded session: poses, meshes, scene and events; in memory or larger than memory.

Poses are samples as arrays: `Track` is the series of a body on the clock of its own, `Frames` hold a sample of every
body at each stamp. A `Session` has frames, and everything beside them.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from enum import IntEnum
from functools import cached_property
from textwrap import shorten
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.errors import MeshFileError, SessionError, WrongInputError
from sessions.mesh_data import MeshData
from sessions.model.constants import BLOCK_FRAMES
from sessions.model.event import Event, Interval, LiveContact
from sessions.model.scene import Scene

if TYPE_CHECKING:
    MeshLike = MeshData | tuple[ArrayLike, ArrayLike]


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


class FrameSource(Protocol):
    """A source of frames: `Frames` in memory, or a file read block by block."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the tracked bodies, one per column."""

    def blocks(self, frames: int) -> Iterator[Frames]:
        """All frames in file order, in blocks of at most this many."""


@dataclass(frozen=True, eq=False)
class SessionSegment:
    """The position of the frames of a session in the recording that they are a part of.

    Parameters
    ----------
    first_ns : the stamp of the recording's first frame, which is its second 0.
    numbers : (T,) int64, the numbers of the frames in the recording, from 0.
    """

    first_ns: int
    numbers: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class _Between:
    """The frames of another source whose stamps lie between two, both included."""

    source: FrameSource
    first_stamp_ns: int
    last_stamp_ns: int

    @property
    def names(self) -> tuple[str, ...]:
        return self.source.names

    def blocks(self, frames: int) -> Iterator[Frames]:
        for block in self.source.blocks(frames):
            inside = (block.stamp_ns >= self.first_stamp_ns) & (block.stamp_ns <= self.last_stamp_ns)
            if inside.any():
                yield block.take(inside)


@dataclass(frozen=True, eq=False, repr=False)
class Session:
    """One session, canonical frame (right-handed, +Y up, -Z forward), metres, nanoseconds.

    Build one with ``from_arrays`` (one clock), ``from_tracks`` (a clock per body), ``read_session`` (a file) or
    ``import_session``. Frames are loaded when asked for; ``blocks`` never holds more than one block.

    Parameters
    ----------
    source : where the frames are.
    meshes : body name -> mesh, in the body's own frame.
    scene : bodies, pairs and effects as declared; ``Scene()`` when nothing was.
    events, intervals : what happened.
    facts : metadata ``vrlab.session``: format version, source units, conversions done, VR type, ...
    origin : the file it was read from, or ``""``.
    hands : ``participant/side`` -> what the hand pressed.
    live_contacts : what the engine reported while the session ran.
    fast_tracks : body name -> samples that come faster than frames.
    colliders : body name -> the solids that an engine has in place of its mesh, in the body's own frame.
    gaze : participant -> where they looked.
    scalars : name -> a number over time: a heart rate, a marker, a channel of an EEG.
    segment : where the frames stand in the recording, of whose frames these are a part; ``None``: they are all.
    """

    source: FrameSource
    meshes: Mapping[str, MeshData]
    scene: Scene = field(default_factory=Scene)
    events: tuple[Event, ...] = ()
    intervals: tuple[Interval, ...] = ()
    facts: Mapping[str, str] = field(default_factory=dict)
    origin: str = ""
    hands: Mapping[str, HandTrack] = field(default_factory=dict)
    live_contacts: Sequence[LiveContact] = ()
    fast_tracks: Mapping[str, Track] = field(default_factory=dict)
    colliders: Mapping[str, tuple[MeshData, ...]] = field(default_factory=dict)
    gaze: Mapping[str, GazeTrack] = field(default_factory=dict)
    scalars: Mapping[str, ScalarTrack] = field(default_factory=dict)
    segment: SessionSegment | None = None

    def __repr__(self) -> str:
        """Frames, bodies and meshes; of a file no frame is read for them."""
        frames = self.source if isinstance(self.source, Frames) else self.__dict__.get("frames")
        count = "frames are read when they are asked for" if frames is None else f"{len(frames):,} frames"
        return f"Session: {count}; {len(self.meshes)} meshes\nbodies: {shorten(', '.join(self.names), 100)}"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the tracked bodies, in the order of the frames' columns."""
        return self.source.names

    @cached_property
    def frames(self) -> Frames:
        """All frames at once; for a session larger than memory take ``blocks``."""
        blocks = list(self.source.blocks(BLOCK_FRAMES))
        return Frames.join(blocks) if blocks else Frames.empty(self.names)

    def blocks(self, frames: int = 4096) -> Iterator[Frames]:
        """The frames in order, in blocks of at most this many, each loaded when its turn comes."""
        if "frames" in self.__dict__:
            yield from self.frames.blocks(frames)
        else:
            yield from self.source.blocks(frames)

    def stamps(self) -> NDArray[np.int64]:
        """The stamps of all frames, (T,) int64, in file order."""
        return np.concatenate([np.zeros(0, np.int64), *(block.stamp_ns for block in self.blocks(BLOCK_FRAMES))])

    def between(self, first_stamp_ns: int, last_stamp_ns: int) -> "Session":
        """The frames whose stamps lie between two, both included, as a session.

        All else of the session stays, and ``segment`` says where the frames stand in the recording.
        """
        stamps = self.stamps()
        numbers = np.flatnonzero((stamps >= first_stamp_ns) & (stamps <= last_stamp_ns))
        source = _Between(self.source, first_stamp_ns, last_stamp_ns)
        first_ns = int(stamps[0]) if len(stamps) else 0
        return replace(self, source=source, segment=SessionSegment(first_ns, numbers))

    @cached_property
    def tracks(self) -> dict[str, Track]:
        """The samples of each body on its own clock, its faster track where it has one; repeats are dropped."""
        slow = {name: self.frames.track(column) for column, name in enumerate(self.names)}
        return {**slow, **self.fast_tracks}

    @classmethod
    def from_arrays(
        cls,
        times_ns: ArrayLike,
        poses: Mapping[str, tuple[ArrayLike, ArrayLike]],
        meshes: "Mapping[str, MeshLike] | None" = None,
        scene: Scene | None = None,
        *,
        events: Sequence[Event] = (),
        intervals: Sequence[Interval] = (),
        facts: Mapping[str, str] | None = None,
    ) -> "Session":
        """A session whose bodies share one clock.

        Parameters
        ----------
        times_ns : (T,) integers, strictly increasing.
        poses : body name -> (positions (T, 3), quaternions_xyzw (T, 4)).
        meshes : body name -> (vertices (v, 3), faces (f, 3)) or ``MeshData``.

        Raises ``SessionError``: shapes that do not fit, stamps that do not increase.
        """
        _require_mapping("poses", poses, "(positions (T, 3), quaternions_xyzw (T, 4))")
        tracks = {name: _track_of(name, times_ns, pose) for name, pose in poses.items()}
        return cls.from_tracks(tracks, meshes=meshes, scene=scene, events=events, intervals=intervals, facts=facts)

    @classmethod
    def from_tracks(
        cls,
        tracks: Mapping[str, Track],
        meshes: "Mapping[str, MeshLike] | None" = None,
        scene: Scene | None = None,
        *,
        events: Sequence[Event] = (),
        intervals: Sequence[Interval] = (),
        facts: Mapping[str, str] | None = None,
    ) -> "Session":
        """A session whose bodies have clocks of their own; a frame is made for every stamp that any body has."""
        if meshes is not None:
            _require_mapping("meshes", meshes, "(vertices (v, 3), faces (f, 3))")
        given = {name: mesh_of(name, mesh) for name, mesh in (meshes or {}).items()}
        return cls(
            Frames.from_tracks(tracks), given, scene or Scene(), tuple(events), tuple(intervals), dict(facts or {})
        )


def _require_mapping(what: str, given: object, value: str) -> None:
    if not isinstance(given, Mapping):
        raise WrongInputError(f"{what} are a mapping from body name to {value}, not {type(given).__name__}")


def _track_of(name: str, times_ns: ArrayLike, pose: tuple[ArrayLike, ArrayLike]) -> Track:
    try:
        positions, quaternions = pose
    except (TypeError, ValueError):
        raise SessionError(f"body {name!r}: give its poses as (positions (T, 3), quaternions_xyzw (T, 4))") from None
    try:
        return Track(times_ns, positions, quaternions)
    except SessionError as error:
        raise SessionError(f"body {name!r}: {error}") from None


def mesh_of(name: str, mesh: "MeshLike") -> MeshData:
    """A body's mesh as `MeshData`; an error names the body."""
    try:
        if isinstance(mesh, MeshData):
            return mesh
        vertices, faces = mesh
        return MeshData(vertices, faces)
    except (TypeError, ValueError):
        raise MeshFileError(f"the mesh of {name!r}: give it as (vertices (v, 3), faces (f, 3))") from None
    except MeshFileError as error:
        raise MeshFileError(f"the mesh of {name!r}: {error}") from None
