"""Each of the fifteen axes separates a pair of boxes that no other separates, and the pad moves the line."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cdcore.broad.box_kernels import frame_of_box
from cdcore.kernels.box_axes import apart_on_all_axes
from cdcore.kernels.compiling import kernel


@kernel
def boxes_apart(m, d, half_a, half_b, pad):
    return apart_on_all_axes(m, d, half_a, half_b, pad)


@kernel
def framed(rotation, axes, out):
    frame_of_box(rotation, axes, out)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1, 1])
def test_face_axes_separate_at_the_sum_of_half_extents(axis, sign):
    half_a, half_b = np.array([1.0, 2.0, 3.0]), np.array([0.5, 0.25, 0.125])
    touching = np.zeros(3)
    touching[axis] = sign * (half_a[axis] + half_b[axis])
    assert not boxes_apart(np.eye(3), touching, half_a, half_b, 0.0)
    assert boxes_apart(np.eye(3), touching * (1 + 1e-9), half_a, half_b, 0.0)
    assert not boxes_apart(np.eye(3), touching * (1 + 1e-9), half_a, half_b, 1e-6)


def test_crossed_edges_are_separated_by_no_face_axis():
    # Two long thin boxes, crossed and lifted along the normal of both edges, which is no face axis of either.
    turn = Rotation.from_euler("xyz", [0.6, 0.7, 0.8]).as_matrix()
    half = np.array([1.0, 0.01, 0.01])
    normal = np.cross([1.0, 0, 0], turn[:, 0])
    normal /= np.linalg.norm(normal)
    reach = sum(abs(normal[k]) * half[k] for k in range(3)) + sum(abs(turn[:, k] @ normal) * half[k] for k in range(3))
    assert not boxes_apart(turn, normal * reach * 0.999, half, half, 0.0)
    assert boxes_apart(turn, normal * reach * 1.001, half, half, 0.0)
    offset = normal * reach * 1.001
    face_gap = [abs(offset[i]) - half[i] - np.abs(turn[i]) @ half for i in range(3)]
    face_gap += [abs(offset @ turn[:, j]) - half[j] - np.abs(turn[:, j]) @ half for j in range(3)]
    assert max(face_gap) < 0


def test_the_frame_of_a_box_is_the_product():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 3, 3))
    out = np.empty((3, 3))
    framed(a, b, out)
    assert np.allclose(out, a @ b, rtol=1e-14)
