"""The reference vertices are computed in one order, coordinate by coordinate, and nothing else decides them."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.shapes import random_rotations

from cdcore.numerics import EPS, PAD_ULPS, UNDERFLOW_PAD, place_points, readonly


def test_points_are_placed_row_by_row_in_the_declared_order_of_roundings():
    rng = np.random.default_rng(0)
    rotation, translation, points = random_rotations(rng), rng.normal(size=3), rng.normal(size=(50, 3))
    placed = place_points(points, rotation, translation)
    for row, point in zip(placed, points, strict=True):
        for i in range(3):
            x, y, z = (float(value) for value in point)
            r = [float(value) for value in rotation[i]]
            assert row[i] == ((r[0] * x + r[1] * y) + r[2] * z) + float(translation[i])


def test_placing_many_poses_at_once_gives_the_bits_of_one_at_a_time():
    rng = np.random.default_rng(1)
    rotation, translation, points = random_rotations(rng, 20), rng.normal(size=(20, 3)), rng.normal(size=(7, 3))
    many = place_points(points, rotation, translation)
    assert many.shape == (20, 7, 3)
    one = [place_points(points, r, t) for r, t in zip(rotation, translation, strict=True)]
    assert many.tobytes() == np.array(one).tobytes()


coordinates = st.floats(-1e6, 1e6, allow_nan=False)


@given(st.lists(coordinates, min_size=3, max_size=3), st.lists(coordinates, min_size=3, max_size=3), st.integers(0, 99))
def test_placing_errs_by_less_than_the_sphere_pad(point, translation, seed):
    rotation = random_rotations(np.random.default_rng(seed))
    placed = place_points(np.array([point]), rotation, np.array(translation))[0]
    size = math.hypot(*point) + np.abs(translation).max() + UNDERFLOW_PAD
    for i in range(3):
        exact = sum(Fraction(float(rotation[i, k])) * Fraction(point[k]) for k in range(3)) + Fraction(translation[i])
        assert abs(float(Fraction(float(placed[i])) - exact)) <= PAD_ULPS / 4 * EPS * size


def test_a_read_only_array_refuses_to_be_written():
    array = np.zeros(3)
    readonly(array)
    with pytest.raises(ValueError, match="read-only"):
        array[0] = 1.0
