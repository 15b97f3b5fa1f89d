"""The two tables of conventions, one in components and one in matrices, were written apart and say the same."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from shapes import random_rotations

from cdcore.transforms import conventions as matrix_form

component_form = pytest.importorskip("sessions.conventions", reason="the sessions' own conversions are not there")

RNG = np.random.default_rng(0)
POINTS, QUATERNIONS = RNG.normal(size=(500, 3)), Rotation.from_matrix(random_rotations(RNG, 500)).as_quat()


def test_both_tables_name_the_same_conventions():
    assert set(component_form.CONVENTIONS) == set(matrix_form.CONVENTIONS)


@pytest.mark.parametrize("name", matrix_form.CONVENTIONS)
def test_points_and_rotations_agree(name):
    one, other = component_form.CONVENTIONS[name], matrix_form.CONVENTIONS[name]
    assert np.array_equal(one.points(POINTS), other.points(POINTS))
    turned = Rotation.from_quat(one.quaternions(QUATERNIONS)).as_matrix()
    assert np.abs(turned - other.rotations(Rotation.from_quat(QUATERNIONS).as_matrix())).max() < 1e-14
    assert (one.handedness == "left") == other.mirrors
