"""Marked kernels stay callable, are compiled once, and read through an address what the array holds."""

import gc
import os
import subprocess
import sys
from errno import ENOSPC
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
    """A kernel that is never inlined."""
    never_inlined()
    return 2 * x


@pytest.fixture
def machine_code_folder(tmp_path, monkeypatch):
    """A folder for the machine code of kernels that the test marks."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    return tmp_path


def test_where_nothing_can_be_written_kernels_compute_the_same(monkeypatch):
    """``njit`` refuses to cache, as it does where no folder can be written."""

    def refuse(cache=False, **options):
        if cache:
            raise RuntimeError("cannot cache function: no locator available")
        return njit(**options)

    monkeypatch.setattr(compiling, "njit", refuse)
    requested = kernel(lambda x: x * x + 2)
    assert requested(2.0) == 6.0 and requested.dispatcher.stats.cache_path is None


def test_full_disk_costs_no_answer(machine_code_folder, monkeypatch):
    """No file can be put in its place: nothing is stored. Afterwards an int, another signature, is."""

    def full(*_):
        raise OSError(ENOSPC, "No space left on device")

    requested = kernel(lambda x: x * x + 3)
    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", full)
        assert requested(2.0) == 7.0 and not list(machine_code_folder.rglob("*.nb?"))
    assert requested(2) == 7 and list(machine_code_folder.rglob("*.nbi"))


def test_compiling_a_kernel_keeps_numbas_cache_folder_setting(machine_code_folder):
    """The kernel's files, seal included, are in the folder of the setting."""
    kernel(lambda x: x * x + 4)(2.0)
    assert str(machine_code_folder) == numba.config.CACHE_DIR and list(machine_code_folder.rglob("*.seal"))


@kernel
def shifted_by_seven(x):
    """A kernel that is never inlined and calls one that always is: 2 x + 7."""
    never_inlined()
    return doubled_part(x) + 7


@hot_kernel
def doubled_part(x):
    """A kernel that is always inlined."""
    always_inlined()
    return 2 * x


@kernel
def calls_both(x):
    """A kernel that calls both kinds: 4 x + 9."""
    return shifted_by_seven(x) + doubled_part(x + 1)


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
    """0 + 1 + 2 + 3 + 4 is 10."""
    assert sum_below(5) == 10.0 and zero_to(3).tolist() == [0.0, 1.0, 2.0]


def test_kernels_call_other_kernels_compiled_and_interpreted():
    """2 x 3 + 7 = 13, and twice 3 + 1 is 8."""
    assert calls_both(3.0) == calls_both.__wrapped__(3.0) == 13.0 + 8.0
    assert (shifted_by_seven(3), doubled_part(3)) == (13, 6)


TOGETHER = """
from cdcore.kernels.compiling import compiling_reported
import numpy as np
from cdcore.narrow.published_trees.tree_search import twice_as_long
with compiling_reported(lambda seconds: None) as heard:
    assert twice_as_long(np.zeros((2, 3), dtype=np.int64)).shape == (4, 3)
print(heard.kernels)
"""


@pytest.mark.slow
def test_simultaneous_processes_compile_a_kernel_once(tmp_path):
    """Each process prints how many kernels it compiled: of two one compiles, and a third loads."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    start = [sys.executable, "-c", TOGETHER]
    both = [subprocess.Popen(start, env=environment, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    assert sorted(process.communicate(timeout=60)[0].strip() for process in both) == ["0", "1"]
    assert subprocess.check_output(start, env=environment, text=True).strip() == "0"


def test_the_collector_rests_while_kernels_compile_and_only_then():
    """A kernel that calls another has it compiled before its own compilation ends; the outer end counts."""
    listener = Compiled(tell=lambda seconds: None)
    compilation = Event("numba:compile", "START", {"dispatcher": doubled})
    for is_enabled in (True, False):
        gc.enable() if is_enabled else gc.disable()
        try:
            listener.on_start(compilation)
            assert not gc.isenabled()
            listener.on_start(compilation)
            assert not gc.isenabled()
            listener.on_end(compilation)
            assert not gc.isenabled(), "the outer kernel compiles still"
            listener.on_end(compilation)
            assert gc.isenabled() == is_enabled and 0.0 <= listener.seconds < 60.0
        finally:
            gc.enable()


@kernel
def moved_by_one(address, count):
    """Move eight numbers at an address to the place before, double the number at ``count``, and return it."""
    numbers = doubles_at(address)
    store(numbers, 0 * count, load8(numbers, 1))
    numbers[count] = 2 * numbers[count]
    return numbers[count]


def test_numbers_are_read_and_written_at_their_address():
    """The kernel moves entries 1 to 8 down by one and doubles entry 10."""
    array = np.arange(12.0)
    assert moved_by_one(address_of(array), 10) == 20.0
    assert array.tolist() == [*range(1, 9), 8, 9, 20, 11]


@kernel
def last_of_rows(real, whole):
    """The sixth number of a row of doubles and of one of integers, and the first double again."""
    return doubles_of(real)[5], integers_of(whole)[5], doubles_of(doubles_of(real))[0]


def test_array_of_rows_is_a_single_row_in_a_kernel():
    """The sixth number of 1 to 6 in rows of three and of 0 to 5 in rows of two, and the first double."""
    assert last_of_rows(np.arange(6.0).reshape(2, 3) + 1, np.arange(6).reshape(3, 2)) == (6.0, 5, 1.0)


class Ball(NamedTuple):
    centre: Vector
    radius: float


class Weight(NamedTuple):
    grams: int
    places: Doubles


ball_at, weight_at = reader(Ball), reader(Weight)


@kernel
def read_rows(real, whole, index):
    """All fields of a ball and of a weight at an index."""
    ball, weight = ball_at(doubles_of(real), index), weight_at(integers_of(whole), index)
    x, y, z = ball.centre
    return x, y, z, ball.radius, weight.grams, weight.places[0]


def test_rows_are_named_tuples_with_and_without_compiler():
    """A row of a ball is four doubles, of a weight its grams and the address of its places."""
    places = np.array([0.5, 0.25])
    balls, weights = np.arange(8.0).reshape(2, 4), np.array([[3, address_of(places)], [5, address_of(places) + 8]])
    assert read_rows(balls, weights, 0) == (0.0, 1.0, 2.0, 3.0, 3, 0.5)
    assert read_rows(balls, weights, 1) == (4.0, 5.0, 6.0, 7.0, 5, 0.25)
    assert ball_at.interpreted(balls.ravel(), 1) == Ball((4.0, 5.0, 6.0), 7.0)
    weight = weight_at.interpreted(weights.ravel(), 1)
    assert (weight.grams, weight.places[0]) == (5, 0.25)


def test_an_array_with_gaps_has_no_address():
    """A column of a matrix: its numbers are four doubles from each other."""
    with pytest.raises(AssertionError):
        address_of(np.zeros((4, 4))[:, 1])


def test_a_kernel_takes_no_address_of_an_array_with_gaps():
    """The compiler refuses a column of a matrix."""
    with pytest.raises(TypingError, match="make this one contiguous first"):
        last_of_rows(np.zeros((6, 2))[:, 0], np.zeros(6, dtype=np.int64))
