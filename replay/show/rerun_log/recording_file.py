"""The file of a recording: rows in columns, encoded by Rerun, written by us, complete under its name or an error.

Lengths of columns are checked first: Rerun accepts wrong ones without an error. Every text passes here on its way, and
letters that the viewer's font lacks are replaced: the viewer ends at one. Rerun's own file sink only logs that a disk
is full: the process exits 0 with half a picture, or never ends (in ``save``, in ``disconnect`` or at exit; 7 of 10 with
``ulimit -f``). So Rerun encodes into memory; the file is ours.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from os import SEEK_END
from pathlib import Path
from typing import Any, Final
from uuid import uuid4

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from cdcore.numerics import FloatArray
from replay.detection.run_detector import MOST_FRAMES_IN_MEMORY
from replay.errors import OutputError
from replay.prepare.assembly import Assembly
from replay.show.palette import Rgba
from replay.words import safe_text
from sessions.whole_files import whole_file

SESSION_TIMELINE: Final = "session"
"""Timeline of the session's own time, a duration in nanoseconds since its first frame."""

NOT_IN_FONT_PATTERN: Final = re.compile(r"[^\n -\u024f\u02d0\u0370-\u03ff\u0400-\u04ff\u1e00-\u1eff‐-‧′″←-↓−≈≤≥✓]")
"""What is not known to be in Inter, the viewer's only font: Latin, Greek, Cyrillic and some signs are."""


def drawable(plain_text: str) -> str:
    """The text as the viewer can draw it: a letter that its font lacks is written as its number, ``u624b``."""
    return NOT_IN_FONT_PATTERN.sub(lambda letter: f"u{ord(letter[0]):04x}", plain_text)


def drawable_texts(batch: Any) -> Any:
    """A batch of a component, its texts as the viewer can draw them."""
    text_array = batch.as_arrow_array()
    if str(text_array.type) != "string":
        return batch
    texts = rr.components.TextBatch([drawable(text) for text in text_array.to_pylist()])
    return texts.described(batch.component_descriptor())


@dataclass(frozen=True, eq=False)
class RecordingClock:
    """Stamps of the frames, and which frames are drawn.

    ``ns`` (T,) are nanoseconds since the first frame of the session, ``drawn_frames`` (K,) the numbers of the frames
    that are drawn: all of them up to an hour. ``moments`` are those that are drawn in any case.
    """

    ns: NDArray[np.int64]
    drawn_frames: NDArray[np.int64]
    moments: NDArray[np.int64]

    @classmethod
    def of(cls, assembly: Assembly, moments: Sequence[int] = (), limit: int = MOST_FRAMES_IN_MEMORY) -> RecordingClock:
        """The clock of an assembly, with frames at which there is something to see."""
        stamps, first_time = assembly.stamp_ns, assembly.motion.times[:1]
        ns = stamps - stamps[:1] + np.round(1e9 * first_time).astype(np.int64)
        moment_frames = np.unique(np.array(moments, dtype=np.int64))
        stride = max(1, -(-len(ns) // limit))
        return cls(ns, np.union1d(np.arange(0, len(ns), stride), moment_frames), moment_frames)


def pack_colours(colours: Iterable[Rgba]) -> NDArray[np.uint32]:
    """Colours as 0xRRGGBBAA, (n,) uint32: Rerun takes Python integers for floats in some places."""
    return np.array([(r << 24) | (g << 16) | (b << 8) | a for r, g, b, a in colours], dtype=np.uint32)


def pose_columns(translations: FloatArray, rotations: FloatArray) -> rr.ComponentColumnList:
    """Poses as Rerun takes them: (n, 3) and (n, 3, 3), column convention."""
    quaternions = Rotation.from_matrix(rotations).as_quat(canonical=True).astype(np.float32)
    return rr.Transform3D.columns(translation=np.asarray(translations, dtype=np.float32), quaternion=quaternions)


def entity(*names: str) -> str:
    """Entity path of these parts, without a leading slash; punctuation in a part is escaped."""
    return rr.new_entity_path([drawable(name) for name in names]).removeprefix("/")


def partition_rows(columns: rr.ComponentColumnList, counts: ArrayLike) -> rr.ComponentColumnList:
    """Give ``counts[k]`` consecutive values to row k.

    ``AssertionError`` where the counts do not add up to the values there are: Rerun would shift every later row.
    """
    lengths = np.asarray(counts, dtype=np.int64)
    for column in columns:
        value_count = len(column.component_batch.as_arrow_array())
        assert lengths.sum() == value_count, f"{lengths.sum()} values announced, {value_count} given"
    return columns.partition(lengths)


class RecordingWriter:
    """A Rerun stream and the clock of its rows. Every error raises; Rerun alone would only log it.

    A viewer opens a recording at its first row, and a layout cannot move the cursor: so what is shown at ``opening``,
    nanoseconds on the session timeline, is sent once more just before the session begins; ``None``: nothing is.
    """

    def __init__(self, stream: rr.RecordingStream, clock: RecordingClock, opening: int | None = None) -> None:
        self.stream = stream
        self.clock = clock
        self._opening = opening

    def name(self, text: str) -> None:
        """Sets the name of the recording in the viewer."""
        self.stream.send_recording_name(drawable(safe_text(text)))

    def static(self, path: str, archetype: rr.AsComponents) -> None:
        """Log what holds at all times."""
        component_batches = [drawable_texts(batch) for batch in archetype.as_component_batches()]
        self.stream.log(path, component_batches, static=True, strict=True)

    def markdown(self, path: str, text: str) -> None:
        """Log words that stand at all times."""
        self.static(path, rr.TextDocument(safe_text(text, lines=True), media_type=rr.MediaType.MARKDOWN))

    def session_ns(self, time: tuple[int, int]) -> int:
        """Nanoseconds on the session timeline of a frame and nanoseconds after it."""
        frame, later_ns = time
        return int(self.clock.ns[frame]) + later_ns

    def rows(
        self, path: str, when: ArrayLike, columns: rr.ComponentColumnList, counts: ArrayLike | None = None
    ) -> None:
        """Send one row per frame; with ``counts`` a row holds several values.

        ``when``: frames (n,), or (n, 2) with nanoseconds after each.
        """
        frame_rows = np.asarray(when, dtype=np.int64)
        frames, later_ns = frame_rows.T if frame_rows.ndim == 2 else (frame_rows, 0)
        self.session_rows(path, self.clock.ns[frames] + later_ns, columns, counts)

    def session_rows(
        self, path: str, ns: NDArray[np.int64], columns: rr.ComponentColumnList, counts: ArrayLike | None = None
    ) -> None:
        """Send rows at any nanosecond of the session."""
        if not len(ns):
            return
        if not len(columns):
            raise ValueError(f"no columns for {path}; Rerun dropped the values it was given")
        row_columns = columns if counts is None else partition_rows(columns, counts)
        for column in row_columns:
            column.component_batch = drawable_texts(column.component_batch)
        if self._opening is not None and not any(
            column.descriptor.archetype in KINDS_OVER_TIME for column in row_columns
        ):
            earlier_rows = np.flatnonzero(ns <= self._opening)
            if len(earlier_rows):
                row = int(earlier_rows[np.argmax(ns[earlier_rows])])
                opening = [_single_row(column, row) for column in row_columns]
                self.stream.send_columns(path, [_time_column(self.clock.ns[:1] - 1)], opening, strict=True)
        self.stream.send_columns(path, [_time_column(ns)], row_columns, strict=True)

    def log_lines(self, path: str, ns: NDArray[np.int64], lines: Sequence[tuple[str, str, Rgba]]) -> None:
        """Send lines of a list, each with its level and colour: a click on the time of one moves the cursor there."""
        texts, levels, colours = zip(*lines, strict=True) if lines else ((), (), ())
        self.session_rows(path, ns, rr.TextLog.columns(text=texts, level=levels, color=pack_colours(colours)))

    def curve(
        self, path: str, values: ArrayLike, name: str, colour: Rgba, width: float = 1.4, *, step: bool = False
    ) -> None:
        """Send a curve of a value per frame (T,), and how it looks; a ``step`` is none that is sloped."""
        drawn_values = np.asarray(values, dtype=np.float64)[self.clock.drawn_frames]
        is_bend = np.ones(len(drawn_values), dtype=np.bool_)
        is_bend[1:-1] = (drawn_values[1:-1] != drawn_values[:-2]) | (drawn_values[1:-1] != drawn_values[2:])
        self.rows(path, self.clock.drawn_frames[is_bend], rr.Scalars.columns(scalars=drawn_values[is_bend]))
        # Peaks are what a curve is about; the default policy averages them away when zoomed out.
        peak_aggregation, steps = rr.components.AggregationPolicy.Max, rr.components.InterpolationMode.StepAfter
        line_style = rr.SeriesLines.from_fields(
            names=[name],
            colors=pack_colours([colour]),
            widths=[width],
            aggregation_policy=peak_aggregation,
            interpolation_mode=steps if step else None,
        )
        self.static(path, line_style)

    def steps(
        self,
        path: str,
        steps: Steps,
        things_of_step: Mapping[Any, Sequence[Any]],
        columns: Callable[[list[Any]], rr.ComponentColumnList],
    ) -> None:
        """Send what stands from each step on: ``things_of_step`` of what is shown then."""
        step_rows = [things_of_step.get(key, ()) for *_, key in steps]
        self.rows(path, times_of(steps), columns([thing for row in step_rows for thing in row]), [*map(len, step_rows)])


KINDS_OVER_TIME: Final = frozenset(f"rerun.archetypes.{name}" for name in ("Scalars", "StateChange", "TextLog"))
"""What a view shows of the whole session at once, wherever the cursor is."""


def _time_column(ns: NDArray[np.int64]) -> rr.TimeColumn:
    return rr.TimeColumn(SESSION_TIMELINE, duration=ns.astype("timedelta64[ns]"))


def _single_row(column: rr.ComponentColumn, row: int) -> rr.ComponentColumn:
    """One row of a column, as a column of its own."""
    values = column.as_arrow_array()[row].values
    return rr.ComponentColumn(column.descriptor, rr.AnyBatchValue(column.descriptor, values), lengths=[len(values)])


Steps = Sequence[tuple[int, int, Any]]
"""From a frame, and nanoseconds after it, on: what is shown."""


def steps_of(segments: Mapping[Any, tuple[tuple[int, int], int, int]], frames: int, default_thing: Any) -> Steps:
    """Return what is displayed when: each thing at its time and in its frames; ``default_thing`` at other times.

    ``segments``: thing -> its time (a frame, and nanoseconds after it), its first and its last frame.
    """
    thing_at = {time: thing for thing, (time, _, _) in segments.items()}
    for thing, (time, first, _) in segments.items():
        thing_at.setdefault((min(first, time[0]), 0), thing)
    for _, _, last in segments.values():
        if last + 1 < frames:
            thing_at.setdefault((last + 1, 0), default_thing)
    thing_at.setdefault((0, 0), default_thing)
    return [(*step_time, thing_at[step_time]) for step_time in sorted(thing_at)]


def times_of(steps: Steps) -> list[tuple[int, int]]:
    """Frame of each step, and nanoseconds after it."""
    return [(frame, later_ns) for frame, later_ns, _ in steps]


ENCODED_WITHIN_S: Final = 600.0
"""Seconds after which Rerun is taken to hang: ten minutes of twelve bodies are encoded in less than one."""


@contextmanager
def recording_file(application: str, path: Path, blueprint: rrb.Blueprint) -> Iterator[rr.RecordingStream]:
    """A stream whose messages are in the file ``path`` when the block has ended.

    Raises ``OSError``: the file cannot be written, or what Rerun made is no complete recording.
    """
    stream = rr.RecordingStream(application, recording_id=uuid4())
    try:
        encoded_stream = rr.binary_stream(recording=stream)
        stream.send_blueprint(blueprint, make_active=False, make_default=True)
        yield stream
        content = read_all(encoded_stream)
    finally:
        stream.disconnect()
    require_complete(content)
    with whole_file(path, OutputError) as file:
        file.write(content)


def require_complete(content: bytes) -> None:
    """Raise ``OSError`` unless these are the bytes of a whole recording, from its first mark to that of its footer."""
    if content[:4] != b"RRF2" or content[-12:-4] != b"RRF2FOOT":
        raise OSError(f"the picture has no end after {len(content)} bytes: Rerun did not encode all of it")


def require_complete_file(recording: Path) -> None:
    """Raise ``OSError`` unless a file begins and ends as whole recordings do."""
    with recording.open("rb") as file:
        first_bytes = file.read(4)
        file_size = file.seek(0, SEEK_END)
        file.seek(max(0, file_size - 12))
        require_complete(first_bytes + file.read())


def read_all(encoded_stream: rr.BinaryStream) -> bytes:
    """Bytes that Rerun has encoded; raises ``OSError`` if encoding takes too long."""
    try:
        return encoded_stream.read(flush=True, flush_timeout_sec=ENCODED_WITHIN_S) or b""
    except (RuntimeError, ValueError) as error:
        raise OSError(f"Rerun did not encode the picture within {ENCODED_WITHIN_S:g} s ({error})") from error


def name_layer(application: str, recording: str, name: str) -> bytes:
    """Bytes that a viewer opens over a recording, given by its ids, to list it under another name."""
    stream = rr.RecordingStream(application, recording_id=recording)
    try:
        encoded_stream = rr.binary_stream(recording=stream)
        stream.send_recording_name(name)
        return read_all(encoded_stream)
    finally:
        stream.disconnect()
