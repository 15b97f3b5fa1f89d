"""Matrices and quaternions mean the same rotation."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cdcore.transforms.rigid import rotation_from_quaternion
from replay.rerun_log.quaternions import quaternions_xyzw

unit = arrays(np.float64, (4,), elements=st.floats(-1, 1)).filter(lambda q: np.linalg.norm(q) > 0.1)


@given(unit)
def test_a_rotation_survives_the_way_there_and_back(q: np.ndarray) -> None:
    matrix = rotation_from_quaternion(q[None])
    assert np.allclose(rotation_from_quaternion(quaternions_xyzw(matrix)), matrix, atol=4e-16 * 8, rtol=0)


def test_half_turns_are_exact() -> None:
    for axis in range(3):
        matrix = -np.eye(3)
        matrix[axis, axis] = 1.0
        expected = np.zeros(4)
        expected[axis] = 1.0
        assert np.abs(quaternions_xyzw(matrix[None])[0]).tolist() == expected.tolist()


def test_no_rotation_is_no_row() -> None:
    assert quaternions_xyzw(np.zeros((0, 3, 3))).shape == (0, 4)
