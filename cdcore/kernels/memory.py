"""Arrays as the hot kernels see them: a bare address each, so that forty of them fit in one row of integers.

numba hands an array over as seven numbers and counts its references; two trees, two tracks and the scratch memory came
to four hundred numbers per call and most of the time to compile. Inside a kernel an address is indexed like a
one-dimensional array, without any check: the caller keeps the arrays alive and their sizes right.
"""

from collections.abc import Callable
from functools import cache
from types import SimpleNamespace
from typing import Any, Final

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.errors import TypingError
from numpy.typing import NDArray

from cdcore.kernels.compiling import machine_operation

KEPT_BYTES: Final = 16 << 20
"""An array that is as large as the poses of a long stretch."""

ENDLESS: Final = 1 << 48
"""Entries of an array of which only the address is known."""

Memory = Any
"""What a kernel's author writes for an address of doubles, integers or bytes."""


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
