"""Callers hold the code of the hot kernels that they call, marks about inlining are kept, Python can call them."""

import numpy as np
from numba import njit
from numba.core import event

from cdcore.kernels.compiling import JIT_OPTIONS, always_inlined, hot_kernel, never_inlined

OFFSET = 7


@hot_kernel
def squared(x):
    """A kernel without a mark."""
    return x * x


@hot_kernel
def shifted(x):
    """A kernel that is never inlined."""
    never_inlined()
    return squared(x) + OFFSET


@hot_kernel
def halved(x):
    """A kernel that is always inlined."""
    always_inlined()
    return x / 2


def fresh(function):
    """A kernel that no disk keeps: these tests look at what is compiled now."""
    return njit(**JIT_OPTIONS)(function)


def code_of(compiled):
    """Lines of the LLVM code of the only compiled signature."""
    return next(iter(compiled.inspect_llvm().values())).splitlines()


def defined(lines, name):
    """Lines of LLVM's text that define a function of this name."""
    return [line for line in lines if line.startswith("define") and name in line]


def test_inlining_marks_hold_through_nested_callers():
    """LLVM's text calls ``shifted``, which is never inlined, and has no ``halved``, which always is."""

    @fresh
    def requested(x):
        return shifted(x) + halved(x)

    assert requested(4.0) == 16.0 + OFFSET + 2.0
    assert requested(3) == 9 + OFFSET + 1.5
    assert any("call" in line and "shifted" in line for line in code_of(requested))
    assert not defined(code_of(requested), "halved")


def test_shared_callee_is_compiled_once_for_two_callers():
    """Complex arguments have not been compiled for by another test: (5j)^2 is -25."""

    @fresh
    def first(x):
        return shifted(x)

    @fresh
    def other(x):
        return shifted(x) - 1

    with event.install_recorder("numba:compile") as heard:
        assert (first(5j), other(5j)) == (-25 + OFFSET, -26 + OFFSET)
    compiled = [row.data["dispatcher"].py_func.__name__ for _, row in heard.buffer if row.is_start]
    assert sorted(compiled) == ["first", "other", "shifted", "squared"]
    assert defined(code_of(first), "shifted")
    assert defined(code_of(other), "shifted")


def test_function_is_compiled_once_for_all_literal_numbers():
    """3 and 4 are literals, for each of which numba would compile once more."""

    @hot_kernel
    def tripled(x):
        return 3 * x

    @fresh
    def requested(x):
        x[0] += tripled(3) + tripled(4)
        return x

    numbers = np.zeros(1, dtype=np.int64)
    with event.install_recorder("numba:compile") as heard:
        answer = requested(numbers)
    compiled = [row.data["dispatcher"].py_func for _, row in heard.buffer if row.is_start]
    del numbers
    assert compiled == [requested.py_func, tripled]
    assert answer.tolist() == [9 + 12]


def test_function_called_from_python_computes_the_same():
    """`shifted` squares and adds OFFSET, `halved` halves."""

    @fresh
    def compiled(x):
        return shifted(x) + halved(x)

    assert shifted(3) + halved(3) == compiled(3) == 9 + OFFSET + 1.5
