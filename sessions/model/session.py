"""A recorded session: poses, meshes, scene and events; in memory or larger than memory."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from textwrap import shorten
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.errors import MeshFileError, SessionError, WrongInputError
from sessions.mesh_data import MeshData
from sessions.model.constants import BLOCK_FRAMES
from sessions.model.event import Event, Interval, LiveContact
from sessions.model.samples import Frames, GazeTrack, HandTrack, ScalarTrack, Track
from sessions.model.scene import Scene

if TYPE_CHECKING:
    MeshLike = MeshData | tuple[ArrayLike, ArrayLike]


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
