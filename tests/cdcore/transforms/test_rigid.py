"""Quaternions give the rotations the equations give."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation
from support.shapes import orthonormality_error, random_rotations

from cdcore.transforms.rigid import rotation_from_quaternion


def test_quaternions_are_read_as_xyzw():
    quaternions = np.random.default_rng(0).normal(size=(1000, 4))
    expected = Rotation.from_quat(quaternions).as_matrix()
    assert np.abs(rotation_from_quaternion(quaternions) - expected).max() < 1e-14


def test_a_quaternion_and_its_negative_give_the_same_bits():
    quaternions = np.random.default_rng(1).normal(size=(100, 4))
    assert rotation_from_quaternion(quaternions).tobytes() == rotation_from_quaternion(-quaternions).tobytes()


def test_rotations_of_quaternions_are_orthonormal_to_rounding():
    assert orthonormality_error(random_rotations(np.random.default_rng(2), 5000)).max() < 2e-15
