"""Records a session live: everything older than a second is in the file, even if the program is killed.

While it records, the file is called ``<name>.partial``, and every message in it can be read. When the recorder is
closed, the file is written again in compressed chunks, with an index, and gets its name. A program that is killed
leaves the partial file: `recover` saves what is in it as a session file. A power cut may also cost
what the operating system had not yet put on the disk.
"""

import os
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
from numpy.typing import ArrayLike

from sessions.errors import SessionError, SessionFileError
from sessions.mcap import annotations as messages
from sessions.mcap.annotations import Message
from sessions.mcap.metadata import MAX_BODIES
from sessions.mcap.reader import read_session
from sessions.mcap.recorded_frames import Poses, RecordedFrame, frames_of, nanoseconds, pose_values
from sessions.mcap.schemas import GAZE_PREFIX, HANDS_PREFIX, SCALARS_PREFIX, TRACKS_PREFIX
from sessions.mcap.writer import SessionWriter, write_session
from sessions.model.event import Event, Interval, LiveContact
from sessions.model.scene import Scene
from sessions.model.session import GazeTrack, HandTrack, Samples, ScalarTrack, Status, Track, mesh_of
from sessions.whole_files import is_abandoned, locks

if TYPE_CHECKING:
    from sessions.model.session import MeshLike

# The writing thread wakes this often; with what writing takes, the file is never a second behind.
FLUSH_SECONDS = 0.2
# Frames and other messages that wait at most: 5.7 s at 90 Hz. A program faster than the disk has to wait.
FRAMES_WAITING, MESSAGES_WAITING = 512, 4096
PARTIAL = ".partial"


class Recorder:
    """A session being recorded, from any Python loop and any number of threads.

    No frame is lost silently and memory is bounded: if the disk cannot keep up, calls wait for it.

    Parameters
    ----------
    path : the session file to be.
    scene : what is there; its text goes into the file.
    meshes : body name -> (vertices (v, 3), faces (f, 3)) or ``MeshData``.
    facts : what is known of the session, for example ``vr_type``, ``pseudonym``, ``consent``.
    overwrite : replace a file of that name, or the partial file of a recording that was killed.

    Raises ``SessionFileError``: a file of that name, or a partial one, is there already; the place cannot be written.

    Examples
    --------
    >>> with Recorder(path) as recorder:                                      # doctest: +SKIP
    ...     recorder.poses(time.time_ns(), {"wand": ((0, 1, 0), (0, 0, 0, 1))})
    """

    def __init__(
        self,
        path: str | Path,
        scene: Scene | None = None,
        meshes: "Mapping[str, MeshLike] | None" = None,
        *,
        facts: Mapping[str, str] | None = None,
        overwrite: bool = False,
    ) -> None:
        given = {name: mesh_of(name, mesh) for name, mesh in (meshes or {}).items()}
        self._path, self._overwrite = Path(path), overwrite
        self._stream = partial_file(self._path, overwrite=overwrite)
        self._partial = Path(self._stream.name)
        try:
            self._writer = SessionWriter(self._stream, scene or Scene(), given, facts or {}, (), chunked=False)
            self._stream.flush()
        except BaseException:
            self._stream.close()
            self._partial.unlink(missing_ok=True)
            raise
        self._changed = threading.Condition()
        self._names: dict[str, None] = {}
        self._listed: tuple[str, ...] = ()
        self._frames: list[RecordedFrame] = []
        self._messages: list[tuple[int, Message]] = []
        self._hurry, self._closing = False, False
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._write, name="session recorder", daemon=True)
        self._thread.start()

    def poses(
        self,
        stamp_ns: int,
        poses: Poses,
        lost: Iterable[str] = (),
        *,
        held: Iterable[str] = (),
        interpolated: Iterable[str] = (),
        sample_ns: Mapping[str, int] | None = None,
        log_ns: int | None = None,
    ) -> None:
        """Record one frame.

        Parameters
        ----------
        stamp_ns : the frame's time, integer nanoseconds on a clock of your choice, not negative.
        poses : body name -> (position (3,) in metres, quaternion_xyzw (4,)); bodies may come and go.
        lost : bodies whose tracker had lost them; their numbers are kept and nobody computes with them.
        held, interpolated : bodies whose pose was repeated or computed and not measured.
        sample_ns : body name -> the device's own time of its sample; ``stamp_ns`` where not given.
        log_ns : the recorder's clock; the time of day when not given.

        Raises ``SessionError``: a pose that is not seven numbers, a body in ``lost`` without a pose, a stamp that is no
        integer; ``SessionFileError``: the file could not be written.
        """
        stamp, log = nanoseconds(stamp_ns), time.time_ns() if log_ns is None else nanoseconds(log_ns)
        status = dict.fromkeys(lost, Status.LOST) | dict.fromkeys(held, Status.HELD)
        status |= dict.fromkeys(interpolated, Status.INTERPOLATED)
        samples = {name: nanoseconds(time_ns) for name, time_ns in (sample_ns or {}).items()}
        for name in [*status, *samples]:
            if name not in poses:
                raise SessionError(f"{name!r} has no pose in this frame; give its last pose, or leave it out of `lost`")
        times = [samples.get(name, stamp) for name in poses]
        worth = [status.get(name, Status.VALID) for name in poses]
        frame = RecordedFrame(tuple(poses), stamp, log, times, worth, pose_values(poses))
        with self._changed:
            self._wait_while(lambda: len(self._frames) >= FRAMES_WAITING)
            if not poses.keys() <= self._names.keys():
                self._add_bodies(frame.names)
            self._frames.append(frame)

    def hand(
        self,
        stamp_ns: int,
        participant: str,
        side: str,
        *,
        trigger: float = 0.0,
        grip: float = 0.0,
        buttons: Mapping[str, bool] | None = None,
    ) -> None:
        """Record what a hand presses: trigger and grip from 0 to 1, button name -> pressed."""
        if "/" in participant or "/" in side:
            raise SessionError(f"participant {participant!r} or side {side!r} holds a slash; use another sign")
        names, pressed = tuple(buttons or {}), [*(buttons or {}).values()]
        hand = HandTrack([nanoseconds(stamp_ns)], [trigger], [grip], names, [pressed])
        self._put_stream(HANDS_PREFIX, f"{participant}/{side}", hand)

    def event(
        self,
        stamp_ns: int,
        name: str,
        message: str = "",
        *,
        body: str = "",
        level: str = "info",
    ) -> None:
        """Record a moment; see `Event`."""
        self._put(messages.event_message(Event(nanoseconds(stamp_ns), name, message, body, level)))

    def contact(
        self,
        stamp_ns: int,
        body_a: str,
        body_b: str,
        phase: str,
        point: tuple[float, float, float] | None = None,
    ) -> None:
        """Record what the live engine reports about a contact: ``enter``, ``stay`` or ``exit``."""
        self._put(messages.contact_message(LiveContact(nanoseconds(stamp_ns), body_a, body_b, phase, point)))

    def begin(self, stamp_ns: int, kind: str, name: str, data: Mapping[str, str] | None = None) -> Interval:
        """Record that a task, stage or feature begins; it is in the file even if `end` is never reached."""
        start = nanoseconds(stamp_ns)
        begun = Interval(start, start, kind, name, dict(data or {}))
        self._put(messages.interval_message(begun, closed=False))
        return begun

    def end(self, begun: Interval, stamp_ns: int) -> None:
        """Record that what `begin` returned ends."""
        self.interval(begun.start_ns, stamp_ns, begun.kind, begun.name, begun.data)

    def interval(self, start_ns: int, end_ns: int, kind: str, name: str, data: Mapping[str, str] | None = None) -> None:
        """Record a span whose both ends are known; see `Interval`."""
        span = Interval(nanoseconds(start_ns), nanoseconds(end_ns), kind, name, dict(data or {}))
        self._put(messages.interval_message(span))

    def samples(
        self,
        name: str,
        times_ns: ArrayLike,
        positions: ArrayLike,
        quaternions_xyzw: ArrayLike,
        valid: ArrayLike | None = None,
    ) -> None:
        """Record samples of a body that is tracked faster than the frames come; (n,), (n, 3), (n, 4), (n,)."""
        self._put_stream(TRACKS_PREFIX, name, Track(times_ns, positions, quaternions_xyzw, valid))

    def gaze(
        self,
        stamp_ns: int,
        participant: str,
        origin: ArrayLike,
        direction: ArrayLike,
        *,
        valid: bool = True,
        body: str = "",
    ) -> None:
        """Record where a participant looks, in the world; ``body``: the first one hit, where the program knows it."""
        gaze = GazeTrack([nanoseconds(stamp_ns)], np.array([origin]), np.array([direction]), [valid], [body])
        self._put_stream(GAZE_PREFIX, participant, gaze)

    def scalar(self, stamp_ns: int, name: str, value: float, unit: str = "") -> None:
        """Record a number, such as a heart rate."""
        self._put_stream(SCALARS_PREFIX, name, ScalarTrack([nanoseconds(stamp_ns)], [value], unit))

    def close(self) -> None:
        """Write what waits, the index, and give the file its name; a second call does nothing.

        Raises ``SessionFileError``: the file could not be written; what is in it stays under the name
        ``<name>.partial``.
        """
        with self._changed:
            if self._closing:
                return
            self._closing = True
            self._changed.notify_all()
        self._thread.join()
        self._stream.close()
        self._raise_failure()

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _put_stream(self, prefix: str, key: str, stream: Samples) -> None:
        for message in messages.stream_messages(prefix, key, stream):
            self._put(message)

    def _put(self, message: Message) -> None:
        log = time.time_ns()
        with self._changed:
            self._wait_while(lambda: len(self._messages) >= MESSAGES_WAITING)
            self._messages.append((log, message))

    def _wait_while(self, busy: Callable[[], bool]) -> None:
        """Let the writing thread take what waits, until there is room (call with the lock held)."""
        while True:
            self._raise_failure()
            if self._closing:
                raise SessionError("the recorder is closed; record into a new one")
            if not busy():
                return
            self._hurry = True
            self._changed.notify_all()
            self._changed.wait()

    def _add_bodies(self, names: tuple[str, ...]) -> None:
        known = dict.fromkeys([*self._names, *names])
        if len(known) > MAX_BODIES:
            raise SessionError(f"{len(known)} bodies are recorded; {MAX_BODIES} are allowed")
        try:
            "".join(known).encode()
        except (TypeError, UnicodeEncodeError):
            raise SessionError(f"bodies {list(names)!r} are not all named by text; give str names") from None
        self._names = known

    def _write(self) -> None:
        """The writing thread: take what waits, write it, and so on until closed or failed."""
        closing = False
        try:
            while not closing:
                with self._changed:
                    self._changed.wait_for(lambda: self._hurry or self._closing, timeout=FLUSH_SECONDS)
                    closing, self._hurry = self._closing, False
                    frames, messages = self._frames, self._messages
                    self._frames, self._messages = [], []
                    names = tuple(self._names)
                    self._changed.notify_all()
                self._append(frames, messages, names)
            self._finish()
        except BaseException as error:
            self._failure = error
        with self._changed:
            self._changed.notify_all()

    def _append(self, frames: list[RecordedFrame], messages: list[tuple[int, Message]], names: tuple[str, ...]) -> None:
        """Write what was taken, so that it can be read."""
        if frames or messages:
            self._writer.start(min([*(frame.log_ns for frame in frames[:1]), *(log for log, _ in messages[:1])]))
            if names != self._listed:
                self._writer.bodies(names)
                self._listed = names
            self._writer.logged(messages)
            for block in frames_of(frames):
                self._writer.frames(block)
            self._stream.flush()

    def _finish(self) -> None:
        """Write the whole again in compressed chunks with an index, under its name."""
        self._writer.start(0)
        self._writer.finish()
        self._stream.flush()
        try:
            write_session(read_session(self._partial), self._path, overwrite=self._overwrite)
        except SessionFileError as error:
            raise SessionFileError(
                f"{error}; what was recorded is in {self._partial}, save it with `replay recover`"
            ) from error
        with self._path.open("rb+") as whole:
            os.fsync(whole.fileno())
        self._stream.close()
        self._partial.unlink()

    def _raise_failure(self) -> None:
        if isinstance(self._failure, OSError):
            reason = self._failure.strerror or self._failure
            raise SessionFileError(
                f"{self._partial} cannot be written ({reason}); what was recorded before is in it, save it with "
                "`replay recover`"
            ) from self._failure
        if self._failure is not None:
            raise self._failure


def partial_file(path: Path, *, overwrite: bool) -> BinaryIO:
    """The file ``<name>.partial``, new and held by this process; see `Recorder` for the errors."""
    partial = path.with_name(path.name + PARTIAL)
    if path.exists() and not overwrite:
        raise SessionFileError(f"{path} is there already; give another name, or overwrite=True to replace it")
    try:
        if overwrite and is_abandoned(partial):
            partial.unlink()
        stream = partial.open("xb")
    except FileExistsError:
        raise SessionFileError(
            f"{partial} holds a recording that goes on or was cut short; save it with `replay recover`, or, "
            "once nobody writes it, give overwrite=True to replace it"
        ) from None
    except OSError as error:
        raise SessionFileError(
            f"{path} cannot be recorded ({error.strerror or error}); check the folder and who may write there"
        ) from None
    locks(stream)
    return stream
