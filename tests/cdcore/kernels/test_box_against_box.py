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
"""Of the eight corners of a box."""
NEARLY = 1e-9
"""Metres by which a pad is above or below a gap."""


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
    """A hundred pairs of random boxes: the gap along the six face normals, and along all 15 axes, by projected corners.

    Box B has the axes ``m`` and the centre ``d`` as seen from A. A pad a nanometre (NEARLY) below the gap leaves the
    boxes separated, one above does not.
    """
    rng = np.random.default_rng(seed)
    separated_by_edges_only = overlapping = 0
    for _ in range(100):
        m, d, half_a, half_b = two_boxes(rng)
        faces = np.concatenate([np.eye(3), m.T])
        edges = np.cross(np.repeat(np.eye(3), 3, axis=0), np.tile(m.T, (3, 1)))
        gap, gap_of_edges = (gaps_along(axes, m, d, half_a, half_b).max() for axes in (faces, edges))
        assert gap_on_face_axes(m, d, half_a, half_b) == pytest.approx(gap)
        assert separated_on_face_axes(m, d, half_a, half_b, gap - NEARLY)
        assert not separated_on_face_axes(m, d, half_a, half_b, gap + NEARLY)
        assert separated_on_all_axes(m, d, half_a, half_b, 0.0) == (max(gap, gap_of_edges) > 0.0)
        separated_by_edges_only += gap_of_edges > 0.0 > gap
        overlapping += max(gap, gap_of_edges) < 0.0
    assert separated_by_edges_only > 0
    assert overlapping > 0


def test_edges_separate_by_more_than_the_pad():
    """Two cubes of 1 m along (1, 1, 0), 1/8 m apart: an edge of A along z faces an edge of B along (1, -1, 0).

    Only the cross product of both edges separates them. An edge is sqrt(1/2) m from the centre of its cube.
    """
    root, half, gap = np.sqrt(0.5), np.array([0.5, 0.5, 0.5]), 0.125
    m = np.array([[root, -0.5, -0.5], [-root, -0.5, -0.5], [0.0, root, -root]])  # columns: the axes of B
    d = np.array([1.0, 1.0, 0.0]) * root * (root + root + gap)
    assert not separated_on_face_axes(m, d, half, half, 0.0)
    assert separated_on_all_axes(m, d, half, half, gap - NEARLY)
    assert not separated_on_all_axes(m, d, half, half, gap + NEARLY)


def test_relative_box_is_that_of_matrix_products():
    """Axes ``m`` and centre ``d`` of box b as seen from box a, each given in its own body; a random pose of body b in
    a's.
    """
    rng = np.random.default_rng(5)
    axes_a, axes_b, rotation = random_rotations(rng, 3)
    centre_a, centre_b, move = rng.normal(size=(3, 3))
    m, d = np.empty((3, 3)), np.empty(3)
    relative_box(centre_a, axes_a, centre_b, axes_b, rotation, move, m, d)
    assert np.allclose(m, axes_a @ rotation @ axes_b.T)
    assert np.allclose(d, axes_a @ (rotation @ centre_b + move - centre_a))
