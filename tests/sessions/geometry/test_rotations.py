"""Quaternions as arrays do what SciPy's rotations do."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from sessions.geometry.rotations import (
    axis_angle_quaternion,
    quaternion_about,
    quaternion_facing,
    quaternion_from_matrix,
    quaternion_from_vector,
    quaternion_inverse,
    quaternion_product,
    rotated_vectors,
    slerp,
)

RNG = np.random.default_rng(1)
FIRST, SECOND = Rotation.random(20, random_state=1), Rotation.random(20, random_state=2)
VECTORS = RNG.normal(size=(20, 3))


def assert_same_rotation(quaternions, rotation):
    """Quaternions (..., 4) turn as SciPy's rotation does, whichever sign they have."""
    products = np.abs((np.asarray(quaternions) * rotation.as_quat()).sum(axis=-1))
    assert np.abs(products - 1.0).max() <= 1e-12


def test_products_inverses_and_turned_vectors_agree_with_scipy():
    """Twenty random rotations and a random vector for each: SciPy's product, inverse and rotated vector, to 1e-12."""
    first, second = FIRST.as_quat(), SECOND.as_quat()
    assert_same_rotation(quaternion_product(first, second), FIRST * SECOND)
    assert_same_rotation(quaternion_inverse(first), FIRST.inv())
    assert np.abs(rotated_vectors(first, VECTORS) - FIRST.apply(VECTORS)).max() <= 1e-12


def test_quaternions_of_axes_and_angles_agree_with_scipy():
    """Angles from -3 to 3 about an axis that is no unit vector; rotation vectors, of which the last is zero."""
    axis, angles = np.array([1.0, -2.0, 0.5]), np.linspace(-3.0, 3.0, 7)
    about = Rotation.from_rotvec(angles[:, None] * axis / np.linalg.norm(axis))
    assert_same_rotation(quaternion_about(axis, angles), about)
    assert_same_rotation(axis_angle_quaternion(axis, -3.0), about[0])
    vectors = np.concatenate([VECTORS, np.zeros((1, 3))])
    assert_same_rotation(quaternion_from_vector(vectors), Rotation.from_rotvec(vectors))


def test_quaternion_of_a_matrix_has_no_negative_scalar():
    """Random rotations, and half turns about three axes, of which each has another largest square."""
    half_turns = Rotation.from_rotvec(np.pi * np.eye(3))
    for rotation in (*FIRST, *half_turns):
        quaternion = quaternion_from_matrix(rotation.as_matrix())
        assert_same_rotation(quaternion, rotation)
        assert quaternion[3] >= 0.0


@pytest.mark.parametrize("forward", [(0.0, 0.0, -1.0), (2.0, 1.0, 0.0), (-1.0, -3.0, 2.0)])
def test_facing_quaternion_looks_forward_and_stands_upright(forward):
    """-Z turns to the direction, +X stays level, and +Y points upwards."""
    rotation = Rotation.from_quat(quaternion_facing(forward))
    assert np.abs(rotation.apply([0, 0, -1]) - forward / np.linalg.norm(forward)).max() <= 1e-12
    _, height_of_x, _ = rotation.apply([1, 0, 0])
    _, height_of_y, _ = rotation.apply([0, 1, 0])
    assert abs(height_of_x) <= 1e-12
    assert height_of_y > 0.0


@pytest.mark.parametrize("forward", [(0.0, 0.0, 0.0), (0.0, 2.0, 0.0)])
def test_vertical_direction_is_faced_by_no_quaternion(forward):
    """Neither a vertical direction nor one without a length says where +X, which stays level, would point."""
    with pytest.raises(ValueError, match="zero or vertical"):
        quaternion_facing(forward)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("turn", [0.0, 1e-6, 0.5, 3.0])
def test_blended_quaternions_follow_the_shorter_arc(turn, sign):
    """Five steps from a rotation to one turned by up to 3 rad from it, where SciPy's Slerp has them, to 1e-9 rad.

    A quaternion and its negative are one rotation: either sign of the second gives the same steps.
    """
    ends = Rotation.concatenate([FIRST[0], Rotation.from_rotvec([0.0, turn, 0.0]) * FIRST[0]])
    fractions = np.linspace(0.0, 1.0, 5)
    start, end = ends.as_quat()
    blended = slerp(start, sign * end, fractions)
    assert np.abs(np.linalg.norm(blended, axis=1) - 1.0).max() <= 1e-12
    away = Rotation.from_quat(blended) * Slerp([0.0, 1.0], ends)(fractions).inv()
    assert away.magnitude().max() <= 1e-9
