"""Quaternions give the rotations the equations give, and the measure of error sees every fault."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from shapes import random_rotations

from cdcore.transforms.rigid import nearest_rotation, orthonormality_error, rotation_from_quaternion


def test_quaternions_are_read_as_xyzw():
    quaternions = np.random.default_rng(0).normal(size=(1000, 4))
    expected = Rotation.from_quat(quaternions).as_matrix()
    assert np.abs(rotation_from_quaternion(quaternions) - expected).max() < 1e-14


def test_a_quaternion_and_its_negative_give_the_same_bits():
    quaternions = np.random.default_rng(1).normal(size=(100, 4))
    assert rotation_from_quaternion(quaternions).tobytes() == rotation_from_quaternion(-quaternions).tobytes()


def test_rotations_of_quaternions_are_orthonormal_to_rounding():
    assert orthonormality_error(random_rotations(np.random.default_rng(2), 5000)).max() < 2e-15


@pytest.mark.parametrize("factor", [1.01, 0.99])
def test_a_stretch_is_seen_at_its_size(factor):
    assert orthonormality_error(np.eye(3) * factor) == pytest.approx(abs(factor**2 - 1))


def test_a_reflection_is_infinitely_off_and_nan_stays_nan():
    mirror = np.diag([1.0, 1.0, -1.0])
    broken = np.eye(3)
    broken[1, 2] = np.nan
    assert orthonormality_error(np.array([mirror])).tolist() == [np.inf]
    assert np.isnan(orthonormality_error(broken))


def test_the_nearest_rotation_is_a_rotation_and_no_other_tried_is_nearer():
    rng = np.random.default_rng(3)
    rotation = random_rotations(rng)
    spoiled = rotation + rng.normal(size=(3, 3)) * 1e-3
    nearest = nearest_rotation(spoiled)
    assert orthonormality_error(nearest) < 1e-14
    distance = np.linalg.norm(nearest - spoiled)
    for axis in rng.normal(size=(200, 3)):
        other = Rotation.from_rotvec(axis * 1e-4).as_matrix() @ nearest
        assert np.linalg.norm(other - spoiled) > distance
