"""The transforms of many messages at once, bit for bit what the protobuf library reads from each of them.

All messages are cut into transforms in step (first transform of every message, second, ...), and those of one step and
length are read layout by layout. A template is learnt by walking the wire format of one ``foxglove.FrameTransform``:
another of the same length whose bytes agree in everything but the numbers (tags, lengths, names, continuation bits of
varints) has its numbers in the same places, so thousands are read with one comparison and one gather. Transforms with
a repeated or unknown field, and layouts too many to be worth learning, are left to the protobuf library.

Source: Protocol Buffers encoding, https://protobuf.dev/programming-guides/encoding.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from google.protobuf.message import DecodeError
from numpy.typing import NDArray

from sessions.mcap_format.annotations import stamp_ns
from sessions.mcap_format.pose_encoding import SECOND_NS, column_view
from sessions.mcap_format.refusals import TOO_MANY
from sessions.mcap_format.unpacking import rows_at

# Layouts learnt per length of a transform before the rest goes to the protobuf library. A session has one per body, a
# foreign file some six (lengths of a stamp's varints, zeros left out); the bound keeps hostile files linear.
LAYOUTS_PER_LENGTH = 512
# Transforms of one message that are read in step; the protobuf library takes messages with more.
STEPS = 4096
MOST_TRANSFORMS = 4096
# Layouts met in one region: six of each of the most bodies there may be.
LAYOUTS_AT_ONCE = 6 * 4096
_TRANSFORM_TAG = 0x0A
_VARINT, _FIXED64, _LEN = 0, 1, 2
_STAMP, _PARENT, _CHILD, _TRANSLATION, _ROTATION = range(1, 6)
_INNER = {
    **{(_STAMP, number): _VARINT for number in (1, 2)},
    **{(_TRANSLATION, number): _FIXED64 for number in (1, 2, 3)},
    **{(_ROTATION, number): _FIXED64 for number in (1, 2, 3, 4)},
}
"""Field of a transform, field in it -> its wire type."""
MAX_VARINT = 10
_GROUP_WEIGHTS = np.uint64(1) << np.arange(0, 7 * MAX_VARINT, 7, dtype=np.uint64)


@dataclass(eq=False)
class BodySamples:
    """Samples of one body, whose frames are ``parent`` and ``child``."""

    rows: NDArray[np.int64]
    """(n,) numbers of their messages, ascending."""
    step: int
    """Their place in the messages."""
    parent: str
    child: str
    stamped: bool
    """Whether they have device stamps."""
    sample_ns: NDArray[np.int64]
    values: NDArray[np.float64]
    """(n, 7) position and quaternion xyzw."""

    def without(self, rows: NDArray[np.bool_]) -> "BodySamples":
        """These samples but those of messages that are read another way."""
        keep = ~rows[self.rows]
        return replace(self, rows=self.rows[keep], sample_ns=self.sample_ns[keep], values=self.values[keep])


@dataclass(eq=False)
class TransformTemplate:
    """The layout of one transform: bytes x (length,) of it satisfy ``x & mask == pattern``."""

    mask: NDArray[np.uint8]
    pattern: NDArray[np.uint8]
    parent: str = ""
    child: str = ""
    stamped: bool = False
    seconds: tuple[int, int] = (0, 0)
    nanos: tuple[int, int] = (0, 0)
    """(place, width) of the two varints, width 0 where left out."""
    doubles: dict[int, int] = field(default_factory=dict)
    """Value number (x y z, then x y z w) -> place; those left out are 0."""

    def agrees(self, rows: NDArray[np.uint8]) -> NDArray[np.bool_]:
        """Which rows (n, length) have this layout."""
        return ((rows & self.mask) == self.pattern).all(axis=1)

    def values(self, rows: NDArray[np.uint8]) -> NDArray[np.float64]:
        """Position and quaternion of each row, (n, 7)."""
        found = np.zeros((len(rows), 7))
        for number, place in self.doubles.items():
            found[:, number] = column_view(rows, place, "<f8")
        return found

    def stamps(self, rows: NDArray[np.uint8]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Seconds and nanoseconds of each row."""
        nanos = _varints(rows, *self.nanos).astype(np.uint32).view(np.int32)
        return _varints(rows, *self.seconds).view(np.int64), nanos.astype(np.int64)


def stamp_overflows(seconds: NDArray[np.int64]) -> bool:
    """Whether a stamp in seconds does not fit into int64 nanoseconds."""
    limit = (1 << 63) // SECOND_NS - 2
    return bool(len(seconds)) and not -limit < seconds.min() <= seconds.max() < limit


def _varints(rows: NDArray[np.uint8], place: int, width: int) -> NDArray[np.uint64]:
    groups = (rows[:, place : place + width] & np.uint8(0x7F)).astype(np.uint64)
    return groups @ _GROUP_WEIGHTS[:width]


def transform_template(data: bytes) -> TransformTemplate | None:
    """The layout of a transform's bytes, or ``None`` when only the protobuf library may judge them."""
    whole = np.frombuffer(data, dtype=np.uint8)
    template = TransformTemplate(np.full(len(data), 0xFF, dtype=np.uint8), whole)
    try:
        for outer, wire, start, end in _fields(data, 0, len(data)):
            if wire != _LEN or not _STAMP <= outer <= _ROTATION:
                return None
            if outer == _PARENT:
                template.parent = data[start:end].decode()
            elif outer == _CHILD:
                template.child = data[start:end].decode()
            else:
                template.stamped |= outer == _STAMP
                for inner, inner_wire, place, after in _fields(data, start, end):
                    if _INNER.get((outer, inner)) != inner_wire:
                        return None
                    _learn_number(data, template, (outer, inner), place, after)
    except (ValueError, IndexError):  # no field of a transform, no text, or the bytes end too early
        return None
    template.pattern = whole & template.mask
    return template


def _learn_number(data: bytes, template: TransformTemplate, number: tuple[int, int], place: int, after: int) -> None:
    """Note where a number lies; its bits do not belong to the layout, but the continuation bits of a varint do."""
    outer, inner = number
    if outer != _STAMP:
        template.mask[place:after] = 0
        template.doubles[inner - 1 + 3 * (outer == _ROTATION)] = place
        return
    template.mask[place:after] = 0x80
    if after - place == MAX_VARINT:
        if data[after - 1] > 1:
            raise ValueError("more than 64 bits")
        template.mask[after - 1] = 0xFE
    if inner == 1:
        template.seconds = (place, after - place)
    else:
        template.nanos = (place, after - place)


def _fields(data: bytes, start: int, end: int) -> Iterator[tuple[int, int, int, int]]:
    """(field number, wire type, first byte, byte after) of every field; ValueError where a number comes twice."""
    seen, at = set[int](), start
    while at < end:
        tag, wire = data[at] >> 3, data[at] & 7
        if tag > 0x0F or tag in seen or wire not in (_VARINT, _FIXED64, _LEN):
            raise ValueError("a repeated or unknown field")
        seen.add(tag)
        first = at + 1
        after = first + 8 if wire == _FIXED64 else _varint_end(data, first)
        if wire == _LEN:
            length = sum((data[first + i] & 0x7F) << (7 * i) for i in range(after - first))
            first, after = after, after + length
        if after > end:
            raise ValueError("a field that is cut short")
        yield tag, wire, first, after
        at = after


def _varint_end(data: bytes, at: int) -> int:
    for place in range(at, at + MAX_VARINT):
        if data[place] < 0x80:
            return place + 1
    raise ValueError("a varint without an end")


class _Layouts:
    """The layouts known of transforms of one length."""

    def __init__(self) -> None:
        self._known: list[TransformTemplate] = []
        self._masks = self._patterns = np.zeros((0, 0), dtype=np.uint8)

    def of(self, row: NDArray[np.uint8]) -> TransformTemplate | None:
        """The layout of one transform, known or learnt now; ``None`` when the protobuf library must read it."""
        # The caller asks for one transform's layout, then takes all that share it: as many passes as layouts occur,
        # however many are known. That is 1.1 times as fast as trying them in turn and keeps a hostile file linear.
        if self._known:
            hits = np.flatnonzero(((row & self._masks) == self._patterns).all(axis=1))
            if len(hits):
                return self._known[int(hits[0])]
        template = transform_template(row.tobytes()) if len(self._known) < LAYOUTS_PER_LENGTH else None
        if template is not None:
            self._known.append(template)
            self._masks = np.array([one.mask for one in self._known])
            self._patterns = np.array([one.pattern for one in self._known])
        return template


class TransformReader:
    """Reads transforms and remembers their layouts from chunk to chunk; ``error`` makes its exceptions."""

    def __init__(self, error: Callable[..., Exception]) -> None:
        self._error = error
        self._layouts: dict[int, _Layouts] = {}

    def read(self, data: bytes, start: NDArray[np.int64], end: NDArray[np.int64], most: int) -> list[BodySamples]:
        """Every sample of the messages at ``data[start:end]``, by their number; more than ``most`` are refused."""
        samples, irregular = self._regular(np.frombuffer(data, dtype=np.uint8), start, end, most)
        if irregular.any():
            samples = [part.without(irregular) for part in samples]
            for row in np.flatnonzero(irregular).tolist():
                samples += self._parsed(row, data[start[row] : end[row]])
        return samples

    def _regular(
        self, buffer: NDArray[np.uint8], start: NDArray[np.int64], end: NDArray[np.int64], most: int
    ) -> tuple[list[BodySamples], NDArray[np.bool_]]:
        """Samples read through layouts, and which messages must be read by the protobuf library."""
        irregular = np.zeros(len(start), dtype=np.bool_)
        samples: list[BodySamples] = []
        cursor, step = start.copy(), 0
        alive = np.flatnonzero(cursor < end)
        while len(alive) and step < STEPS:
            if len(samples) > LAYOUTS_AT_ONCE:
                raise self._error("messages on /tf hold too many bodies", "too-much")
            most -= len(alive)
            if most < 0:
                raise self._error(TOO_MANY, "too-much")
            body, after = _next_transform(buffer, cursor[alive], end[alive])
            good = after >= 0
            if not good.all():
                irregular[alive[~good]] = True
                alive, body, after = alive[good], body[good], after[good]
            length = after - body
            for size in np.unique(length).tolist():
                chosen = np.flatnonzero(length == size)
                samples += self._matched(rows_at(buffer, body[chosen], size), step, alive[chosen], irregular)
            cursor[alive] = after
            alive, step = alive[after < end[alive]], step + 1
        irregular[alive] = True
        return samples, irregular

    def _matched(
        self, data: NDArray[np.uint8], step: int, rows: NDArray[np.int64], irregular: NDArray[np.bool_]
    ) -> Iterator[BodySamples]:
        """Transforms of one length at one step, layout by layout; those without one are marked irregular."""
        layouts = self._layouts.setdefault(data.shape[1], _Layouts())
        while len(data):
            template = layouts.of(data[0])
            if template is None:
                break
            fits = template.agrees(data)
            seconds, nanos = template.stamps(data[fits])
            self._check_stamps(seconds)
            names, times = (template.parent, template.child), seconds * SECOND_NS + nanos
            yield BodySamples(rows[fits], step, *names, template.stamped, times, template.values(data[fits]))
            data, rows = data[~fits], rows[~fits]
        irregular[rows] = True

    def _parsed(self, row: int, payload: bytes) -> Iterator[BodySamples]:
        """The samples of one message as the protobuf library reads them."""
        try:
            message = FrameTransforms.FromString(payload)
        except DecodeError:
            raise self._error("a message on /tf is no foxglove.FrameTransforms") from None
        if len(message.transforms) > MOST_TRANSFORMS:
            raise self._error(f"a message on /tf holds {len(message.transforms)} bodies", "too-much")
        for step, one in enumerate(message.transforms):
            self._check_stamps(np.array([one.timestamp.seconds]))
            p, q = one.translation, one.rotation
            stamped, stamp = one.HasField("timestamp"), np.array([stamp_ns(one.timestamp)])
            values = np.array([[p.x, p.y, p.z, q.x, q.y, q.z, q.w]])
            yield BodySamples(np.array([row]), step, one.parent_frame_id, one.child_frame_id, stamped, stamp, values)

    def _check_stamps(self, seconds: NDArray[np.int64]) -> None:
        if stamp_overflows(seconds):
            raise self._error("a transform is stamped beyond the year 2262")


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
