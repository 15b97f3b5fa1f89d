"""Callers contain the code of the hot kernels that they call, marks about inlining are kept, Python can call them."""

import numpy as np
from numba import njit
from numba.core import event

from cdcore.kernels.compiling import JIT_OPTIONS, always_inlined, hot_kernel, never_inlined

OFFSET = 7


def uncached_kernel(function):
    """A kernel that no disk keeps: these tests look at what is compiled now."""
    return njit(**JIT_OPTIONS)(function)


def compiled_functions(recorder):
    """Python functions that numba compiled while an event recorder listened, in order."""
    return [event.data["dispatcher"].py_func for _time, event in recorder.buffer if event.is_start]


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


def code_of(compiled):
    """Lines of the LLVM code of the only compiled signature."""
    return next(iter(compiled.inspect_llvm().values())).splitlines()


def defined(lines, name):
    """Lines of LLVM's text that define a function of this name."""
    return [line for line in lines if line.startswith("define") and name in line]


def test_inlining_marks_hold_through_nested_callers():
    """``shifted``, x * x + OFFSET, is never inlined: LLVM's text calls it.

    ``halved``, x / 2, always is: the text has no definition of it.
    """

    @uncached_kernel
    def of_both(x):
        return shifted(x) + halved(x)

    assert of_both(4.0) == 4.0 * 4.0 + OFFSET + 4.0 / 2
    code = code_of(of_both)
    assert any("call" in line and "shifted" in line for line in code)
    assert not defined(code, "halved")


def test_shared_callee_is_compiled_once_for_two_callers():
    """Two kernels call ``shifted``, which calls ``squared``; the code of both kernels contains it.

    All four compile here, once each: no other test compiles them for floats of 32 bits. 5^2 is 25.
    """

    @uncached_kernel
    def first(x):
        return shifted(x)

    @uncached_kernel
    def second(x):
        return shifted(x) - 1

    five = np.float32(5)
    with event.install_recorder("numba:compile") as recorder:
        assert (first(five), second(five)) == (25 + OFFSET, 24 + OFFSET)
    names = sorted(function.__name__ for function in compiled_functions(recorder))
    assert names == ["first", "second", "shifted", "squared"]
    assert defined(code_of(first), "shifted")
    assert defined(code_of(second), "shifted")


def test_function_is_compiled_once_for_all_literal_numbers():
    """A hot kernel is called with 3 and with 4, literals, for each of which numba would compile it once more."""

    @hot_kernel
    def tripled(x):
        return 3 * x

    @uncached_kernel
    def add_to_first(numbers):
        numbers[0] += tripled(3) + tripled(4)

    numbers = np.zeros(1, dtype=np.int64)
    with event.install_recorder("numba:compile") as recorder:
        add_to_first(numbers)
    assert compiled_functions(recorder) == [add_to_first.py_func, tripled]
    assert numbers.tolist() == [3 * 3 + 3 * 4]


def test_function_called_from_python_computes_the_same():
    """``shifted`` squares and adds OFFSET, ``halved`` halves; both are called by Python and by a kernel, with 3."""

    @uncached_kernel
    def compiled(x):
        return shifted(x) + halved(x)

    expected = 3 * 3 + OFFSET + 1.5
    assert shifted(3) + halved(3) == expected
    assert compiled(3) == expected
