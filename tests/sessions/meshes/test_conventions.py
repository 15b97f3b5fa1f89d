import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sessions.errors import SessionError
from sessions.meshes.conventions import CONVENTIONS, convention, quaternion_from_euler

TABLE = {
    "unity": ((1, 2, -3), (-1, -2, 3, 4), "left"),
    "openvr": ((1, 2, 3), (1, 2, 3, 4), "right"),
    "openxr": ((1, 2, 3), (1, 2, 3, 4), "right"),
    "gltf": ((1, 2, 3), (1, 2, 3, 4), "right"),
    "ros": ((-2, 3, -1), (-2, 3, -1, 4), "right"),
    "z-up": ((1, 3, -2), (1, 3, -2, 4), "right"),
}
"""Point (1, 2, 3) and quaternion (1, 2, 3, 4) of each source in the canonical frame, written out by hand."""


def test_every_convention_is_in_the_table():
    assert set(TABLE) == set(CONVENTIONS)


@pytest.mark.parametrize("name", CONVENTIONS)
def test_points_and_quaternions_are_those_of_the_table(name):
    point, quaternion, side = TABLE[name]
    assert CONVENTIONS[name].points([1, 2, 3]).tolist() == list(point)
    assert CONVENTIONS[name].quaternions([1, 2, 3, 4]).tolist() == list(quaternion)
    assert CONVENTIONS[name].handedness == side


@pytest.mark.parametrize("name", CONVENTIONS)
def test_turning_before_or_after_the_change_of_axes_is_the_same(name):
    row = CONVENTIONS[name]
    turns = Rotation.random(100, random_state=2)
    points = np.random.default_rng(3).normal(size=(100, 3))
    assert np.allclose(
        row.points(turns.apply(points)), Rotation.from_quat(row.quaternions(turns.as_quat())).apply(row.points(points))
    )


ORDERS = [a + b + c for axes in ("XYZ", "xyz") for a, b, c in itertools.product(axes, repeat=3) if a != b and b != c]


def test_there_are_twelve_orders_about_own_and_twelve_about_fixed_axes():
    assert len(ORDERS) == 24


@given(st.sampled_from(ORDERS), st.lists(st.floats(-7, 7), min_size=3, max_size=3))
def test_euler_angles_are_read_as_scipy_reads_them(order, angles):
    got = Rotation.from_quat(quaternion_from_euler(angles, order)).as_matrix()
    assert np.allclose(got, Rotation.from_euler(order, angles).as_matrix(), atol=1e-13)


@pytest.mark.parametrize("order", ["", "xy", "xyw", "xYz", "xyzx", "xxy", "ZYY"])
def test_an_order_that_is_none_is_refused(order):
    with pytest.raises(SessionError, match="no Euler order"):
        quaternion_from_euler([0, 0, 0], order)


def test_an_unknown_convention_names_those_there_are():
    with pytest.raises(SessionError, match="no convention 'unreal'; there are: unity"):
        convention("unreal")
