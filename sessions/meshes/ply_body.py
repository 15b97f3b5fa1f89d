"""The numbers behind the header of a PLY file, element after element, by the sizes that the header declares.

A binary and a text body differ in what a position is, a byte or a word, and in how a number is read there. Rows of
equal length, such as all faces being triangles, are read at once; others are walked for where their lists begin.
"""

import struct
from abc import ABC, abstractmethod
from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sessions.errors import MeshFileError
from sessions.meshes.mesh_text import numbers

Indices = NDArray[np.int64]
Column = NDArray[Any]

BLOCK: Final = 1 << 20
"""Bytes or words of lists that are gathered at once."""

CODES: Final = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "i8": "q", "u8": "Q"}
"""Type of a list's length -> the letter of `struct`."""


@dataclass(frozen=True)
class Property:
    """A number of a row, or where ``length_kind`` is not empty a list of numbers; kinds are NumPy's, as ``"f4"``."""

    name: str
    kind: str
    length_kind: str = ""


@dataclass(frozen=True)
class Element:
    """So many rows of the same properties."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class Columns:
    """Numbers of an element by property: one a row (n,); and of lists their lengths (n,) and all their numbers."""

    scalars: dict[str, Column]
    lists: dict[str, tuple[Indices, Indices]]


class Body(ABC):
    """Numbers that are read from the front to the end; positions count ``unit``."""

    unit: str

    def __init__(self, start: int, end: int) -> None:
        self._position = start
        self._end = end

    def read(self, element: Element) -> Columns:
        """Return the numbers of the next element; ``MeshFileError`` where the file ends before."""
        if not element.count:
            return Columns({}, {p.name: (_none(), _none()) for p in element.properties if p.length_kind})
        self._check_rest(element, sum(self.width(p.length_kind or p.kind) for p in element.properties))
        return self._alike(element) or self._walked(element)

    def check_end(self) -> None:
        """Raise ``MeshFileError`` where the file goes on behind what its header declares."""
        rest = self._end - self._position
        if rest:
            raise MeshFileError(f"it holds {rest:,} {self.unit} more than its header declares; export it again")

    @abstractmethod
    def width(self, kind: str, /) -> int:
        """How far a number of this type reaches."""

    @abstractmethod
    def dtype(self, kind: str, /) -> np.dtype[Any]:
        """How numbers of this type are kept."""

    @abstractmethod
    def length_at(self, position: int, kind: str, /) -> int:
        """The length of a list that is written there."""

    @abstractmethod
    def column(self, start: int, step: int, shape: tuple[int, int], kind: str, /) -> Column:
        """Numbers (rows, width) beside each other, of rows that begin a step apart."""

    @abstractmethod
    def gathered(self, starts: Indices, length: int, kind: str, /) -> Column:
        """Numbers (rows, length) behind each start."""

    def _check_rest(self, element: Element, least: int) -> None:
        """Before anything is allocated: whether so many rows of at least this width can be there."""
        if element.count * least > self._end - self._position:
            raise self._cut(element, (self._end - self._position) // least, at_most=True)

    def _cut(self, element: Element, rows: int, at_most: bool = False) -> MeshFileError:
        declared = f"it declares {element.count:,} of {element.name}"
        return MeshFileError(f"{declared} and ends after {'at most ' * at_most}{rows:,}: cut short; export it again")

    def _length(self, position: int, kind: str) -> int:
        length = self.length_at(position, kind)
        if length < 0:
            raise MeshFileError(f"it holds a list of {length} numbers; export it again")
        return length

    def _alike(self, element: Element) -> Columns | None:
        """Every row read as if its lists were as long as those of the first row; ``None`` where some are not."""
        lengths, offsets, offset = [], [], 0
        for each in element.properties:
            length = 1
            if each.length_kind:
                if self._position + offset + self.width(each.length_kind) > self._end:
                    return None
                length = self._length(self._position + offset, each.length_kind)
                offset += self.width(each.length_kind)
            lengths.append(length)
            offsets.append(offset)
            offset += length * self.width(each.kind)
        if element.count * offset > self._end - self._position:
            return None
        scalars, lists = {}, {}
        for each, length, start in zip(element.properties, lengths, offsets, strict=True):
            position = self._position + start
            values = self.column(position, offset, (element.count, length), each.kind)
            if not each.length_kind:
                scalars[each.name] = values[:, 0]
                continue
            before = position - self.width(each.length_kind)
            all_lengths = self.column(before, offset, (element.count, 1), each.length_kind)[:, 0]
            if (all_lengths != length).any():
                return None
            lists[each.name] = np.full(element.count, length, dtype=np.int64), _whole(values.reshape(-1))
        self._position += element.count * offset
        return Columns(scalars, lists)

    def _walked(self, element: Element) -> Columns:
        """Row after row: where each begins, and each of its lists."""
        groups = _groups(element.properties)
        skips = [sum(self.width(each.kind) for each in scalars) for scalars, _ in groups]
        anchors = [array("q") for _ in groups]
        lengths = [array("q") for _ in groups]
        position = self._position
        for row in range(element.count):
            for group, (_, listed) in enumerate(groups):
                anchors[group].append(position)
                position += skips[group]
                if listed is None:
                    continue
                if position + self.width(listed.length_kind) > self._end:
                    raise self._cut(element, row)
                length = self._length(position, listed.length_kind)
                lengths[group].append(length)
                position += self.width(listed.length_kind) + length * self.width(listed.kind)
            if position > self._end:
                raise self._cut(element, row)
        self._position = position
        scalars: dict[str, Column] = {}
        lists: dict[str, tuple[Indices, Indices]] = {}
        for group, (singles, listed) in enumerate(groups):
            starts = np.array(anchors[group], dtype=np.int64)
            for each in singles:
                scalars[each.name] = self.gathered(starts, 1, each.kind)[:, 0]
                starts = starts + self.width(each.kind)
            if listed is not None:
                starts = starts + self.width(listed.length_kind)
                sizes = np.array(lengths[group], dtype=np.int64)
                lists[listed.name] = sizes, _whole(self._listed(starts, sizes, listed.kind))
        return Columns(scalars, lists)

    def _listed(self, starts: Indices, sizes: Indices, kind: str) -> Column:
        """The numbers of lists, list after list, from where each begins and how many it has."""
        first = np.cumsum(sizes) - sizes
        numbers_of_all = np.empty(int(sizes.sum()), dtype=self.dtype(kind))
        for size in np.unique(sizes[sizes > 0]).tolist():
            rows = np.flatnonzero(sizes == size)
            for block in np.array_split(rows, -(-len(rows) * size * self.width(kind) // BLOCK)):
                targets = first[block][:, None] + np.arange(size)
                numbers_of_all[targets] = self.gathered(starts[block], size, kind)
        return numbers_of_all


class BinaryBody(Body):
    """Numbers in the machine's formats; ``order``: ``"<"`` or ``">"``."""

    unit = "bytes"

    def __init__(self, data: bytes, start: int, order: str) -> None:
        super().__init__(start, len(data))
        self._data = data
        self._order = order
        self._bytes = np.frombuffer(data, dtype=np.uint8)
        self._lengths = {kind: struct.Struct(order + code) for kind, code in CODES.items()}

    def width(self, kind: str, /) -> int:
        """Bytes of a number: the last letter of its type says so."""
        return int(kind[1])

    def dtype(self, kind: str, /) -> np.dtype[Any]:
        """Their own type, whose bytes are in the order of the file."""
        return np.dtype(self._order + kind)

    def length_at(self, position: int, kind: str, /) -> int:
        """The whole number that is written there."""
        return self._lengths[kind].unpack_from(self._data, position)[0]

    def column(self, start: int, step: int, shape: tuple[int, int], kind: str, /) -> Column:
        """A view of the bytes."""
        return np.ndarray(shape, self._order + kind, self._data, start, (step, self.width(kind)))

    def gathered(self, starts: Indices, length: int, kind: str, /) -> Column:
        """A copy of the bytes, row after row."""
        positions = starts[:, None] + np.arange(length * self.width(kind))
        return self._bytes[positions].view(self._order + kind)


class TextBody(Body):
    """Numbers in decimal digits, apart by blanks; lines mean nothing."""

    unit = "numbers"

    def __init__(self, text: bytes) -> None:
        self._numbers = numbers(text, "its body")
        super().__init__(0, len(self._numbers))

    def width(self, _kind: str, /) -> int:
        """One word, whatever its type."""
        return 1

    def dtype(self, _kind: str, /) -> np.dtype[Any]:
        """Fractions: a text may hold them wherever its header declares whole numbers."""
        return np.dtype(np.float64)

    def length_at(self, position: int, _kind: str, /) -> int:
        """The number that is written there, if it is whole."""
        value = self._numbers.item(position)
        if not value.is_integer():
            raise MeshFileError(f"it holds a list of {value:g} numbers; export it again")
        return int(value)

    def column(self, start: int, step: int, shape: tuple[int, int], _kind: str, /) -> Column:
        """A view of the numbers."""
        size = self._numbers.itemsize
        return np.ndarray(shape, np.float64, self._numbers.data, start * size, (step * size, size))

    def gathered(self, starts: Indices, length: int, _kind: str, /) -> Column:
        """A copy of the numbers, row after row."""
        return self._numbers[starts[:, None] + np.arange(length)]


Group = tuple[list[Property], Property | None]
"""Numbers of one each, and the list behind them; behind the last ones there is none."""


def _groups(properties: Sequence[Property]) -> list[Group]:
    groups: list[Group] = []
    scalars: list[Property] = []
    for each in properties:
        if each.length_kind:
            groups.append((scalars, each))
            scalars = []
        else:
            scalars.append(each)
    return [*groups, (scalars, None)]


def _none() -> Indices:
    return np.zeros(0, dtype=np.int64)


def _whole(values: Column) -> Column:
    """Numbers of a list as int64 where all are whole; else as they are: lists of other things are not read."""
    with np.errstate(invalid="ignore"):
        whole = values.astype(np.int64)
    return whole if np.array_equal(whole, values) else values
