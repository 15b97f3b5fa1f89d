"""Messages of a whole chunk to frames at once, bit for bit what the protobuf library reads from each of them.

All messages of a chunk are cut into transforms in step (first transform of every message, second, ...), and each step
is compared with the layout met there before: one comparison, one gather. Bytes that fit no layout fall back to the
protobuf library, message by message; so do layouts too many to be worth learning.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from google.protobuf.message import DecodeError
from numpy.typing import NDArray

from sessions.errors import SessionFileError
from sessions.frames import Frames, Status
from sessions.mcap_format.annotations import stamp_ns
from sessions.mcap_format.pose_encoding import SECOND_NS
from sessions.mcap_format.schemas import message_class
from sessions.mcap_format.transform_template import TransformTemplate, stamp_overflows, transform_template
from sessions.mcap_format.unpacking import MessageTable, rows_at

# Layouts learnt per length of a transform before the rest goes to the protobuf library. A session has one per body, a
# foreign file some six (lengths of a stamp's varints, zeros left out); the bound keeps hostile files linear.
LAYOUTS_PER_LENGTH = 512
_TRANSFORM_TAG = 0x0A


@dataclass(eq=False)
class _Samples:
    """Samples of one body: message numbers, stamps, and values (n, 7)."""

    rows: NDArray[np.int64]
    child: str
    stamped: bool
    sample_ns: NDArray[np.int64]
    values: NDArray[np.float64]

    def without(self, rows: NDArray[np.bool_]) -> _Samples:
        """These samples but those of messages that are read another way."""
        keep = ~rows[self.rows]
        return _Samples(self.rows[keep], self.child, self.stamped, self.sample_ns[keep], self.values[keep])


class FrameDecoder:
    """Decodes regions in file order; remembers layouts, and the validity note that waits for its frame.

    Parameters
    ----------
    where : what to call the file in errors.
    tf, tracking : channel ids of the two topics.
    names : bodies, one per column; ``None``: columns are added as bodies appear (`names` tells them).
    """

    def __init__(self, where: str, tf: set[int], tracking: set[int], names: tuple[str, ...] | None) -> None:
        self._where, self._tf, self._tracking = where, tf, tracking
        self._grow = names is None
        self._columns = {name: column for column, name in enumerate(names or ())}
        self._parent: str | None = None
        self._known: dict[int, list[TransformTemplate]] = {}
        self._hint: dict[tuple[int, int], TransformTemplate] = {}
        self._notes: dict[bytes, list[tuple[str, int]]] = {}
        self._pending: tuple[tuple[int, int, int], bytes] | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """The bodies, one per column."""
        return tuple(self._columns)

    def decode(self, table: MessageTable) -> Frames:
        """The frames of one region.

        Raises
        ------
        SessionFileError
            A message that is no FrameTransforms, a body twice in one frame, a body not in the list, two parents.
        """
        rows = table.of_channels(self._tf)
        start, end = table.start[rows], table.end[rows]
        samples, irregular = self._regular(table, start, end)
        irregular_rows = np.flatnonzero(irregular)
        if len(irregular_rows):
            samples = [part.without(irregular) for part in samples]
            for row in irregular_rows.tolist():
                samples += self._parsed(row, table.payload(int(rows[row])))
        return self._noted(table, rows, self._assembled(samples, table.publish_ns[rows], table.log_ns[rows]))

    def _regular(
        self, table: MessageTable, start: NDArray[np.int64], end: NDArray[np.int64]
    ) -> tuple[list[_Samples], NDArray[np.bool_]]:
        """Samples read through layouts, and which messages must be read by the protobuf library."""
        buffer = np.frombuffer(table.data, dtype=np.uint8)
        irregular = np.zeros(len(start), dtype=np.bool_)
        samples: list[_Samples] = []
        cursor, step = start.copy(), 0
        alive = np.flatnonzero(cursor < end)
        while len(alive):
            body, after = _next_transform(buffer, cursor[alive], end[alive])
            bad = after < 0
            if bad.any():
                irregular[alive[bad]] = True
                alive, body, after = alive[~bad], body[~bad], after[~bad]
            length = after - body
            for size in np.unique(length).tolist():
                chosen = slice(None) if (length == size).all() else length == size
                samples += self._matched(buffer, body[chosen], size, step, alive[chosen], irregular)
            cursor[alive] = after
            alive, step = alive[after < end[alive]], step + 1
        return samples, irregular

    def _matched(
        self,
        buffer: NDArray[np.uint8],
        body: NDArray[np.int64],
        size: int,
        step: int,
        rows: NDArray[np.int64],
        irregular: NDArray[np.bool_],
    ) -> Iterator[_Samples]:
        """Transforms of one length at one step, layout by layout."""
        data = rows_at(buffer, body, size)
        known = self._known.setdefault(size, [])
        hint = self._hint.get((step, size))
        for template in [hint, *known] if hint is not None else list(known):
            fits = template.agrees(data)
            if fits.any():
                self._hint[step, size] = template
                yield self._samples(template, data[fits], rows[fits])
                data, rows = data[~fits], rows[~fits]
            if not len(data):
                return
        while len(data) and len(known) < LAYOUTS_PER_LENGTH:
            new = transform_template(data[0].tobytes())
            if new is None:
                break
            known.append(new)
            self._hint[step, size] = new
            fits = new.agrees(data)
            yield self._samples(new, data[fits], rows[fits])
            data, rows = data[~fits], rows[~fits]
        irregular[rows] = True

    def _samples(self, template: TransformTemplate, data: NDArray[np.uint8], rows: NDArray[np.int64]) -> _Samples:
        self._check_parent(template.parent)
        seconds, nanos = template.stamps(data)
        if stamp_overflows(seconds):
            raise self._error("a transform is stamped beyond the year 2262")
        return _Samples(rows, template.child, template.stamped, seconds * SECOND_NS + nanos, template.values(data))

    def _parsed(self, row: int, payload: bytes) -> Iterator[_Samples]:
        """The samples of one message as the protobuf library reads them."""
        try:
            message = FrameTransforms.FromString(payload)
        except DecodeError:
            raise self._error("a message on /tf is no foxglove.FrameTransforms") from None
        for one in message.transforms:
            self._check_parent(one.parent_frame_id)
            stamped, time_ns = one.HasField("timestamp"), stamp_ns(one.timestamp)
            if stamp_overflows(np.array([one.timestamp.seconds])):
                raise self._error("a transform is stamped beyond the year 2262")
            p, q = one.translation, one.rotation
            yield _Samples(
                np.array([row]), one.child_frame_id, stamped, np.array([time_ns]),
                np.array([[p.x, p.y, p.z, q.x, q.y, q.z, q.w]]),
            )  # fmt: skip

    def _check_parent(self, parent: str) -> None:
        self._parent = parent if self._parent is None else self._parent
        if parent != self._parent:
            raise self._error(
                f"/tf holds transforms with parents {self._parent!r} and {parent!r}, and a session has one "
                "world; write all poses in one frame"
            )

    def _column(self, name: str) -> int:
        if name not in self._columns:
            if not self._grow:
                raise self._error(f"/tf holds body {name!r}, which metadata vrlab.bodies does not list")
            self._columns[name] = len(self._columns)
        return self._columns[name]

    def _assembled(self, samples: list[_Samples], stamp: NDArray[np.int64], log_ns: NDArray[np.int64]) -> Frames:
        columns = [self._column(part.child) for part in samples]
        shape = (len(stamp), len(self._columns))
        sample = np.zeros(shape, dtype=np.int64)
        position, quaternion = np.full((*shape, 3), np.nan), np.full((*shape, 4), np.nan)
        status = np.zeros(shape, dtype=np.uint8)
        for part, column in zip(samples, columns, strict=True):
            if status[part.rows, column].any():
                raise self._error(f"a message on /tf holds body {part.child!r} twice")
            sample[part.rows, column] = part.sample_ns if part.stamped else stamp[part.rows]
            position[part.rows, column] = part.values[:, :3]
            quaternion[part.rows, column] = part.values[:, 3:]
            status[part.rows, column] = Status.VALID
        return Frames(self.names, stamp, log_ns, sample, position, quaternion, status)

    def _noted(self, table: MessageTable, rows: NDArray[np.int64], frames: Frames) -> Frames:
        """The frames with their validity: a note on /tracking belongs to the next frame, if their stamps agree."""
        notes = table.of_channels(self._tracking)
        if not len(notes) and self._pending is None:
            return frames
        status = frames.status.copy()
        owner = np.searchsorted(rows, notes)
        waiting = [] if self._pending is None else [(0, *self._pending)]
        self._pending = None
        for note, frame in zip(notes.tolist(), owner.tolist(), strict=True):
            waiting.append((frame, _identity(table, note), table.payload(note)))
        for frame, identity, payload in waiting:
            if frame == len(rows):
                self._pending = (identity, payload)
            elif identity == _identity(table, int(rows[frame])):
                self._apply(status[frame], payload)
        return Frames(
            frames.names,
            frames.stamp_ns,
            frames.log_ns,
            frames.sample_ns,
            frames.position,
            frames.quaternion_xyzw,
            status,
        )

    def _apply(self, status: NDArray[np.uint8], payload: bytes) -> None:
        if payload not in self._notes:
            try:
                message = message_class("Tracking").FromString(payload)
            except DecodeError:
                raise self._error("a message on /tracking is no vrlab.Tracking") from None
            self._notes[payload] = [(one.name, one.status) for one in message.bodies]
        for name, value in self._notes[payload]:
            column = self._columns.get(name)
            if column is not None and status[column] != Status.ABSENT and value in _NOTED:
                status[column] = value

    def _error(self, what: str) -> SessionFileError:
        return SessionFileError(f"{self._where}: {what}; run `replay doctor` on the file")


_NOTED = (Status.LOST, Status.HELD, Status.INTERPOLATED)


def _identity(table: MessageTable, row: int) -> tuple[int, int, int]:
    return int(table.sequence[row]), int(table.publish_ns[row]), int(table.log_ns[row])


def _next_transform(
    buffer: NDArray[np.uint8], at: NDArray[np.int64], end: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First byte of the next transform of each message and the byte after it, -1 where the protobuf library must look.

    The length before a transform takes one or two bytes; 16 KiB in one transform is nothing a session holds.
    """
    last = len(buffer) - 1
    low = buffer[np.minimum(at + 1, last)].astype(np.int64)
    high = buffer[np.minimum(at + 2, last)].astype(np.int64)
    short = low < 0x80
    length = np.where(short, low, (low & 0x7F) | high << 7)
    body = at + np.where(short, 2, 3)
    after = body + length
    good = (buffer[at] == _TRANSFORM_TAG) & (short | (high < 0x80)) & (after <= end)
    return body, np.where(good, after, -1)
