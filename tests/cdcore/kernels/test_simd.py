"""Every operation of kernels gives the bits of its body in Python, for numbers of all sizes, infinities and NaN."""

import numpy as np
from numba import njit

from cdcore.kernels import simd
from cdcore.triangles.sums import bits_of

ROWS = 2_000
LANE_OPERATIONS = {
    "plus": 2, "minus": 2, "times": 2, "most": 2, "least3": 3, "most3": 3, "root": 1, "size": 1, "fused": 3, "dot": 6,
    "moved": 7, "minor": 4, "excess": 2,
}  # fmt: skip
"""Operations on lanes, and how many operands they have."""


def ordinary_and_extreme_doubles(rng, rows, lanes=8):
    """Doubles of ordinary and extreme sizes, some of them no numbers or zeros of either sign."""
    values = rng.normal(size=(rows, lanes)) * 2.0 ** rng.integers(-40, 40, (rows, lanes))
    special = rng.random((rows, lanes))
    for k, value in enumerate((0.0, -0.0, np.inf, -np.inf, np.nan, 5e-324, 1e308, 1.0)):
        values[(special > 0.01 * k) & (special < 0.01 * k + 0.004)] = value
    return values


def same_bits(first, second):
    """Whether doubles are equal to the sign of zero; one NaN is like another."""
    first, second = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    both_nan = np.isnan(first) & np.isnan(second)
    return bool(((first.view(np.int64) == second.view(np.int64)) | both_nan).all())


def all_compiled(operands):
    """Every operation in machine code on rows of eight lanes, (operations, n, 8): one function compiles once."""
    lines = ["def over(operands, out):", "    for k in range(operands.shape[1]):"]
    for row, (name, count) in enumerate(LANE_OPERATIONS.items()):
        loads = ", ".join(f"load8(operands[{number}], 8 * k)" for number in range(count))
        lines.append(f"        store(out[{row}], 8 * k, {name}({loads}))")
    names = {name: getattr(simd, name) for name in ("load8", "store", *LANE_OPERATIONS)}
    exec("\n".join(lines), names)
    out = np.empty((len(LANE_OPERATIONS), *operands.shape[1:]))
    njit(names["over"])(operands, out)
    return out


def test_lane_operations_give_bits_of_their_python_bodies():
    """Operations on eight lanes (LANE_OPERATIONS), compiled and as Python, in 2,000 rows of eight doubles.

    These include zeros of both signs, infinities, NaN and numbers near the limits.
    """
    rng = np.random.default_rng(1)
    operands = np.stack([ordinary_and_extreme_doubles(rng, ROWS) for _ in range(max(LANE_OPERATIONS.values()))])
    with np.errstate(all="ignore"):
        expected = {name: getattr(simd, name).interpreted(*operands[:count]) for name, count in LANE_OPERATIONS.items()}
    compiled = dict(zip(LANE_OPERATIONS, all_compiled(operands), strict=True))
    assert [name for name in LANE_OPERATIONS if not same_bits(compiled[name], expected[name])] == []


def test_lane_comparisons_give_bits_of_their_python_bodies():
    """A comparison of eight lanes (``above``, ``outside``) gives an integer of eight bits, one for each lane.

    500 rows of ordinary and extreme doubles are compared, compiled and as Python.
    """
    rng, load8, above, outside = np.random.default_rng(2), simd.load8, simd.above, simd.outside

    @njit
    def compare_rows(first, second, is_above, is_outside):
        for k in range(len(is_above)):
            a, b = load8(first, 8 * k), load8(second, 8 * k)
            is_above[k] = above(a, b)
            is_outside[k] = outside(a, b)

    first, second = (ordinary_and_extreme_doubles(rng, rows=500) for _ in range(2))
    is_above, is_outside = np.empty((2, 500), dtype=np.int64)
    compare_rows(first, second, is_above, is_outside)
    for operation, bits in ((above, is_above), (outside, is_outside)):
        assert bits.tolist() == [operation.interpreted(*rows) for rows in zip(first, second, strict=True)], operation
        assert 0 < bits.max() <= 255, operation


def test_lanes_are_loaded_shuffled_and_spread_as_in_python():
    """Loads and shuffles of four and eight lanes: a compiled function writes each result behind the last, into one row.

    The same operations as Python must give the same bits.
    """
    load4, corners4, first3 = simd.load4, simd.corners4, simd.first3
    following4, first4, splat8, store, plus, load8 = (
        simd.following4, simd.first4, simd.splat8, simd.store, simd.plus, simd.load8,
    )  # fmt: skip

    @njit
    def over(values, out):
        store(out, 0, load4(values, 3))
        store(out, 4, corners4(values, 2))
        store(out, 8, following4(load4(values, 5)))
        store(out, 12, first4(load4(values, 6)))
        store(out, 16, splat8(values.ravel()[7]))
        store(out, 24, plus(load8(values, 1), 0.5))
        for k, value in enumerate(first3(load4(values, 9))):
            out[32 + k] = value

    values, out = np.random.default_rng(3).normal(size=(2, 16)), np.zeros(35)
    over(values, out)
    python = {name: getattr(simd, name).interpreted for name in (
        "load4", "corners4", "first3", "following4", "first4", "splat8", "plus", "load8",
    )}  # fmt: skip
    expected = np.concatenate([
        python["load4"](values, 3), python["corners4"](values, 2), python["following4"](python["load4"](values, 5)),
        python["first4"](python["load4"](values, 6)), python["splat8"](values.ravel()[7]),
        python["plus"](python["load8"](values, 1), 0.5), python["first3"](python["load4"](values, 9)),
    ])  # fmt: skip
    assert same_bits(out, expected)


def test_compiled_bits_of_a_double_equal_the_python_version():
    """``bits_of`` is a double's 64 bits as a whole number; 800 doubles, infinities and numbers near the limits among
    them.
    """

    @njit
    def over(values, out):
        for k in range(len(values)):
            out[k] = bits_of(values[k])

    values = ordinary_and_extreme_doubles(np.random.default_rng(4), 100).ravel()
    out = np.empty(len(values), dtype=np.int64)
    over(values, out)
    assert out.tolist() == [bits_of.interpreted(value) for value in values]
