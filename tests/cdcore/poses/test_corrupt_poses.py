"""Compiled passes name the first bad pose and repair what is nearly a rotation; quaternions are xyzw."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.shapes import nearest_rotation, orthonormality_error, random_rotations

from cdcore.numerics import readonly
from cdcore.poses import rotation_from_quaternion
from cdcore.poses.corrupt_poses import GOOD, check_poses
from cdcore.protocol.motion import NO_MATRICES
from cdcore.tolerances import ORTHONORMAL_KEEP

COUNT = 300
"""Rotations of a test."""


def checked_poses(position, rotation):
    """Index of the first bad pose, how many were repaired, and the largest error."""
    changed = np.empty((len(position), 1), dtype=bool)
    arrays = position[:, None], rotation[:, None], np.ones_like(changed)
    last = np.array([GOOD])
    return check_poses(readonly(NO_MATRICES[:]), *arrays, np.empty(18), last, changed)


def rotations_with_errors(size, seed=0):
    """Random rotations with normal errors of this size in their entries."""
    rng = np.random.default_rng(seed)
    return random_rotations(rng, COUNT) + rng.normal(size=(COUNT, 3, 3)) * size


@pytest.mark.parametrize("size", [0, 1e-9, 1e-4])
def test_matrix_error_is_that_of_its_gram_matrix(size):
    """The error of a matrix R is the largest entry of |R^T R - I|, here by NumPy.

    40 rotations get random errors of this size in their entries.
    """
    for matrix in rotations_with_errors(size)[:40]:
        expected = np.abs(matrix.T @ matrix - np.eye(3)).max()
        _first_bad, _repaired, largest_error = checked_poses(position=np.zeros((1, 3)), rotation=matrix[None].copy())
        assert largest_error == pytest.approx(expected, rel=1e-9, abs=2e-15)


@pytest.mark.parametrize("size", [1e-13, 1e-8, 1e-5, 5e-5])
def test_repair_gives_the_nearest_rotation(size):
    """300 rotations with random errors of this size in their entries are repaired in place, all of them.

    The nearest rotation is that of a singular value decomposition, which itself rounds by up to 5e-15. Entries of
    R^T R - I have a standard deviation of at most twice the size: ten of these are never reached.
    """
    rotation = rotations_with_errors(size)
    expected = nearest_rotation(rotation)
    first_bad, repaired, largest_error = checked_poses(np.zeros((COUNT, 3)), rotation)
    assert (first_bad, repaired) == (GOOD, COUNT)
    assert 0 < largest_error < 20 * size
    assert np.abs(rotation - expected).max() < 1e-14
    assert orthonormality_error(rotation).max() <= ORTHONORMAL_KEEP


def test_translations_as_large_as_doubles_go_are_good():
    """1.7e308 is just below the largest double; a pose of 300 is there, and stays as it is."""
    position = np.random.default_rng(5).normal(size=(COUNT, 3))
    position[3] = 1.7e308, 1.7e308, -1.7e308
    first_bad, _repaired, largest_error = checked_poses(position, rotations_with_errors(size=0))
    assert first_bad == GOOD
    assert largest_error < 1e-14
    assert position[3].tolist() == [1.7e308, 1.7e308, -1.7e308]


def test_quaternions_are_read_as_xyzw():
    """1,000 random quaternions of any length; SciPy reads them in that order."""
    quaternions = np.random.default_rng(0).normal(size=(1000, 4))
    expected = Rotation.from_quat(quaternions).as_matrix()
    assert np.abs(rotation_from_quaternion(quaternions) - expected).max() < 1e-14


def test_a_quaternion_and_its_negative_give_the_same_bits():
    """Both stand for the same rotation; 100 random ones."""
    quaternions = np.random.default_rng(1).normal(size=(100, 4))
    assert rotation_from_quaternion(quaternions).tobytes() == rotation_from_quaternion(-quaternions).tobytes()


def test_rotations_of_quaternions_are_orthonormal_to_rounding():
    """5,000 rotations of random quaternions, and the largest entry of |R^T R - I| of any."""
    rotations = rotation_from_quaternion(np.random.default_rng(2).normal(size=(5000, 4)))
    assert orthonormality_error(rotations).max() < 2e-15
