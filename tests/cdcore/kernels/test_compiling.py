"""Marked kernels stay callable, are compiled once, and read through an address what the array holds."""

import gc
import os
import subprocess
import sys
from errno import ENOSPC
from time import perf_counter
from typing import NamedTuple

import numba
import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError
from numba.core.event import Event

from cdcore.kernels import compiling
from cdcore.kernels.compiling import Compiled, always_inlined, hot_kernel, kernel, never_inlined
from cdcore.kernels.memory import Doubles, address_of, doubles_at, doubles_of, integers_of, reader
from cdcore.kernels.simd import load8, store
from cdcore.kernels.vectors import Vector


@njit
def doubled(x):
    """A function that numba compiles."""
    never_inlined()
    return 2 * x


@pytest.fixture
def machine_code_folder(tmp_path, monkeypatch):
    """A folder for the machine code of kernels that the test marks."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    return tmp_path


def test_where_nothing_can_be_written_kernels_compute_the_same(monkeypatch):
    """``njit`` refuses to cache, as it does where no folder can be written: the kernel has no cache,
    and 2 x 2 + 2 = 6.
    """

    def refuse_to_cache(cache=False, **options):
        if cache:
            raise RuntimeError("cannot cache function: no locator available")
        return njit(**options)

    monkeypatch.setattr(compiling, "njit", refuse_to_cache)
    square_plus_two = kernel(lambda x: x * x + 2)
    assert square_plus_two(2.0) == 6.0
    assert square_plus_two.dispatcher.stats.cache_path is None


def test_full_disk_costs_no_answer(machine_code_folder, monkeypatch):
    """On a full disk, where no file can be moved to its place, a kernel computes and stores nothing.

    Afterwards its machine code for an int, another signature than a float, is stored.
    """

    def full(*_):
        raise OSError(ENOSPC, "No space left on device")

    square_plus_three = kernel(lambda x: x * x + 3)
    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", full)
        assert square_plus_three(2.0) == 7.0
        assert list(machine_code_folder.rglob("*.nb?")) == []
    assert square_plus_three(2) == 7
    assert list(machine_code_folder.rglob("*.nbi"))


def test_compiling_a_kernel_keeps_numbas_cache_folder_setting(machine_code_folder):
    """The folder of the setting gets the kernel's files, and stays set; the seal changes with another signature."""
    requested = kernel(lambda x: x * x + 4)
    requested(2.0)
    (seal,) = machine_code_folder.rglob("*.seal")
    first_seal = seal.read_bytes()
    requested(2)
    assert str(machine_code_folder) == numba.config.CACHE_DIR
    assert seal.read_bytes() != first_seal


@kernel
def doubled_plus_seven(x):
    """A kernel that is never inlined and calls one that always is: 2 x + 7."""
    never_inlined()
    return doubled_inline(x) + 7


@hot_kernel
def doubled_inline(x):
    """A kernel that is always inlined."""
    always_inlined()
    return 2 * x


@kernel
def calls_both(x):
    """A kernel that calls both kinds: (2 x + 7) + 2 (x + 1)."""
    return doubled_plus_seven(x) + doubled_inline(x + 1)


@kernel
def zero_to(count):
    """The numbers below ``count``, in memory that a kernel asks for."""
    numbers = np.empty(count)
    for k in range(count):
        numbers[k] = k
    return numbers


@kernel
def sum_below(count):
    """The sum of the numbers below ``count``."""
    total = 0.0
    for number in zero_to(count):
        total += number
    return total


def test_a_kernel_that_allocates_is_called_by_a_kernel():
    """``zero_to`` fills an array with the numbers below a count, ``sum_below`` adds them: 0 + 1 + 2 + 3 + 4 = 10."""
    assert zero_to(3).tolist() == [0.0, 1.0, 2.0]
    assert sum_below(5) == 10.0


def test_kernels_call_other_kernels_compiled_and_interpreted():
    """(2 x + 7) + 2 (x + 1) by two other kernels, for x = 3; ``__wrapped__`` is the kernel in Python."""
    expected = (2 * 3.0 + 7) + 2 * (3.0 + 1)
    assert calls_both(3.0) == expected
    assert calls_both.__wrapped__(3.0) == expected


CALLS_A_KERNEL = """
from cdcore.kernels.compiling import compiling_reported
import numpy as np
from cdcore.narrow.published_trees.tree_search import twice_as_long
with compiling_reported(lambda seconds: None) as report:
    assert twice_as_long(np.zeros((2, 3), dtype=np.int64)).shape == (4, 3)
print(report.kernels)
"""
"""A program that calls a kernel and prints how many it compiled for that."""


@pytest.mark.slow
def test_simultaneous_processes_compile_a_kernel_once(tmp_path):
    """Two processes call a kernel at the same time, with an empty cache: one compiles it, and the other loads it.

    So does a third.
    """
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", CALLS_A_KERNEL]
    both = [subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    kernels_compiled = sorted(process.communicate(timeout=60)[0].strip() for process in both)
    assert kernels_compiled == ["0", "1"]
    assert subprocess.check_output(command, env=environment, text=True).strip() == "0"


@pytest.mark.parametrize("is_enabled", [True, False], ids=["collector on", "collector off"])
def test_the_collector_rests_while_kernels_compile_and_only_then(is_enabled):
    """The garbage collector is off from the start of a compilation to its end, then as it was before.

    Here one compilation starts within another, of a kernel that the first calls: the end of the outer counts.
    """
    listener = Compiled(tell=lambda seconds: None)
    compilation = Event("numba:compile", "START", {"dispatcher": doubled})
    gc.enable() if is_enabled else gc.disable()
    try:
        listener.on_start(compilation)
        assert not gc.isenabled()
        listener.on_start(compilation)
        assert not gc.isenabled()
        listener.on_end(compilation)
        assert not gc.isenabled(), "the outer kernel compiles still"
        listener.on_end(compilation)
        assert gc.isenabled() == is_enabled
    finally:
        gc.enable()


def test_seconds_of_nested_compilations_are_those_of_the_outer():
    """A compilation within another, both over at once: the clock runs from the first start to the last end."""
    listener = Compiled(tell=lambda seconds: None)
    compilation = Event("numba:compile", "START", {"dispatcher": doubled})
    start = perf_counter()
    for notify in (listener.on_start, listener.on_start, listener.on_end, listener.on_end):
        notify(compilation)
    assert 0.0 < listener.seconds <= perf_counter() - start


@kernel
def shifted_down_and_doubled(address, count):
    """Move eight numbers at an address down by one entry, double the entry number ``count``, and return it."""
    numbers = doubles_at(address)
    store(numbers, 0 * count, load8(numbers, 1))
    numbers[count] = 2 * numbers[count]
    return numbers[count]


def test_numbers_are_read_and_written_at_their_address():
    """A kernel gets the address of the numbers 0 to 11, moves entries 1 to 8 down by one and doubles entry 10."""
    array = np.arange(12.0)
    assert shifted_down_and_doubled(address_of(array), 10) == 2 * 10.0
    assert array.tolist() == [1, 2, 3, 4, 5, 6, 7, 8, 8, 9, 20, 11]


@kernel
def last_of_rows(real, whole):
    """The sixth number of a row of doubles and of one of integers, and the first double again."""
    return doubles_of(real)[5], integers_of(whole)[5], doubles_of(doubles_of(real))[0]


def test_array_of_rows_is_a_single_row_in_a_kernel():
    """The sixth number of 1 to 6 in two rows and of 0 to 5 in three rows, and the first double: 6, 5 and 1.

    ``doubles_of`` and ``integers_of`` give a kernel an array as one row.
    """
    doubles, integers = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]), np.array([[0, 1], [2, 3], [4, 5]])
    assert last_of_rows(doubles, integers) == (6.0, 5, 1.0)


class Ball(NamedTuple):
    centre: Vector
    radius: float


class Weight(NamedTuple):
    grams: int
    readings: Doubles


ball_at, weight_at = reader(Ball), reader(Weight)


@kernel
def read_rows(real, whole, index):
    """All fields of a ball and of a weight at an index."""
    ball, weight = ball_at(doubles_of(real), index), weight_at(integers_of(whole), index)
    x, y, z = ball.centre
    return x, y, z, ball.radius, weight.grams, weight.readings[0]


def test_rows_are_named_tuples_with_and_without_compiler():
    """``reader`` makes named tuples of rows: a ball is a centre and a radius, four doubles.

    A weight is its grams and the address of its readings, in integers.
    """
    readings = np.array([0.5, 0.25])
    first_reading, second_reading = address_of(readings), address_of(readings) + readings.itemsize
    balls = np.array([[0.0, 1.0, 2.0, 3.0], [4.0, 5.0, 6.0, 7.0]])
    weights = np.array([[3, first_reading], [5, second_reading]])
    assert read_rows(balls, weights, 0) == (0.0, 1.0, 2.0, 3.0, 3, 0.5)
    assert read_rows(balls, weights, 1) == (4.0, 5.0, 6.0, 7.0, 5, 0.25)
    assert ball_at.interpreted(balls.ravel(), 1) == Ball(centre=(4.0, 5.0, 6.0), radius=7.0)
    weight = weight_at.interpreted(weights.ravel(), 1)
    assert (weight.grams, weight.readings[0]) == (5, 0.25)


def test_an_array_with_gaps_has_no_address():
    """The numbers of a column of a matrix are four doubles from each other: asked in Python."""
    with pytest.raises(AssertionError, match="kernels read arrays as one row"):
        address_of(np.zeros((4, 4))[:, 1])


def test_a_kernel_takes_no_address_of_an_array_with_gaps():
    """A kernel that takes the address of a column of a matrix does not compile."""
    with pytest.raises(TypingError, match="make this one contiguous first"):
        last_of_rows(np.zeros((6, 2))[:, 0], np.zeros(6, dtype=np.int64))
