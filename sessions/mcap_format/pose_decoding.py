"""Messages of a whole chunk to frames at once, each sample with the validity that /tracking gives it."""

from collections import Counter
from collections.abc import Iterator
from copy import copy

import numpy as np
from google.protobuf.message import DecodeError
from numpy.typing import NDArray

from sessions.errors import SessionFileError
from sessions.mcap_format.catalogue import Catalogue
from sessions.mcap_format.metadata import MAX_BODIES
from sessions.mcap_format.pose_encoding import FRAME_WITHOUT_SAMPLES
from sessions.mcap_format.refusals import TOO_MANY, refused
from sessions.mcap_format.schemas import TF, TRACKING, message_class
from sessions.mcap_format.transform_reading import BodySamples, TransformReader
from sessions.mcap_format.unpacking import MessageTable
from sessions.model.frames import Frames, Status, absent_samples

# Cells (frames times bodies) made at once, 65 bytes each: an ordinary chunk of 12 bodies has 11,000, a hostile one
# that declares thousands of bodies and holds millions of empty frames is cut into parts of 17 MB.
CELLS_AT_ONCE = 1 << 18
# A message of /tf: 100 bytes per body, so this is 10,000 bodies.
MESSAGE_BYTES = 1 << 20

_NOTED = (Status.LOST, Status.HELD, Status.INTERPOLATED)
_Identity = tuple[int, int, int]


class FrameDecoder:
    """Decodes regions in file order; remembers layouts, and the validity note that waits for its frame.

    ``names`` are the bodies, one per column; ``None``: columns are added as bodies appear. More frames times bodies, or
    more bodies that messages repeat or note, than the file has room for are refused. ``window``: frames whose stamps
    lie outside are not decoded.
    """

    def __init__(
        self, catalogue: Catalogue, names: tuple[str, ...] | None, window: tuple[int, int] | None = None
    ) -> None:
        self._window = window
        self._catalogue = catalogue
        self._grow = names is None
        self._columns = {name: column for column, name in enumerate(names or ())}
        self._parent: str | None = None
        self._reader = TransformReader(self._refused)
        self._notes: dict[bytes, list[tuple[str, int]]] = {}
        self._pending: tuple[_Identity, bytes] | None = None
        self.doubled = Counter[str]()
        self._samples_left = catalogue.most_samples

    def fork(self) -> "FrameDecoder":
        """A decoder that goes on from here and leaves this one as it is."""
        made = copy(self)
        made._columns = dict(self._columns)
        return made

    @property
    def names(self) -> tuple[str, ...]:
        """The bodies, one per column."""
        return tuple(self._columns)

    def frame_rows(self, table: MessageTable) -> NDArray[np.int64]:
        """Numbers of the messages that are frames, with samples or without."""
        return self._frames_and_notes(table)[0]

    def _frames_and_notes(self, table: MessageTable) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        notes = table.of_channels(self._catalogue.ids(TRACKING))
        empty = np.array([table.payload(row) == FRAME_WITHOUT_SAMPLES for row in notes.tolist()], dtype=np.bool_)
        return np.union1d(table.of_channels(self._catalogue.ids(TF)), notes[empty]), notes[~empty]

    def decode(self, table: MessageTable) -> Iterator[Frames]:
        """The frames of one region, in parts of bounded size; a message that is not what it should be is an error."""
        rows, notes = self._frames_and_notes(table)
        size = table.end[rows] - table.start[rows]
        if len(size) and size.max() > MESSAGE_BYTES:
            raise self._refused(f"a message on /tf takes {size.max()} bytes, more than the {MESSAGE_BYTES} allowed")
        pending = self._notes_of(table, rows, notes)
        if self._window is not None:
            stamps = table.publish_ns[rows]
            inside = np.flatnonzero((stamps >= self._window[0]) & (stamps <= self._window[1]))
            numbers = {row: number for number, row in enumerate(inside.tolist())}
            rows, pending = rows[inside], {numbers[row]: note for row, note in pending.items() if row in numbers}
        at_once = max(1, CELLS_AT_ONCE // max(1, len(self._columns)))
        for start in range(0, len(rows), at_once):
            part = rows[start : start + at_once]
            mine = {row - start: note for row, note in pending.items() if start <= row < start + len(part)}
            yield self._frames(table, part, mine)

    def _frames(self, table: MessageTable, rows: NDArray[np.int64], notes: dict[int, bytes]) -> Frames:
        end = np.where(np.isin(table.channel[rows], list(self._catalogue.ids(TF))), table.end[rows], table.start[rows])
        samples = self._samples(table, rows, end)
        columns = [self._column(part.parent, part.child) for part in samples]
        stamp, shape = table.publish_ns[rows], (len(rows), len(self._columns))
        self._samples_left -= shape[0] * shape[1]
        if self._samples_left < 0:
            raise self._refused(f"it has more frames of {shape[1]} bodies than a file of its size holds", "too-much")
        sample, position, quaternion, status = absent_samples(*shape)
        for part, column in zip(samples, columns, strict=True):
            sample[part.rows, column] = part.sample_ns if part.stamped else stamp[part.rows]
            position[part.rows, column] = part.values[:, :3]
            quaternion[part.rows, column] = part.values[:, 3:]
            status[part.rows, column] = Status.VALID
        for row, payload in notes.items():
            self._apply(status[row], payload)
        return Frames(self.names, stamp, table.log_ns[rows], sample, position, quaternion, status)

    def _samples(self, table: MessageTable, rows: NDArray[np.int64], end: NDArray[np.int64]) -> list[BodySamples]:
        """The samples of some messages, body by body, in the order in which the messages hold them.

        Of several samples of a body in one message the first is taken; the others are counted in ``doubled``.
        """
        found = self._reader.read(table.data, table.start[rows], end, self._samples_left)
        samples = [part for part in found if len(part.rows)]
        samples.sort(key=lambda part: (part.step, part.rows[0]))
        kept: list[BodySamples] = []
        taken: dict[str, NDArray[np.bool_]] = {}
        for part in samples:
            before = taken.setdefault(part.child, np.zeros(len(rows), dtype=np.bool_))
            single = part.without(before) if before[part.rows].any() else part
            if len(single.rows) < len(part.rows):
                self.doubled[part.child] += len(part.rows) - len(single.rows)
                self._count(len(part.rows) - len(single.rows))
            before[part.rows] = True
            kept += [single] if len(single.rows) else []
        return sorted(kept, key=lambda part: (part.rows[0], part.step))

    def _count(self, more: int) -> None:
        """Count what messages hold beyond a sample of each body."""
        self._samples_left -= more
        if self._samples_left < 0:
            raise self._refused(TOO_MANY, "too-much")

    def _column(self, parent: str, name: str) -> int:
        self._parent = parent if self._parent is None else self._parent
        if parent != self._parent:
            what = f"/tf holds transforms with parents {self._parent!r} and {parent!r}, and a session has one world"
            raise self._refused(what, "unknown-frame")
        if name not in self._columns:
            if not self._grow:
                raise self._refused(
                    f"/tf holds body {name!r}, which metadata vrlab.bodies does not list", "unlisted-body"
                )
            if len(self._columns) == MAX_BODIES:
                raise self._refused(f"/tf holds more than {MAX_BODIES} bodies", "too-much")
            self._columns[name] = len(self._columns)
        return self._columns[name]

    def _notes_of(self, table: MessageTable, rows: NDArray[np.int64], notes: NDArray[np.int64]) -> dict[int, bytes]:
        """Frame number -> its note. A note belongs to the next frame if sequence and stamps agree, else to none."""
        waiting = {} if self._pending is None else {0: self._pending}
        for note, frame in zip(notes.tolist(), np.searchsorted(rows, notes).tolist(), strict=True):
            waiting[frame] = (_identity(table, note), table.payload(note))
        self._pending = waiting.pop(len(rows), None)
        return {
            frame: payload
            for frame, (identity, payload) in waiting.items()
            if identity == _identity(table, int(rows[frame]))
        }

    def _apply(self, status: NDArray[np.uint8], payload: bytes) -> None:
        if payload not in self._notes:
            try:
                message = message_class("Tracking").FromString(payload)
            except DecodeError:
                raise self._refused("a message on /tracking is no vrlab.Tracking") from None
            if len(self._notes) >= MAX_BODIES:
                self._notes.clear()
            self._notes[payload] = [(one.name, one.status) for one in message.bodies]
        self._count(max(0, len(self._notes[payload]) - len(self._columns)))
        for name, value in self._notes[payload]:
            column = self._columns.get(name)
            if column is not None and status[column] != Status.ABSENT and value in _NOTED:
                status[column] = value

    def _refused(self, what: str, code: str = "bad-message") -> SessionFileError:
        return refused(self._catalogue.path, code, what)


def _identity(table: MessageTable, row: int) -> _Identity:
    return int(table.sequence[row]), int(table.publish_ns[row]), int(table.log_ns[row])
