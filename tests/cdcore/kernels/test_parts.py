"""A part has no machine code of its own, its callers have all of it, and marks about inlining are kept."""

import numpy as np
import pytest
from numba import njit
from numba.core import event

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel, kernel, stay_one_function
from cdcore.kernels.parts import PartLibrary

OFFSET = 7


@hot_kernel
def squared(x):
    return x * x


@hot_kernel
def shifted(x):
    stay_one_function()
    return squared(x) + OFFSET


@hot_kernel
def halved(x):
    become_part_of_caller()
    return x / 2


@hot_kernel
def factorial(n):
    if n < 2:
        return 1
    return n * factorial(n - 1)


def fresh(function):
    made = kernel(function)
    made._cache = type(made)(function)._cache  # no disk: this test looks at what is compiled now
    return made


def code_of(compiled):
    return next(iter(compiled.inspect_llvm().values())).splitlines()


def defined(lines, name):
    return [line for line in lines if line.startswith("define") and name in line]


def test_what_parts_compute_arrives_through_a_caller_of_callers_in_which_they_stay_or_vanish_as_marked():
    @fresh
    def asked(x):
        return shifted(x) + halved(x)

    assert asked(4.0) == 16.0 + OFFSET + 2.0
    assert asked(3) == 9 + OFFSET + 1.5
    assert any("call" in line and "shifted" in line for line in code_of(asked))
    assert not defined(code_of(asked), "halved")


def test_a_part_is_compiled_once_for_two_callers_and_both_hold_its_code():
    @fresh
    def one(x):
        return shifted(x)

    @fresh
    def other(x):
        return shifted(x) - 1

    with event.install_recorder("numba:compile") as heard:
        assert (one(5j), other(5j)) == (-25 + OFFSET, -26 + OFFSET)
    compiled = [row.data["dispatcher"].py_func.__name__ for _, row in heard.buffer if row.is_start]
    assert sorted(compiled) == ["one", "other", "shifted", "squared"]
    assert defined(code_of(one), "shifted")
    assert defined(code_of(other), "shifted")


def test_a_part_is_compiled_once_for_all_numbers_and_widths_and_a_member_of_a_tuple_compiles_nothing():
    @hot_kernel
    def tripled(x):
        return 3 * x

    @fresh
    def asked(x, small):
        pair = (x, tripled(3))
        pair[0][0] += pair[-1] + tripled(4)
        return pair[0], tripled(small[0])

    given = np.zeros(1, dtype=np.int64)
    with event.install_recorder("numba:compile") as heard:
        kept, last = asked(given, np.full(1, 5, dtype=np.int32))
    assert [row.data["dispatcher"].py_func for _, row in heard.buffer if row.is_start] == [
        asked.py_func,
        tripled.py_func,
    ]
    del given
    assert (kept.tolist(), last) == ([9 + 12], 15)


def test_a_part_that_calls_itself_is_complete():
    @fresh
    def asked(n):
        return factorial(n)

    assert asked(10) == 3628800


def test_a_part_has_no_machine_code_and_its_caller_has():
    @fresh
    def asked(x):
        return squared(x)

    asked(2)
    part = next(iter(squared.overloads.values())).library
    assert isinstance(part, PartLibrary)
    assert part.get_pointer_to_function(part.name) == 0
    whole = next(iter(asked.overloads.values()))
    assert whole.library.get_pointer_to_function(whole.fndesc.llvm_func_name) != 0


@pytest.mark.slow
def test_operators_give_the_bits_and_the_type_that_numba_gives():
    def asked(a, b):
        return a + b, a - b, a * b, a / b, a // b, a % b, a**2, 2 - a, a < b, a == b, a >= 3.0 * b

    ours, numbas = fresh(asked), njit(error_model="numpy")(asked)
    for a, b in ((-7, 3), (np.uint8(200), -3), (True, 2)):
        mine, wanted = ours(a, b), numbas(a, b)
        assert [type(one) for one in mine] == [type(one) for one in wanted]
        assert np.array(mine, dtype=float).tobytes() == np.array(wanted, dtype=float).tobytes()
