"""Learns from one transform where the numbers lie in its bytes, to read thousands of the same layout at once.

A template is made by walking the wire format of one ``foxglove.FrameTransform``. Another transform of the same length
whose bytes agree in everything but the numbers (tags, lengths, names, continuation bits of varints) has its numbers
in the same places, so thousands are read with one comparison and one gather. A transform with a repeated or unknown
field gets no template and is left to the protobuf library.

Source: Protocol Buffers encoding, https://protobuf.dev/programming-guides/encoding.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sessions.mcap_format.pose_encoding import SECOND_NS, column_view

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


class _UnexpectedError(Exception):
    """The bytes are not laid out as a template can describe."""


def transform_template(data: bytes) -> TransformTemplate | None:
    """The layout of a transform's bytes, or ``None`` when only the protobuf library may judge them."""
    whole = np.frombuffer(data, dtype=np.uint8)
    template = TransformTemplate(np.full(len(data), 0xFF, dtype=np.uint8), whole)
    try:
        _walk_transform(data, template)
    except (_UnexpectedError, UnicodeDecodeError):
        return None
    template.pattern = whole & template.mask
    return template


def _walk_transform(data: bytes, template: TransformTemplate) -> None:
    for number, wire, start, end in _fields(data, 0, len(data)):
        if wire != _LEN or not _STAMP <= number <= _ROTATION:
            raise _UnexpectedError
        if number == _PARENT:
            template.parent = data[start:end].decode()
        elif number == _CHILD:
            template.child = data[start:end].decode()
        else:
            template.stamped |= number == _STAMP
            for inner, inner_wire, place, after in _fields(data, start, end):
                if _INNER.get((number, inner)) != inner_wire:
                    raise _UnexpectedError
                _learn_number(data, template, (number, inner), place, after)


def _learn_number(data: bytes, template: TransformTemplate, number: tuple[int, int], place: int, after: int) -> None:
    """Note where a number lies; its bits do not belong to the layout, but the continuation bits of a varint do."""
    outer, inner = number
    if outer != _STAMP:
        template.mask[place:after] = 0
        template.doubles[inner - 1 + 3 * (outer == _ROTATION)] = place
        return
    width = after - place
    template.mask[place:after] = 0x80
    if width == MAX_VARINT:
        if data[after - 1] > 1:  # more than 64 bits
            raise _UnexpectedError
        template.mask[after - 1] = 0xFE
    if inner == 1:
        template.seconds = (place, width)
    else:
        template.nanos = (place, width)


def _fields(data: bytes, start: int, end: int) -> list[tuple[int, int, int, int]]:
    """(field number, wire type, first byte, byte after) of every field; each number at most once."""
    found: list[tuple[int, int, int, int]] = []
    at = start
    while at < end:
        tag, wire = data[at] >> 3, data[at] & 7
        if data[at] > 0x7F or tag in [number for number, *_ in found]:
            raise _UnexpectedError
        at += 1
        first = at
        if wire == _FIXED64:
            after = at + 8
        elif wire in (_VARINT, _LEN):
            after = _varint_end(data, at, end)
        else:
            raise _UnexpectedError
        if wire == _LEN:
            first, length = after, sum((data[at + i] & 0x7F) << (7 * i) for i in range(after - at))
            after = first + length
        if after > end:
            raise _UnexpectedError
        found.append((tag, wire, first, after))
        at = after
    return found


def _varint_end(data: bytes, at: int, end: int) -> int:
    for place in range(at, min(end, at + MAX_VARINT)):
        if data[place] < 0x80:
            return place + 1
    raise _UnexpectedError
