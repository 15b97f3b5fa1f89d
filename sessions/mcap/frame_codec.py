"""The frame codec: many frames of poses are written to messages, and read from them, column by column.

Every body takes the same number of bytes in every frame, because the two numbers of a stamp are written as varints
padded to full width and zeros are written like any other number. Both are valid protobuf (a padded varint has
continuation bits and zeros at its end), and every decoder reads them: 54,000 frames of 12 bodies take 0.16 times the
time of filling one reused message object per frame. The bytes decode to the same numbers, bit for bit.

The protobuf library reads one message. Where bodies stand in as many bytes as the encoder writes, all messages of that
length which agree with those bytes in everything but the numbers are read with one comparison and one gather; each
sample gets the validity that /tracking gives it. All other messages, such as those of other programs, are left to the
protobuf library, one by one.

Source: Protocol Buffers encoding, https://protobuf.dev/programming-guides/encoding.
"""

from collections import Counter
from collections.abc import Iterable, Iterator
from copy import copy
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from google.protobuf.message import DecodeError
from numpy.typing import NDArray

from sessions.errors import SessionFileError
from sessions.mcap.container import Catalogue, MessageRecord
from sessions.mcap.metadata import MAX_BODIES
from sessions.mcap.refusals import TOO_MANY, refusal
from sessions.mcap.schemas import TF, TRACKING, WORLD, message_class
from sessions.mcap.unpacking import MessageTable, rows_at
from sessions.model.session import Frames, Status, absent_samples

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Doubles = NDArray[np.float64]

# Five groups of seven bits hold 2^35 s, more than int64 nanoseconds reach; a negative number needs all ten.
SECONDS_WIDTH, NEGATIVE_WIDTH, NANOS_WIDTH = 5, 10, 5
_GROUP_WEIGHTS = np.uint64(1) << np.arange(0, 7 * NEGATIVE_WIDTH, 7, dtype=np.uint64)
DOUBLE_BYTES = 9
"""A double and the tag before it."""


class ByteOffsets(NamedTuple):
    """The first bytes of the numbers of a body in a message."""

    seconds: int
    nanos: int
    doubles: tuple[int, ...]
    """Position x y z, quaternion x y z w."""


@dataclass(frozen=True, eq=False)
class FrameLayout:
    """A ``foxglove.FrameTransforms`` of some bodies: its bytes, with zeros where numbers go, and where they go."""

    template: Bytes
    bodies: tuple[ByteOffsets, ...]
    seconds_width: int

    def table(self, seconds: Ints, nanos: Ints, position: Doubles, quaternion: Doubles) -> Bytes:
        """One message a row, of stamps (n, bodies), positions (n, bodies, 3) and quaternions (n, bodies, 4)."""
        table = np.empty((len(seconds), len(self.template)), dtype=np.uint8)
        table[:] = self.template
        for column, offsets in enumerate(self.bodies):
            _put_varint(table, offsets.seconds, seconds[:, column], self.seconds_width)
            _put_varint(table, offsets.nanos, nanos[:, column], NANOS_WIDTH)
            coordinates = (*position[:, column].T, *quaternion[:, column].T)
            for offset, numbers in zip(offsets.doubles, coordinates, strict=True):
                column_view(table, offset)[:] = numbers
        return table

    @cached_property
    def _fixed(self) -> tuple[Bytes, Bytes]:
        """The bits that belong to no number, and what they are."""
        zeros, set_bits = (self._filled(bits) for bits in (0, -1))
        fixed = ~(zeros ^ set_bits)
        return fixed, zeros & fixed

    def _filled(self, bits: int) -> Bytes:
        """A message in whose numbers all bits are 0, or (-1) all are 1."""
        stamps = np.full((1, len(self.bodies)), bits)
        poses = np.full((1, len(self.bodies), 4), bits).view(np.float64)
        return self.table(stamps, stamps, poses[..., :3], poses)[0]

    def fits(self, table: Bytes) -> NDArray[np.bool_]:
        """Mask of the messages, a row each, that hold these bodies with their numbers at these offsets."""
        fixed, pattern = self._fixed
        return ((table & fixed) == pattern).all(axis=1)

    def stamps(self, table: Bytes, body: int) -> tuple[Ints, Ints]:
        """Seconds and nanoseconds (n,) of a body, as the protobuf library reads them: of 64 and of 32 bits."""
        offsets = self.bodies[body]
        nanos = _varints(table, offsets.nanos, NANOS_WIDTH).astype(np.uint32).view(np.int32)
        return _varints(table, offsets.seconds, self.seconds_width).view(np.int64), nanos.astype(np.int64)

    def values(self, table: Bytes, body: int) -> Doubles:
        """Position and quaternion of a body, (n, 7)."""
        return np.stack([column_view(table, offset) for offset in self.bodies[body].doubles], axis=1)


@lru_cache(maxsize=256)
def frame_layout(names: tuple[str, ...], seconds_width: int) -> FrameLayout:
    """The layout of frames in which these bodies have samples."""
    stamp = _field(1, b"\x08" + bytes(seconds_width) + b"\x10" + bytes(NANOS_WIDTH))
    translation, rotation = _field(4, _doubles(3)), _field(5, _doubles(4))
    template, bodies = bytearray(), []
    for name in names:
        before = stamp + _field(2, WORLD.encode()) + _field(3, name.encode())
        content = before + translation + rotation
        template += _field(1, content)
        start = len(template) - len(content)
        position = start + len(before) + 3
        quaternion = position + len(translation)
        doubles = [position + DOUBLE_BYTES * axis for axis in range(3)]
        doubles += [quaternion + DOUBLE_BYTES * axis for axis in range(4)]
        bodies.append(ByteOffsets(start + 3, start + 4 + seconds_width, tuple(doubles)))
    return FrameLayout(np.frombuffer(bytes(template), dtype=np.uint8), tuple(bodies), seconds_width)


def _field(number: int, content: bytes) -> bytes:
    return bytes([number << 3 | 2]) + varint(len(content)) + content


def varint(value: int) -> bytes:
    """A non-negative integer as the shortest varint."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def _doubles(count: int) -> bytes:
    return b"".join(bytes([number << 3 | 1]) + bytes(8) for number in range(1, count + 1))


def _put_varint(table: Bytes, at: int, values: Ints, width: int) -> None:
    """Write varints padded to a width with continuation bits; negative ones as 64-bit two's complement."""
    bits = values.astype(np.int64).view(np.uint64)
    for byte in range(width):
        more = 0x80 if byte < width - 1 else 0
        table[:, at + byte] = ((bits >> np.uint64(7 * byte)) & np.uint64(0x7F)).astype(np.uint8) | more


def _varints(table: Bytes, at: int, width: int) -> NDArray[np.uint64]:
    """The varints of this width that begin at byte ``at`` of every row."""
    return (table[:, at : at + width] & np.uint8(0x7F)).astype(np.uint64) @ _GROUP_WEIGHTS[:width]


def column_view(table: Bytes, at: int) -> Doubles:
    """The doubles that begin at byte ``at`` of every row of a table of bytes, as a view."""
    return np.ndarray((len(table),), dtype="<f8", buffer=table, offset=at, strides=(table.shape[1],))


SECOND_NS = 1_000_000_000
# A frame in which no body has a sample is this message on /tracking and none on /tf: the MCAP importer of Rerun 0.41
# aborts the whole process on a FrameTransforms without transforms (index out of bounds, 2026-11).
FRAME_WITHOUT_SAMPLES = b"\x10\x01"


def check_stamp(what: str, time_ns: int) -> None:
    """Refuse a stamp before 0, which an MCAP file cannot hold."""
    if time_ns < 0:
        raise SessionFileError(
            f"{what} stamped {time_ns} ns, and a session file starts at 0; shift all stamps of the session so that "
            "none is negative"
        )


class FrameEncoder:
    """Turns frames into records of ``/tf`` and ``/tracking``.

    A frame whose present samples are all valid is one ``/tf`` message. Any other has a ``/tracking`` message with the
    same sequence and stamps just before it, which names the bodies that are not valid; so each frame can be judged
    without what came before, and a file cut between the two never turns a lost sample into a valid one. A frame without
    any sample is a ``/tracking`` message alone.
    """

    def __init__(self, tf_channel: int, tracking_channel: int) -> None:
        self._tf, self._tracking = tf_channel, tracking_channel
        self._payloads: dict[tuple[tuple[str, ...], bytes], bytes] = {}
        self._sequence = 0

    def encode(self, frames: Frames) -> Iterator[MessageRecord]:
        """The messages of each frame, numbered on from the last call; a stamp before 0 is an error."""
        if not len(frames):
            return
        check_stamp("a frame is", int(min(frames.stamp_ns.min(), frames.log_ns.min())))
        sequence = np.arange(self._sequence, self._sequence + len(frames)) % (1 << 32)
        self._sequence += len(frames)
        channel = np.where((frames.status == Status.ABSENT).all(axis=1), self._tracking, self._tf)
        columns = (channel.tolist(), sequence.tolist(), frames.log_ns.tolist(), frames.stamp_ns.tolist())
        for note, *record in zip(self._tracking_payloads(frames), *columns, _payloads(frames), strict=True):
            if note:
                yield self._tracking, *record[1:4], note
            yield tuple(record)

    def _tracking_payloads(self, frames: Frames) -> list[bytes]:
        """For each frame the ``/tracking`` payload, or nothing when all its samples are valid."""
        notes = [b""] * len(frames)
        odd = (frames.status != Status.VALID) & (frames.status != Status.ABSENT)
        for row in np.flatnonzero(odd.any(axis=1)).tolist():
            key = (frames.names, frames.status[row].tobytes())
            if key not in self._payloads:
                message = message_class("Tracking")()
                for column in np.flatnonzero(odd[row]).tolist():
                    message.bodies.add(name=frames.names[column], status=int(frames.status[row, column]))
                self._payloads[key] = bytes(message.SerializeToString(deterministic=True))
            notes[row] = self._payloads[key]
        return notes


def _payloads(frames: Frames) -> list[bytes]:
    """The message of each frame; those of frames with the same bodies are the rows of a table."""
    present = frames.status != Status.ABSENT
    negative = ((frames.sample_ns < 0) & present).any(axis=1)
    key = np.packbits(np.column_stack([present, negative]), axis=1)
    if (key == key[0]).all():
        groups = [np.arange(len(frames))]
    else:
        kinds = np.unique(key, axis=0, return_inverse=True)[1].reshape(-1)
        order = np.argsort(kinds, kind="stable")
        groups = np.split(order, np.flatnonzero(np.diff(kinds[order])) + 1)
    seconds, nanos = np.divmod(frames.sample_ns, SECOND_NS)
    encodings = [FRAME_WITHOUT_SAMPLES] * len(frames)
    for rows in groups:
        bodies = np.flatnonzero(present[rows[0]])
        if len(bodies):
            names = tuple(frames.names[body] for body in bodies)
            layout = frame_layout(names, NEGATIVE_WIDTH if negative[rows[0]] else SECONDS_WIDTH)
            cells: Any = ... if len(rows) * len(bodies) == present.size else np.ix_(rows, bodies)
            poses = frames.position[cells], frames.quaternion_xyzw[cells]
            table = layout.table(seconds[cells], nanos[cells], *poses)
            for row, payload in zip(rows.tolist(), table, strict=True):
                encodings[row] = payload.tobytes()
    return encodings


# Cells (frames times bodies) made at once, 65 bytes each: an ordinary chunk of 12 bodies has 11,000, a hostile one
# that declares thousands of bodies and holds millions of empty frames is cut into parts of 17 MB.
CELLS_AT_ONCE = 1 << 18
# A message of /tf: 100 bytes per body, so this is 10,000 bodies.
MESSAGE_BYTES = 1 << 20
MOST_TRANSFORMS = 4096
# Messages of one length are read set of bodies by set of bodies, this many at most, as long as so many messages are
# left: a message of 12 bodies takes the protobuf library 18 us, a set of bodies takes about 1 ms.
LAYOUTS_PER_LENGTH, FEWEST_OF_A_LAYOUT = 32, 64

_NOTED = (Status.LOST, Status.HELD, Status.INTERPOLATED)
_Identity = tuple[int, int, int]


@dataclass(frozen=True, eq=False)
class BodySamples:
    """Samples of one body, whose frames are ``parent`` and ``child``."""

    rows: NDArray[np.int64]
    """(n,) numbers of their messages, ascending."""
    step: int
    """Place in the first of these messages."""
    parent: str
    child: str
    stamped: bool
    """Whether they have device stamps."""
    sample_ns: NDArray[np.int64]
    values: NDArray[np.float64]
    """(n, 7) position and quaternion xyzw."""


@dataclass
class Appearance:
    """How often, and from when to when (frame stamps), a body was given in a frame."""

    first_ns: int
    last_ns: int
    count: int = 0


class FrameDecoder:
    """Decodes regions in file order; remembers layouts, and the validity note that waits for its frame.

    ``names`` are the bodies, one per column; ``None``: columns are added as bodies appear. More frames times bodies, or
    more bodies that messages repeat or note, than the file has room for are refused. One that is not ``strict`` adds
    bodies that are not among the names, takes poses in every frame, and notes in ``met`` when each of both was met.
    """

    def __init__(self, catalogue: Catalogue, names: tuple[str, ...] | None, *, strict: bool = True) -> None:
        self._catalogue, self._strict = catalogue, strict
        self._grow = names is None or not strict
        self._columns = {name: column for column, name in enumerate(names or ())}
        self._parent: str | None = None
        self._notes: dict[bytes, list[tuple[str, int]]] = {}
        self._pending: tuple[_Identity, bytes] | None = None
        self.doubled = Counter[str]()
        self.met: dict[tuple[str, str], Appearance] = {}
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

    def _frames_and_notes(self, table: MessageTable) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        notes = table.of_channels(self._catalogue.ids(TRACKING))
        empty = np.array([table.payload(row) == FRAME_WITHOUT_SAMPLES for row in notes.tolist()], dtype=np.bool_)
        return np.union1d(table.of_channels(self._catalogue.ids(TF)), notes[empty]), notes[~empty]

    def decode(self, table: MessageTable) -> Iterator[Frames]:
        """The frames of one region, in parts of bounded size; a message that is not what it should be is an error."""
        rows, notes = self._frames_and_notes(table)
        size = table.end[rows] - table.start[rows]
        if len(size) and size.max() > MESSAGE_BYTES:
            raise self._refusal(f"a message on /tf takes {size.max()} bytes, more than the {MESSAGE_BYTES} allowed")
        pending = self._notes_of(table, rows, notes)
        at_once = max(1, CELLS_AT_ONCE // max(1, len(self._columns)))
        for start in range(0, len(rows), at_once):
            chunk = rows[start : start + at_once]
            mine = {row - start: note for row, note in pending.items() if start <= row < start + len(chunk)}
            yield self._frames(table, chunk, mine)

    def _frames(self, table: MessageTable, rows: NDArray[np.int64], notes: dict[int, bytes]) -> Frames:
        end = np.where(np.isin(table.channel[rows], list(self._catalogue.ids(TF))), table.end[rows], table.start[rows])
        samples = self._samples(table, rows, end)
        columns = [self._column(body.parent, body.child) for body in samples]
        stamp, shape = table.publish_ns[rows], (len(rows), len(self._columns))
        for body in () if self._strict else samples:
            times = stamp[body.rows]
            appearance = self.met.setdefault((body.parent, body.child), Appearance(int(times[0]), int(times[0])))
            appearance.first_ns, appearance.last_ns = (
                min(appearance.first_ns, int(times.min())),
                max(appearance.last_ns, int(times.max())),
            )
            appearance.count += len(times)
        self._samples_left -= shape[0] * shape[1]
        if self._samples_left < 0:
            raise self._refusal(f"it has more frames of {shape[1]} bodies than a file of its size holds", "too-much")
        sample, position, quaternion, status = absent_samples(*shape)
        for body, column in zip(samples, columns, strict=True):
            sample[body.rows, column] = body.sample_ns if body.stamped else stamp[body.rows]
            position[body.rows, column] = body.values[:, :3]
            quaternion[body.rows, column] = body.values[:, 3:]
            status[body.rows, column] = Status.VALID
        for row, payload in notes.items():
            self._apply(status[row], payload)
        return Frames(self.names, stamp, table.log_ns[rows], sample, position, quaternion, status)

    def _samples(self, table: MessageTable, rows: NDArray[np.int64], end: NDArray[np.int64]) -> list[BodySamples]:
        """The samples of some messages, bodies in the order in which they appear.

        Of several samples of a body in one message the first is taken; the others are counted in ``doubled``.
        """
        start = table.start[rows]
        size = end - start
        order = np.argsort(size, kind="stable")
        decoded: list[BodySamples] = []
        others: list[int] = []
        for left in np.split(order, np.flatnonzero(np.diff(size[order])) + 1):
            length = int(size[left[0]]) if len(left) else 0
            for _ in range(LAYOUTS_PER_LENGTH if length else 0):
                if len(left) < FEWEST_OF_A_LAYOUT:
                    break
                samples = self._alike(rows_at(np.frombuffer(table.data, np.uint8), start[left], length), left)
                if not samples:
                    break
                decoded += samples
                left = np.setdiff1d(left, samples[0].rows, assume_unique=True)
            others += left.tolist() if length else []
        decoded += self._parsed([(row, table.data[start[row] : end[row]]) for row in sorted(others)])
        return sorted(decoded, key=lambda body: (body.rows[0], body.step))

    def _alike(self, messages: NDArray[np.uint8], rows: NDArray[np.int64]) -> list[BodySamples]:
        """The samples of all messages (n, length) that hold the bodies of the first as `FrameEncoder` writes them."""
        transforms = self._transforms(messages[0].tobytes())
        names = tuple(transform.child_frame_id for transform in transforms)
        negative = any(transform.timestamp.seconds < 0 for transform in transforms)
        layout = frame_layout(names, NEGATIVE_WIDTH if negative else SECONDS_WIDTH)
        if len(layout.template) != messages.shape[1] or len(set(names)) < len(names):
            return []
        fits = layout.fits(messages)
        if not fits[0]:
            return []
        table, samples = messages[fits], []
        for step, name in enumerate(names):
            seconds, nanos = layout.stamps(table, step)
            times = self._times(seconds, nanos)
            samples.append(BodySamples(rows[fits], step, WORLD, name, True, times, layout.values(table, step)))
        return samples

    def _parsed(self, messages: Iterable[tuple[int, bytes]]) -> Iterator[BodySamples]:
        """The samples of numbered messages as the protobuf library reads them."""
        groups: dict[tuple[str, str, bool], list[tuple[int, int, Any]]] = {}
        left = self._samples_left
        for row, payload in messages:
            transforms = self._transforms(payload)
            left -= len(transforms)
            if left < 0:
                raise self._refusal(TOO_MANY, "too-much")
            taken = set[str]()
            for step, transform in enumerate(transforms):
                name = transform.child_frame_id
                if name in taken:
                    self.doubled[name] += 1
                    self._count(1)
                    continue
                taken.add(name)
                groups.setdefault((transform.parent_frame_id, name, transform.HasField("timestamp")), []).append(
                    (row, step, transform)
                )
        for (parent, name, stamped), samples in groups.items():
            rows = np.array([row for row, _, _ in samples])
            stamps = np.array([(transform.timestamp.seconds, transform.timestamp.nanos) for _, _, transform in samples])
            poses = [(transform.translation, transform.rotation) for _, _, transform in samples]
            values = np.array([(p.x, p.y, p.z, q.x, q.y, q.z, q.w) for p, q in poses])
            yield BodySamples(rows, samples[0][1], parent, name, stamped, self._times(*stamps.T), values)

    def _transforms(self, payload: bytes) -> Any:
        try:
            transforms = FrameTransforms.FromString(payload).transforms
        except DecodeError:
            raise self._refusal("a message on /tf is no foxglove.FrameTransforms") from None
        if len(transforms) > MOST_TRANSFORMS:
            raise self._refusal(f"a message on /tf holds {len(transforms)} bodies", "too-much")
        return transforms

    def _times(self, seconds: NDArray[np.int64], nanos: NDArray[np.int64]) -> NDArray[np.int64]:
        limit = (1 << 63) // SECOND_NS - 2
        if not -limit < seconds.min() <= seconds.max() < limit:
            raise self._refusal("a transform is stamped beyond the year 2262")
        return seconds * SECOND_NS + nanos

    def _count(self, more: int) -> None:
        """Count what messages hold beyond a sample of each body."""
        self._samples_left -= more
        if self._samples_left < 0:
            raise self._refusal(TOO_MANY, "too-much")

    def _column(self, parent: str, name: str) -> int:
        self._parent = parent if self._parent is None else self._parent
        if parent != self._parent and self._strict:
            what = f"/tf holds transforms with parents {self._parent!r} and {parent!r}, and a session has one world"
            raise self._refusal(what, "unknown-frame")
        if name not in self._columns:
            if not self._grow:
                raise self._refusal(
                    f"/tf holds body {name!r}, which metadata vrlab.bodies does not list", "unlisted-body"
                )
            if len(self._columns) == MAX_BODIES:
                raise self._refusal(f"/tf holds more than {MAX_BODIES} bodies", "too-much")
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
                raise self._refusal("a message on /tracking is no vrlab.Tracking") from None
            if len(self._notes) >= MAX_BODIES:
                self._notes.clear()
            self._notes[payload] = [(body.name, body.status) for body in message.bodies]
        self._count(max(0, len(self._notes[payload]) - len(self._columns)))
        for name, value in self._notes[payload]:
            column = self._columns.get(name)
            if column is not None and status[column] != Status.ABSENT and value in _NOTED:
                status[column] = value

    def _refusal(self, what: str, code: str = "bad-message") -> SessionFileError:
        return refusal(self._catalogue.path, code, what)


def _identity(table: MessageTable, row: int) -> _Identity:
    return int(table.sequence[row]), int(table.publish_ns[row]), int(table.log_ns[row])
