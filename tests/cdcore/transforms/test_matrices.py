"""Equations (1)-(14) as matrices do what their component formulas say, in the order they are written."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.shapes import orthonormality_error, random_rotations

from cdcore.transforms.matrices import apply_row, row_rotation, row_scale, row_translation
from cdcore.transforms.rigid import rotation_from_quaternion

RNG = np.random.default_rng(0)
POINTS = RNG.normal(size=(1000, 3))
X, Y, Z = POINTS.T
A, B, G = 0.7, -1.9, 2.6


@pytest.mark.parametrize(
    ("matrix", "expected"),
    [
        (row_translation([0.1, -2.0, 3.0]), (X + 0.1, Y - 2.0, Z + 3.0)),
        (row_scale([2.0, -0.5, 3.0]), (2.0 * X, -0.5 * Y, 3.0 * Z)),
        (row_rotation(0, A), (X, Y * np.cos(A) - Z * np.sin(A), Y * np.sin(A) + Z * np.cos(A))),
        (row_rotation(1, B), (X * np.cos(B) + Z * np.sin(B), Y, -X * np.sin(B) + Z * np.cos(B))),
        (row_rotation(2, G), (X * np.cos(G) - Y * np.sin(G), X * np.sin(G) + Y * np.cos(G), Z)),
    ],
    ids=["(1)-(3)", "(4)-(5)", "(6)-(10)", "(11)-(12)", "(13)-(14)"],
)
def test_a_matrix_gives_its_component_formulas_by_rows_and_transposed_by_columns(matrix, expected):
    wanted, rows = np.stack(expected, axis=1), np.column_stack([POINTS, np.ones(1000)])
    assert np.abs(apply_row(POINTS, matrix) - wanted).max() < 1e-12
    assert np.abs((rows @ matrix)[:, :3] - wanted).max() < 1e-12
    assert np.abs((matrix.T @ rows.T)[:3].T - wanted).max() < 1e-12


@pytest.mark.parametrize("order", ["xyz", "zxy"], ids=["left to right", "Unity's Euler angles"])
def test_products_act_from_left_to_right(order):
    for angles in RNG.uniform(-np.pi, np.pi, (100, 3)):
        first, second, third = (
            row_rotation("xyz".index(axis), angle) for axis, angle in zip(order, angles, strict=True)
        )
        expected = Rotation.from_euler(order, angles).as_matrix()
        assert np.abs((first @ second @ third).T[:3, :3] - expected).max() < 2e-15


def test_a_scale_about_a_centre_leaves_it_where_it_is_and_the_printed_one_does_not():
    centre, scale = np.array([1.0, -2.0, 0.5]), [2.0, 3.0, 0.5]
    about, offset = row_scale(scale, centre), np.array([0.1, 0.2, 0.3])
    assert np.abs(apply_row(centre, about) - centre).max() < 1e-15
    assert np.allclose(apply_row(centre + offset, about), centre + offset * scale)
    assert np.allclose(apply_row(centre, row_scale(scale)), centre * scale)


def test_scaling_before_rotating_shears_nothing_and_scaling_after_it_does():
    turn, scale = row_rotation(0, A) @ row_rotation(2, G), row_scale([1.0, 2.0, 3.0])
    right, wrong = ((part @ part.T)[:3, :3] for part in (scale @ turn, turn @ scale))
    assert np.abs(right - np.diag([1.0, 4.0, 9.0])).max() < 1e-14
    assert np.abs(wrong - np.diag(np.diag(wrong))).max() > 0.1


def test_quaternions_are_read_as_xyzw():
    quaternions = np.random.default_rng(0).normal(size=(1000, 4))
    expected = Rotation.from_quat(quaternions).as_matrix()
    assert np.abs(rotation_from_quaternion(quaternions) - expected).max() < 1e-14


def test_a_quaternion_and_its_negative_give_the_same_bits():
    quaternions = np.random.default_rng(1).normal(size=(100, 4))
    assert rotation_from_quaternion(quaternions).tobytes() == rotation_from_quaternion(-quaternions).tobytes()


def test_rotations_of_quaternions_are_orthonormal_to_rounding():
    assert orthonormality_error(random_rotations(np.random.default_rng(2), 5000)).max() < 2e-15
