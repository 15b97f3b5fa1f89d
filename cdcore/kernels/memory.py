"""Arrays as the hot kernels see them: a bare address each, so that forty of them fit in one row of integers.

numba hands an array over as seven numbers and counts its references; two trees, two tracks and the scratch memory came
to four hundred numbers per call and most of the time to compile. Inside a kernel an address is indexed like a
one-dimensional array, without any check: the caller keeps the arrays alive and their sizes right.

A ``reader`` makes a named tuple of such memory and of numbers from one row of words, an address or a number each.
The arrays themselves as operands of one named tuple took ten times as long to hand over, 2.7 microseconds for 25 of
them, which a live look pays for every pair (2026-11).
"""

from collections.abc import Callable, Iterator
from functools import cache
from itertools import count
from types import SimpleNamespace
from typing import Annotated, Any, Final, get_type_hints

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.errors import TypingError
from numpy.typing import NDArray

from cdcore.kernels.compiling import machine_operation
from cdcore.kernels.vectors import Vector

KEPT_BYTES: Final = 16 << 20
"""An array that is as large as the poses of a long stretch."""

ENDLESS: Final = 1 << 48
"""Entries of an array of which only the address is known."""

Memory = Any
"""What a kernel's author writes for an address of doubles, integers or bytes."""

Doubles = Annotated[Memory, types.float64]
Integers64 = Annotated[Memory, types.int64]
Integers = Annotated[Memory, types.int32]
Bytes = Annotated[Memory, types.uint8]
"""The same as a field of a named tuple that a ``reader`` makes."""
TYPE_STRINGS: Final = {types.float64: "<f8", types.int64: "<i8", types.int32: "<i4", types.uint8: "|u1"}

Rows = NDArray[np.void]


@cache
def keep_freed_memory() -> None:
    """Let the C library keep arrays of up to ``KEPT_BYTES`` that are freed, once a process.

    It gives freed memory back to the system, and to get it again takes a fifth of a boolean question about 5,400
    frames. It keeps what is smaller than the largest array ever freed, so one is freed here (the dynamic threshold of
    glibc, see mallopt(3)); elsewhere this does nothing.
    """
    np.empty(KEPT_BYTES, dtype=np.uint8)


def address_of(array: NDArray[Any]) -> int:
    """Address of the first entry of a contiguous array; valid as long as the caller keeps the array."""
    assert array.flags.c_contiguous, "kernels read arrays as one row"
    return array.__array_interface__["data"][0]


def _doubles_at(_context: Any, _address: Any) -> Any:
    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], ir.DoubleType().as_pointer())

    pointer: Any = types.CPointer
    return pointer(types.float64)(types.int64), generate


@cache
def memory_at(address: int, kind: str) -> NDArray[Any]:
    """Returns the memory at an address as an array of unknown length, for interpreted kernels.

    ``kind``: as NumPy writes the type of an entry.
    """
    if address == 0:
        return np.empty(0, dtype=kind)
    interface = {"data": (address, False), "shape": (ENDLESS,), "typestr": kind, "version": 3}
    return np.asarray(SimpleNamespace(__array_interface__=interface))


doubles_at: Callable[[int], Memory] = machine_operation(_doubles_at, lambda address: memory_at(int(address), "<f8"))
"""``doubles_at(address)``: what lies there, to be indexed as doubles."""


def _of(kind: Any) -> Callable[[Any], Memory]:
    pointer: Any = types.CPointer

    def typed(_context: Any, array: Any) -> Any:
        if isinstance(array, types.CPointer):
            return array(array), lambda _context, _builder, _signature, arguments: arguments[0]
        if array.layout != "C":
            raise TypingError(f"kernels read arrays as one row; make this one contiguous first: {array}")

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return context.make_array(signature.args[0])(context, builder, arguments[0]).data

        return pointer(kind)(array), generate

    return machine_operation(typed, entries_of)


def entries_of(array: NDArray[Any]) -> NDArray[Any]:
    """The entries of a contiguous array in one row, which share its memory."""
    if not array.flags.c_contiguous:
        raise TypingError(f"kernels read arrays as one row; make this one contiguous first: {array.shape}")
    return array.reshape(-1)


doubles_of, integers_of = _of(types.float64), _of(types.int64)
"""In a kernel: the memory of a contiguous array that the kernel was handed as such."""


def _memory_from(_context: Any, memory: Any, _first: Any) -> Any:
    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.gep(arguments[0], [arguments[1]])

    return memory(memory, types.int64), generate


memory_from: Callable[[Memory, int], Memory] = machine_operation(
    _memory_from, lambda memory, first: memory[int(first) :]
)
"""``memory_from(memory, first)``: the same memory, numbered from this entry on."""


def _fetch_early(_context: Any, memory: Any, _index: Any) -> Any:
    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        number, address = ir.IntType(32), ir.IntType(8).as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [address, number, number, number])
        pointer = builder.bitcast(builder.gep(arguments[0], [arguments[1]]), address)
        prefetch = builder.module.declare_intrinsic("llvm.prefetch", (address,), kind)
        builder.call(prefetch, [pointer, number(0), number(3), number(1)])
        return context.get_dummy_value()

    return types.void(memory, types.int64), generate


fetch_early: Callable[[Memory, int], None] = machine_operation(_fetch_early, lambda _memory, _index: None)
"""``fetch_early(memory, index)``: the machine may bring this entry near before it is read; any index is harmless."""


@cache
def layout(kind: Any) -> np.dtype[np.void]:
    """The row of a named tuple: a word for each of its names, in order."""
    return np.dtype([(name, np.int64) for name in get_type_hints(kind)])


def row_of(kind: Any, **entries: NDArray[Any] | int) -> Rows:
    """The row (1,) of a named tuple of arrays and rows, which the caller keeps, and numbers."""
    row = np.zeros(1, dtype=layout(kind))
    for name, item in entries.items():
        row[name] = item if isinstance(item, int) else address_of(item)
    return row


def integers_of_rows(rows: Rows) -> NDArray[np.int64]:
    """The same memory as a kernel takes it, (n, words)."""
    return rows.view(np.int64).reshape(len(rows), rows.dtype.itemsize // 8)


def _shape(kind: Any) -> Any:
    """numba's type of a field of a row: a named tuple, an address, three doubles, a double or an integer."""
    make: Any = types.NamedTuple
    pointer: Any = types.CPointer
    many: Any = types.UniTuple
    if hasattr(kind, "_fields"):
        return make([_shape(hint) for hint in get_type_hints(kind, include_extras=True).values()], kind)
    if hasattr(kind, "__metadata__"):
        return pointer(kind.__metadata__[0])
    if kind == Vector:
        return many(types.float64, 3)
    return types.float64 if kind is float else types.int64


def row_width(shape: Any) -> int:
    """Words of eight bytes in the row of a named tuple."""
    return sum(3 if isinstance(entry, types.UniTuple) else 1 for entry in shape)


def reader(kind: Any) -> Callable[[Memory, int], Any]:
    """Returns what reads a named tuple, in kernels, from a row of words: ``read(rows, index)``.

    A named tuple among its fields is the address of its own row, which may be filled later.
    """
    shape = _shape(kind)
    width = row_width(shape)

    def typed(_context: Any, rows: Any, index: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            word = ir.IntType(64)
            index = context.cast(builder, arguments[1], signature.args[1], types.int64)
            first = builder.gep(arguments[0], [builder.mul(index, word(width))])

            def fields(item: Any, row: Any) -> Any:
                offsets = count()
                return context.make_tuple(builder, item, [field(entry, row, offsets) for entry in item])

            def field(item: Any, row: Any, offsets: Iterator[int]) -> Any:
                if isinstance(item, types.UniTuple):
                    return context.make_tuple(builder, item, [field(entry, row, offsets) for entry in item])
                address = builder.gep(row, [word(next(offsets))])
                if not isinstance(item, (types.CPointer, types.NamedTuple)):
                    return builder.load(builder.bitcast(address, context.get_value_type(item).as_pointer()))
                at = builder.load(builder.bitcast(address, word.as_pointer()))
                if isinstance(item, types.CPointer):
                    return builder.inttoptr(at, context.get_value_type(item))
                return fields(item, builder.inttoptr(at, word.as_pointer()))

            return fields(shape, first)

        return shape(rows, index), generate

    def interpreted(rows: Any, index: int) -> Any:
        return _read(shape, iter(rows[int(index) * width : (int(index) + 1) * width].tolist()))

    return machine_operation(typed, interpreted)


def _read(shape: Any, row: Iterator[Any]) -> Any:
    """A named tuple from the words of its row, in Python."""
    fields = list[Any]()
    for entry in shape:
        word = next(row)
        if isinstance(entry, types.UniTuple):
            word = word, next(row), next(row)
        elif isinstance(entry, types.NamedTuple):
            word = _read(entry, map(int, memory_at(word, "<i8")))
        elif isinstance(entry, types.CPointer):
            word = memory_at(word, TYPE_STRINGS[entry.dtype])
        fields.append(word)
    return shape.instance_class(*fields)
