"""Relative poses are R_B^T R_A and R_B^T (t_A - t_B), and the chord bounds how far rotations stray."""

import numpy as np
import pytest
from eight_frames import EightFrames


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
