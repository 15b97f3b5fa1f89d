"""The fitted box has orthonormal axes, covers its triangles, and is no larger than the body-aligned one."""

import numpy as np
import pytest
from support.motions import rotations

from cdcore.narrow.spacetime.box_tree import build_box_tree


def fitted(triangles):
    box = build_box_tree(triangles).boxes[0]
    axes, middle, half = box[3:12].reshape(3, 3), box[:3], box[12:15]
    return axes, np.stack([axes @ middle - half, axes @ middle + half], axis=1)


def surface(extent):
    x, y, z = extent[:, 1] - extent[:, 0]
    return x * y + y * z + z * x


@pytest.mark.parametrize("seed", range(6))
def test_a_turned_slab_is_fitted_along_its_own_axes(seed):
    rng = np.random.default_rng(seed)
    turn = rotations(rng, ())
    triangles = (rng.uniform(-1, 1, (200, 3, 3)) * [3.0, 1.0, 0.1]) @ turn.T
    axes, extent = fitted(triangles)
    assert np.abs(axes @ axes.T - np.eye(3)).max() < 2e-15
    along = triangles.reshape(-1, 3) @ axes.T
    assert np.allclose(along.min(0), extent[:, 0])
    assert np.allclose(along.max(0), extent[:, 1])
    assert surface(extent) < 1.3 * (6 * 2 + 6 * 0.2 + 2 * 0.2)


@pytest.mark.parametrize("seed", range(6))
def test_the_box_is_never_larger_than_the_one_along_the_body_axes(seed):
    triangles = np.random.default_rng(seed).normal(size=(5, 3, 3))
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    assert surface(fitted(triangles)[1]) <= surface(np.stack([low, high], axis=1)) * (1 + 1e-14)


@pytest.mark.parametrize("triangles", [np.zeros((3, 3, 3)), np.full((1, 3, 3), 1e-200), np.ones((2, 3, 3)) * 1e70])
def test_points_give_a_box_of_no_extent_and_no_nan(triangles):
    axes, extent = fitted(triangles)
    assert np.isfinite(axes).all()
    assert np.isfinite(extent).all()
    assert np.abs(axes @ axes.T - np.eye(3)).max() < 2e-15
