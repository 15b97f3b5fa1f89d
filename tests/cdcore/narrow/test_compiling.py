"""The mark that keeps a kernel one function leaves it callable, from Python and from other kernels."""

from numba import njit

from cdcore.narrow.compiling import stay_one_function


@njit
def doubled(x):
    stay_one_function()
    return 2 * x


@njit
def quadrupled(x):
    return doubled(doubled(x))


def test_a_marked_kernel_gives_the_same_answers_and_is_not_copied_into_its_caller():
    assert quadrupled(3) == 12
    code = next(iter(quadrupled.inspect_llvm().values()))
    assert any("call" in line and "doubled" in line for line in code.splitlines())
