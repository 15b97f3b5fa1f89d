"""Eight lanes at a time say what one says."""

import numpy as np
import pytest
from support.eight_frames import EightFrames

from cdcore.kernels.compiling import kernel
from cdcore.kernels.simd import above, load8, outside


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


@kernel
def compared(a, b):
    return above(load8(a, 0), load8(b, 0)), outside(load8(a, 0), 1.0)


def test_comparisons_give_a_bit_per_lane_and_none_for_nan():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 8))
    weights = 1 << np.arange(8)
    assert compared(a, b) == (int(weights[a > b].sum()), int(weights[np.abs(a) > 1].sum()))
    assert compared(np.full(8, np.nan), np.zeros(8)) == (0, 0)
