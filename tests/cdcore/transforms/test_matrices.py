"""Equations (1)-(14) as matrices do what their component formulas say, in the order they are written."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cdcore.transforms.matrices import (
    apply_row,
    row_local_to_world,
    row_product,
    row_rotation_x,
    row_rotation_y,
    row_rotation_z,
    row_scale,
    row_scale_about,
    row_translation,
    row_unity_euler,
    to_column,
)

RNG = np.random.default_rng(0)
POINTS = RNG.normal(size=(1000, 3))
X, Y, Z = POINTS.T
A, B, G = 0.7, -1.9, 2.6


@pytest.mark.parametrize(
    ("matrix", "expected"),
    [
        (row_translation([0.1, -2.0, 3.0]), (X + 0.1, Y - 2.0, Z + 3.0)),
        (row_scale([2.0, -0.5, 3.0]), (2.0 * X, -0.5 * Y, 3.0 * Z)),
        (row_rotation_x(A), (X, Y * np.cos(A) - Z * np.sin(A), Y * np.sin(A) + Z * np.cos(A))),
        (row_rotation_y(B), (X * np.cos(B) + Z * np.sin(B), Y, -X * np.sin(B) + Z * np.cos(B))),
        (row_rotation_z(G), (X * np.cos(G) - Y * np.sin(G), X * np.sin(G) + Y * np.cos(G), Z)),
    ],
    ids=["(1)-(3)", "(4)-(5)", "(6)-(10)", "(11)-(12)", "(13)-(14)"],
)
def test_a_matrix_gives_its_component_formulas(matrix, expected):
    assert np.abs(apply_row(POINTS, matrix) - np.stack(expected, axis=1)).max() < 1e-12
    rows = np.column_stack([POINTS, np.ones(1000)])
    assert np.abs((rows @ matrix)[:, :3] - np.stack(expected, axis=1)).max() < 1e-12
    columns = (to_column(matrix) @ rows.T).T
    assert np.abs(columns[:, :3] - np.stack(expected, axis=1)).max() < 1e-12


@pytest.mark.parametrize(
    ("matrix", "axis", "angle"), [(row_rotation_x(A), "x", A), (row_rotation_y(B), "y", B), (row_rotation_z(G), "z", G)]
)
def test_a_rotation_is_the_transpose_of_the_standard_column_matrix(matrix, axis, angle):
    assert np.abs(to_column(matrix)[:3, :3] - Rotation.from_euler(axis, angle).as_matrix()).max() < 1e-15
    assert np.linalg.det(matrix) == pytest.approx(1.0, abs=1e-15)


def test_a_quarter_turn_about_y_takes_z_to_x_and_x_to_minus_z():
    turn = row_rotation_y(np.pi / 2)
    assert np.allclose(apply_row([0, 0, 1], turn), [1, 0, 0])
    assert np.allclose(apply_row([1, 0, 0], turn), [0, 0, -1])


def test_translations_stand_in_the_last_row():
    assert row_translation([1, 2, 3])[3].tolist() == [1, 2, 3, 1]


def test_products_act_from_left_to_right():
    angles = RNG.uniform(-np.pi, np.pi, (200, 3))
    for a, b, g in angles:
        row = row_product(row_rotation_x(a), row_rotation_y(b), row_rotation_z(g))
        column = to_column(row_rotation_z(g)) @ to_column(row_rotation_y(b)) @ to_column(row_rotation_x(a))
        assert np.abs(to_column(row) - column).max() < 1e-15
        assert np.abs(to_column(row)[:3, :3] - Rotation.from_euler("xyz", [a, b, g]).as_matrix()).max() < 2e-15


def test_unity_euler_angles_act_about_z_then_x_then_y():
    for x, y, z in RNG.uniform(-np.pi, np.pi, (200, 3)):
        expected = Rotation.from_euler("zxy", [z, x, y]).as_matrix()
        assert np.abs(to_column(row_unity_euler(x, y, z))[:3, :3] - expected).max() < 2e-15


def test_a_scale_about_a_centre_leaves_it_where_it_is_and_the_printed_one_does_not():
    centre = np.array([1.0, -2.0, 0.5])
    about = row_scale_about([2.0, 3.0, 0.5], centre)
    assert np.abs(apply_row(centre, about) - centre).max() < 1e-15
    offset = np.array([0.1, 0.2, 0.3])
    assert np.allclose(apply_row(centre + offset, about), centre + offset * [2.0, 3.0, 0.5])
    assert np.allclose(apply_row(centre, row_scale([2.0, 3.0, 0.5])), centre * [2.0, 3.0, 0.5])


def test_local_to_world_scales_before_it_rotates_and_shears_nothing():
    turn = row_product(row_rotation_x(A), row_rotation_z(G))
    scale, place = np.array([1.0, 2.0, 3.0]), [4.0, 5.0, 6.0]
    world = row_local_to_world(scale, turn, place)
    column = to_column(row_translation(place)) @ to_column(turn) @ to_column(row_scale(scale))
    assert np.abs(to_column(world) - column).max() < 1e-14
    gram = world[:3, :3] @ world[:3, :3].T
    assert np.abs(gram - np.diag(scale**2)).max() < 1e-14
    sheared = (turn @ row_scale(scale))[:3, :3]
    wrong = sheared @ sheared.T
    assert np.abs(wrong - np.diag(np.diag(wrong))).max() > 0.1


def test_to_column_is_its_own_inverse_and_takes_many():
    many = RNG.normal(size=(7, 4, 4))
    assert np.array_equal(to_column(to_column(many)), many)
    assert np.array_equal(to_column(many)[3], many[3].T)


def test_no_matrices_multiply_to_the_identity():
    assert np.array_equal(row_product(), np.eye(4))
