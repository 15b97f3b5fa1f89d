"""Gaps of two boxes along separating axes, beside projections of all their corners in the frame of the first."""

import itertools

import numpy as np
import pytest
from support.shapes import random_rotations

from cdcore.kernels.box_against_box import (
    gap_on_face_axes,
    relative_box,
    separated_on_all_axes,
    separated_on_face_axes,
)

SIGNS = np.array(list(itertools.product([-1.0, 1.0], repeat=3)))


def two_boxes(rng):
    """Axes of B in columns and its centre, as seen in the axes of A, and the half edges of both."""
    return random_rotations(rng), rng.normal(scale=1.1, size=3), rng.uniform(0.1, 1.0, 3), rng.uniform(0.1, 1.0, 3)


def gaps_along(axes, m, d, half_a, half_b):
    """How far the corners of B begin behind those of A along each axis (n, 3) of any length, over that length."""
    first, second = (SIGNS * half_a) @ axes.T, (SIGNS * half_b) @ m.T @ axes.T + d @ axes.T
    gaps = np.maximum(second.min(axis=0) - first.max(axis=0), first.min(axis=0) - second.max(axis=0))
    return gaps / np.linalg.norm(axes, axis=1)


@pytest.mark.parametrize("seed", range(4))
def test_separating_axes_agree_with_projected_corners(seed):
    """A hundred pairs of random boxes; a ``pad`` just above their gap makes them no longer separate."""
    rng = np.random.default_rng(seed)
    only_by_edges = meeting = 0
    for _ in range(100):
        m, d, half_a, half_b = two_boxes(rng)
        faces = np.concatenate([np.eye(3), m.T])
        edges = np.cross(np.repeat(np.eye(3), 3, axis=0), np.tile(m.T, (3, 1)))
        gap, gap_of_edges = gaps_along(faces, m, d, half_a, half_b).max(), gaps_along(edges, m, d, half_a, half_b).max()
        assert gap_on_face_axes(m, d, half_a, half_b) == pytest.approx(gap)
        for pad, is_separated in ((gap - 1e-9, True), (gap + 1e-9, False)):
            assert separated_on_face_axes(m, d, half_a, half_b, pad) == is_separated
        assert separated_on_all_axes(m, d, half_a, half_b, 0.0) == (max(gap, gap_of_edges) > 0.0)
        only_by_edges += gap_of_edges > 0.0 > gap
        meeting += max(gap, gap_of_edges) < 0.0
    assert only_by_edges > 0 < meeting


def test_edges_separate_by_more_than_the_pad():
    """Two unit cubes along (1, 1, 0): an edge of A along z is next to an edge of B along (1, -1, 0)."""
    root, half, gap = np.sqrt(0.5), np.array([0.5, 0.5, 0.5]), 0.125
    # columns: the axes of B; both edges are sqrt(1/2) from the centres of their cubes
    m = np.array([[root, -0.5, -0.5], [-root, -0.5, -0.5], [0.0, root, -root]])
    d = np.array([1.0, 1.0, 0.0]) * root * (root + root + gap)
    assert not separated_on_face_axes(m, d, half, half, 0.0)
    assert separated_on_all_axes(m, d, half, half, gap - 1e-9)
    assert not separated_on_all_axes(m, d, half, half, gap + 1e-9)


def test_relative_box_is_that_of_matrix_products():
    """Axes ``m`` and centre ``d`` of box b as seen from box a, each known in its own body, by products of NumPy."""
    rng = np.random.default_rng(5)
    axes_a, axes_b, rotation = random_rotations(rng, 3)
    centre_a, centre_b, move = rng.normal(size=(3, 3))
    m, d = np.empty((3, 3)), np.empty(3)
    relative_box(centre_a, axes_a, centre_b, axes_b, rotation, move, m, d)
    assert np.allclose(m, axes_a @ rotation @ axes_b.T)
    assert np.allclose(d, axes_a @ (rotation @ centre_b + move - centre_a))
