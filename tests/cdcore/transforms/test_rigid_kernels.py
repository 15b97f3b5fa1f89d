"""The compiled passes give the bits of the plain functions and stop at the first bad pose."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import random_rotations

from cdcore.numerics import ORTHONORMAL_KEEP, ORTHONORMAL_REJECT
from cdcore.transforms.rigid import nearest_rotation, orthonormality_error, rotation_from_quaternion
from cdcore.transforms.rigid_kernels import GOOD, check_poses, matrix_error, split_poses, turns_of_quaternions

COUNT = 300


def spoiled(size, seed=0):
    rng = np.random.default_rng(seed)
    return random_rotations(rng, COUNT) + rng.normal(size=(COUNT, 3, 3)) * size


@pytest.mark.parametrize("size", [0, 1e-9, 1e-4, 1e-1])
def test_the_error_of_a_matrix_is_that_of_the_plain_function(size):
    for matrix in spoiled(size):
        assert matrix_error(matrix) == orthonormality_error(matrix)


def test_nan_anywhere_gives_nan():
    for place in range(9):
        matrix = np.eye(3)
        matrix.flat[place] = np.nan
        assert np.isnan(matrix_error(matrix))


@pytest.mark.parametrize("size", [1e-13, 1e-8, 1e-5, 5e-5])
def test_repair_gives_the_nearest_rotation(size):
    turn = spoiled(size)
    expected = nearest_rotation(turn)
    bad, repaired, worst = check_poses(
        np.zeros((COUNT, 3)), turn, np.ones(COUNT, dtype=bool), ORTHONORMAL_KEEP, ORTHONORMAL_REJECT
    )
    assert (bad, repaired) == (GOOD, COUNT)
    assert 0 < worst < 20 * size
    assert np.abs(turn - expected).max() < 5e-15
    assert orthonormality_error(turn).max() <= ORTHONORMAL_KEEP


def test_the_first_bad_pose_is_named():
    turn = spoiled(0)
    turn[17], turn[40] = -turn[17], 0.0
    valid = np.ones(COUNT, dtype=bool)
    assert check_poses(np.zeros((COUNT, 3)), turn, valid, ORTHONORMAL_KEEP, ORTHONORMAL_REJECT)[0] == 17
    valid[17] = False
    assert check_poses(np.zeros((COUNT, 3)), turn, valid, ORTHONORMAL_KEEP, ORTHONORMAL_REJECT)[0] == 40


def test_quaternions_give_the_bits_of_the_plain_function():
    q = np.random.default_rng(4).normal(size=(COUNT, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    turn = np.empty((COUNT, 3, 3))
    assert turns_of_quaternions(q, np.ones(COUNT, dtype=bool), 1e-3, turn) == GOOD
    assert turn.tobytes() == rotation_from_quaternion(q).tobytes()


def test_matrices_are_cut_without_touching_a_bit():
    poses = np.random.default_rng(5).normal(size=(COUNT, 4, 4))
    poses[:, 3] = [0, 0, 0, 1]
    place, turn = np.empty((COUNT, 3)), np.empty((COUNT, 3, 3))
    assert split_poses(poses, np.ones(COUNT, dtype=bool), place, turn) == GOOD
    assert np.array_equal(place, poses[:, :3, 3])
    assert np.array_equal(turn, poses[:, :3, :3])
