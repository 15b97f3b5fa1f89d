"""Eight lanes at a time say what one says."""

import numpy as np
import pytest
from support.eight_frames import EightFrames

from cdcore.kernels import simd as lanes
from cdcore.kernels.compiling import kernel, runtime_int
from cdcore.kernels.simd import above, excess, load8, moved, outside, row16, splat8, store, turn


@pytest.mark.parametrize("seed", range(4))
def test_relative_poses_equal_numpy_in_every_lane(seed):
    scene = EightFrames(seed)
    rows = scene.relative.reshape(12, 8)
    for lane in range(8):
        turn = scene.turn[lane, 1].T @ scene.turn[lane, 0]
        move = scene.turn[lane, 1].T @ (scene.move[lane, 0] - scene.move[lane, 1])
        assert np.allclose(rows[:9, lane].reshape(3, 3), turn, atol=1e-15)
        assert np.allclose(rows[9:, lane], move, atol=1e-14)


@pytest.mark.parametrize("seed", range(4))
def test_the_chord_is_the_largest_spectral_distance_from_the_middle(seed):
    scene = EightFrames(seed)
    turns = scene.relative[:72].reshape(3, 3, 8).transpose(2, 0, 1)
    assert np.array_equal(scene.middle.reshape(3, 3), turns[4])
    largest = max(np.linalg.norm(turn - turns[4], 2) for turn in turns)
    assert largest * (1 - 1e-13) <= scene.chord <= largest * (1 + 1e-9) + 1e-15


TWO = ["plus", "minus", "times", "least", "most"]
NUMPY = {"plus": np.add, "minus": np.subtract, "times": np.multiply, "least": np.minimum, "most": np.maximum}


@kernel
def apply_all(a, b, out):
    x, y = load8(a, 0), load8(b, 1)
    store(out, 0, lanes.plus(x, y))
    store(out, 8, lanes.minus(x, y))
    store(out, 16, lanes.times(x, y))
    store(out, 24, lanes.least(x, y))
    store(out, 32, lanes.most(x, y))
    store(out, 40, lanes.dot(x, y, 2.0, y, 3.0, x))
    store(out, 48, moved(x, 1.0, 2.0, 3.0, x, y, x))
    store(out, 56, turn(x, y, 2.0, y))
    store(out, 64, excess(x, 0.5))
    store(out, 72, lanes.root(lanes.size(x)))
    store(out, 80, lanes.most3(x, y, splat8(0.0)))
    return above(x, y), outside(x, 1.0)


@kernel
def read_row(array, row):
    return row16(array, row)


@kernel
def corners(a, out):
    x = lanes.load4(a, 0)
    store(out, 0, lanes.following4(x))
    store(out, 4, lanes.first4(x))
    store(out, 8, lanes.corners4(out, 1))
    return runtime_int(np.int32(7))


@pytest.fixture(scope="module")
def applied():
    rng = np.random.default_rng(0)
    a, b, out = rng.normal(size=8), rng.normal(size=9), np.empty(88)
    bits = apply_all(a, b, out)
    return a, b[1:], out.reshape(-1, 8), bits


@pytest.mark.parametrize("row", range(5))
def test_plain_operations_equal_numpy_bit_for_bit(applied, row):
    a, b, out, _ = applied
    assert np.array_equal(out[row], NUMPY[TWO[row]](a, b))


def test_sums_of_products_equal_numpy_to_rounding(applied):
    a, b, out, _ = applied
    assert np.allclose(out[5], a * b + b * 3.0 + 2.0 * a, rtol=1e-14, atol=1e-14)
    assert np.allclose(out[6], a + a + 2 * b + 3 * a, rtol=1e-14, atol=1e-14)
    assert np.array_equal(out[7], a * b - 2.0 * b)


def test_excess_size_and_maximum_of_three(applied):
    a, b, out, _ = applied
    assert np.array_equal(out[8], np.maximum(np.abs(a) - 0.5, 0.0))
    assert np.array_equal(out[9], np.sqrt(np.abs(a)))
    assert np.array_equal(out[10], np.maximum(np.maximum(a, b), 0.0))


def test_comparisons_give_a_bit_per_lane_and_none_for_nan(applied):
    a, b, _, bits = applied
    weights = 1 << np.arange(8)
    assert bits == (int(weights[a > b].sum()), int(weights[np.abs(a) > 1].sum()))
    assert apply_all(np.full(8, np.nan), np.zeros(9), np.empty(88)) == (0, 0)


def test_rows_and_corners():
    table = np.arange(48.0).reshape(3, 16)
    assert read_row(table, 2) == tuple(table[2])
    out = np.empty(12)
    assert corners(np.array([1.0, 2.0, 3.0, 1.0]), out) == 7
    assert out.tolist() == [2.0, 3.0, 1.0, 2.0, 1.0, 1.0, 1.0, 1.0, 3.0, 1.0, 1.0, 3.0]
