"""The file of a recording: rows in columns, encoded by Rerun, written by us, complete under its name or an error.

Lengths of columns are checked first: Rerun accepts wrong ones without an error. Every text passes here on its way, and
letters that the viewer's font lacks are replaced: the viewer ends at one. Rerun's own file sink only logs that a disk
is full: the process exits 0 with half a picture, or never ends (in ``save``, in ``disconnect`` or at exit; 7 of 10 with
``ulimit -f``). So Rerun encodes into memory; the file is ours.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from uuid import uuid4

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from cdcore.numerics import FloatArray
from replay.base.constants import HELD_FRAMES
from replay.base.shown import shown
from replay.errors import OutputError
from replay.outputs.palette import Rgba
from replay.prepare.assembly import Assembly
from sessions.whole_files import whole_file

SESSION: Final = "session"
"""Timeline of the session's own time, a duration in nanoseconds since its first frame."""

FRAME: Final = "frame"
"""Timeline of frame numbers."""

KEPT_AROUND: Final = 1.0
"""Seconds before and after a miss in which a strided recording keeps every frame."""

NOT_IN_FONT: Final = re.compile(r"[^\n -\u024f\u02d0\u0370-\u03ff\u0400-\u04ff\u1e00-\u1eff‐-‧′″←-↓−≈≤≥✓]")
"""What is not known to be in Inter, the viewer's only font: Latin, Greek, Cyrillic and some signs are."""


def drawable(text: str) -> str:
    """The text as the viewer can draw it: a letter that its font lacks is written as its number, ``u624b``."""
    return NOT_IN_FONT.sub(lambda letter: f"u{ord(letter[0]):04x}", text)


@dataclass(frozen=True)
class DrawableTexts:
    """A component of texts, each as the viewer can draw it."""

    batch: Any

    def component_descriptor(self) -> rr.ComponentDescriptor:
        """What Rerun asks of a component: its name."""
        descriptor: rr.ComponentDescriptor = self.batch.component_descriptor()
        return descriptor

    def as_arrow_array(self) -> Any:
        """What Rerun asks of a component: its values."""
        array = self.batch.as_arrow_array()
        if str(array.type) != "string":
            return array
        return rr.components.TextBatch([drawable(text) for text in array.to_pylist()]).as_arrow_array()

    def as_component_batches(self) -> list[Any]:
        """What Rerun asks of several components."""
        return [DrawableTexts(one) for one in self.batch.as_component_batches()]


@dataclass(frozen=True, eq=False)
class RecordingClock:
    """Stamps of the frames, and which frames are drawn.

    ``ns`` (T,) are nanoseconds since the first frame of the session, ``kept`` (K,) the increasing numbers of the frames
    that are drawn: all of them up to an hour.
    """

    ns: NDArray[np.int64]
    kept: NDArray[np.int64]

    @classmethod
    def of(
        cls, assembly: Assembly, whole: Iterable[tuple[float, float]] = (), limit: int = HELD_FRAMES
    ) -> RecordingClock:
        """The clock of an assembly; around the spans ``whole`` (seconds) every frame is kept."""
        stamps, times = assembly.stamp_ns, assembly.motion.times
        if not len(stamps):
            return cls(np.zeros(0, np.int64), np.zeros(0, np.int64))
        ns = stamps - stamps[0] + round(float(times[0]) * 1e9)
        stride = -(-len(ns) // limit)
        keep = np.arange(len(ns)) % stride == 0
        if stride > 1:
            spans = np.array(list(whole), dtype=np.float64).reshape(-1, 2) + np.array([-KEPT_AROUND, KEPT_AROUND])
            first, last = np.searchsorted(times, spans[:, 0]), np.searchsorted(times, spans[:, 1], side="right")
            # With misses everywhere nothing would be strided: the first ones keep their frames, up to two limits.
            near = int((np.cumsum(last - first) <= 2 * limit).sum())
            for begin, end in zip(first[:near], last[:near], strict=True):
                keep[begin:end] = True
        return cls(ns, np.flatnonzero(keep))


def on_session(ns: NDArray[np.int64]) -> rr.TimeColumn:
    """The session timeline at these nanoseconds."""
    return rr.TimeColumn(SESSION, duration=ns.astype("timedelta64[ns]"))


def packed(colours: Iterable[Rgba]) -> NDArray[np.uint32]:
    """Colours as 0xRRGGBBAA, (n,) uint32: Rerun takes Python integers for floats in some places."""
    return np.array([(r << 24) | (g << 16) | (b << 8) | a for r, g, b, a in colours], dtype=np.uint32)


def pose_columns(translations: FloatArray, rotations: FloatArray) -> rr.ComponentColumnList:
    """Poses as Rerun takes them: (n, 3) and (n, 3, 3), column convention."""
    turns = Rotation.from_matrix(rotations).as_quat(canonical=True).astype(np.float32)
    return rr.Transform3D.columns(translation=np.asarray(translations, dtype=np.float32), quaternion=turns)


def entity(*parts: str) -> str:
    """Entity path of these parts, without a leading slash; punctuation in a part is escaped."""
    return rr.new_entity_path([drawable(part) for part in parts]).removeprefix("/")


def ragged(columns: rr.ComponentColumnList, counts: ArrayLike) -> rr.ComponentColumnList:
    """Give ``counts[k]`` consecutive values to row k.

    ``AssertionError`` where the counts do not add up to the values there are: Rerun would shift every later row.
    """
    lengths = np.asarray(counts, dtype=np.int64)
    for column in columns:
        values = len(column.component_batch.as_arrow_array())
        assert int(lengths.sum()) == values, f"{int(lengths.sum())} values announced, {values} given"
    return columns.partition(lengths)


class RecordingWriter:
    """A Rerun stream and the clock of its rows. Every error raises; Rerun alone would only log it."""

    def __init__(self, stream: rr.RecordingStream, clock: RecordingClock) -> None:
        self.stream = stream
        self.clock = clock

    def name(self, text: str) -> None:
        """What the viewer calls the recording."""
        self.stream.send_recording_name(drawable(shown(text)))

    def static(self, path: str, *archetypes: rr.AsComponents) -> None:
        """Log what holds at all times."""
        for archetype in archetypes:
            self.stream.log(path, DrawableTexts(archetype), static=True, strict=True)

    def markdown(self, path: str, text: str) -> None:
        """Log words that stand at all times."""
        self.static(path, rr.TextDocument(shown(text, lines=True), media_type=rr.MediaType.MARKDOWN))

    def rows(
        self, path: str, frames: ArrayLike, columns: rr.ComponentColumnList, counts: ArrayLike | None = None
    ) -> None:
        """Send one row per frame on both timelines; with ``counts`` a row holds several values."""
        rows = np.asarray(frames, dtype=np.int64)
        self.rows_later(path, np.stack([rows, np.zeros_like(rows)], axis=1), columns, counts)

    def rows_later(
        self,
        path: str,
        moments: ArrayLike,
        columns: rr.ComponentColumnList,
        counts: ArrayLike | None = None,
    ) -> None:
        """Send one row per moment: a frame, and nanoseconds after it on the session timeline."""
        rows, later = np.asarray(moments, dtype=np.int64).reshape(-1, 2).T
        ns = self.clock.ns[rows] + later
        self._send(path, [on_session(ns), rr.TimeColumn(FRAME, sequence=rows)], columns, counts)

    def session_rows(
        self, path: str, ns: NDArray[np.int64], columns: rr.ComponentColumnList, counts: ArrayLike | None = None
    ) -> None:
        """Send rows on the session timeline alone, at any nanosecond."""
        self._send(path, [on_session(ns)], columns, counts)

    def curve(
        self, path: str, frames: ArrayLike, values: ArrayLike, name: str, colour: Rgba, width: float, *,
        step: bool = False,
    ) -> None:  # fmt: skip
        """Send a value per frame, and how their curve looks; a ``step`` is none that is sloped."""
        self.rows(path, frames, rr.Scalars.columns(scalars=values))
        # Peaks are what a curve is about; the default policy averages them away when zoomed out.
        peaks, steps = rr.components.AggregationPolicy.Max, rr.components.InterpolationMode.StepAfter
        line = rr.SeriesLines.from_fields(
            names=[name], colors=packed([colour]), widths=[width], aggregation_policy=peaks,
            interpolation_mode=steps if step else None,
        )  # fmt: skip
        self.static(path, line)

    def steps(
        self, path: str, steps: Steps, things: Mapping[Any, Any],
        columns: Callable[[list[Any]], rr.ComponentColumnList],
    ) -> None:  # fmt: skip
        """Send what stands from each step on: ``things`` of what is shown then."""
        rows = [things.get(shown, ()) for *_, shown in steps]
        flat = [thing for row in rows for thing in row]
        self.rows_later(path, [(frame, later) for frame, later, _ in steps], columns(flat), [*map(len, rows)])

    def _send(
        self, path: str, index: Sequence[rr.TimeColumn], columns: rr.ComponentColumnList, counts: ArrayLike | None
    ) -> None:
        if not len(columns):
            raise ValueError(f"no columns for {path}; Rerun dropped the values it was given")
        if len(index[0].as_arrow_array()):
            rows = columns if counts is None else ragged(columns, counts)
            for column in rows:
                column.component_batch = DrawableTexts(column.component_batch)
            self.stream.send_columns(path, index, rows, strict=True)


Steps = Sequence[tuple[int, int, Any]]
"""From a frame, and nanoseconds after it, on: what is shown."""


def steps_of(moments: Iterable[tuple[int, int, int, int, Any]], frames: int, otherwise: Any) -> Steps:
    """What is shown when: each moment from its first frame to its last, and at its own; ``otherwise`` at other times.

    ``moments``: frame, nanoseconds after it, first and last frame of each, and what is shown.
    """
    rows: dict[tuple[int, int], Any] = {}
    for frame, later, _, _, thing in moments:
        rows[frame, later] = thing
    for _, _, first, _, thing in moments:
        rows.setdefault((first, 0), thing)
    for _, _, _, last, _ in moments:
        if last + 1 < frames:
            rows.setdefault((last + 1, 0), otherwise)
    rows.setdefault((0, 0), otherwise)
    return [(*at, rows[at]) for at in sorted(rows)]


FOOTER: Final = struct.Struct("<QQI4s4sI")
"""How a recording ends: start and length of its table of contents, checksum, two marks, number of tables."""

ENCODED_WITHIN_S: Final = 600.0
"""Seconds after which Rerun is taken to hang: ten minutes of twelve bodies are encoded in less than one."""


@contextmanager
def recording_file(application: str, path: Path, blueprint: rrb.Blueprint) -> Iterator[rr.RecordingStream]:
    """A stream whose messages are in the file ``path`` when the block has ended.

    Raises ``OSError``: the file cannot be written, or what Rerun made is no complete recording.
    """
    stream = rr.RecordingStream(application, recording_id=uuid4())
    try:
        encoded = rr.binary_stream(recording=stream)
        stream.send_blueprint(blueprint, make_active=False, make_default=True)
        yield stream
        content = read_all(encoded)
    finally:
        stream.disconnect()
    require_complete(content)
    with whole_file(path, OutputError) as file:
        file.write(content)


def require_complete(content: bytes) -> None:
    """Raise ``OSError`` unless these are the bytes of one whole recording, from its first to its footer."""
    if len(content) >= FOOTER.size:
        start, length, _, *marks, tables = FOOTER.unpack(content[-FOOTER.size :])
        if marks == [b"RRF2", b"FOOT"] and tables == 1 and start + length + FOOTER.size == len(content):
            return
    raise OSError(f"the picture has no end after {len(content)} bytes: Rerun did not encode all of it")


def read_all(encoded: rr.BinaryStream) -> bytes:
    """What Rerun has encoded; ``OSError`` where that takes too long."""
    try:
        return encoded.read(flush=True, flush_timeout_sec=ENCODED_WITHIN_S) or b""
    except (RuntimeError, ValueError) as error:
        raise OSError(f"Rerun did not encode the picture within {ENCODED_WITHIN_S:g} s ({error})") from error


def name_layer(application: str, recording: str, name: str) -> bytes:
    """What a viewer opens over a recording, given by its ids, to list it under another name."""
    stream = rr.RecordingStream(application, recording_id=recording)
    try:
        encoded = rr.binary_stream(recording=stream)
        stream.send_recording_name(name)
        return read_all(encoded)
    finally:
        stream.disconnect()
