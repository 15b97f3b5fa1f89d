"""Points in another body's frame agree with matrix products; the margin for rounding grows with both bodies' places."""

import numpy as np
import pytest
from support.shapes import random_rotations

from cdcore.containment.placed_points import margin_at, margin_of, point_in_outer

TRANSLATIONS = np.array([[[9.0, 9.0, 9.0]] * 3, [[1.0, -2.0, 3.0], [9.0, 9.0, 9.0], [-4.0, 5.0, -6.0]]])
"""Of three bodies in two frames; below, body 0 is inside body 2 in frame 1."""


def test_margin_is_a_fixed_fraction_of_both_sizes_and_distances():
    """1024 eps of the size, 0.5 m, and of the coordinates of both bodies, here (1, -2, 3) and (-4, 5, -6) m."""
    frame, inner, outer, size = 1, 0, 2, 0.5
    expected = 1024 * np.finfo(float).eps * (size + (1 + 2 + 3) + (4 + 5 + 6))
    assert margin_at(TRANSLATIONS, frame, inner, outer, size) == pytest.approx(expected, rel=1e-15, abs=0)
    assert margin_of(TRANSLATIONS[frame], inner, outer, size) == pytest.approx(expected, rel=1e-15, abs=0)


def test_point_in_the_outer_frame_is_that_of_matrix_products():
    """Point 3 of body 0, placed in the world and seen from the axes of body 2, in frame 1 of two."""
    rng = np.random.default_rng(0)
    rotations, points = random_rotations(rng, 2, 3), rng.normal(size=(4, 3))
    frame, inner, outer, point = 1, 0, 2, 3
    in_world = rotations[frame, inner] @ points[point] + TRANSLATIONS[frame, inner]
    expected = rotations[frame, outer].T @ (in_world - TRANSLATIONS[frame, outer])
    placed = point_in_outer(rotations, TRANSLATIONS, frame, inner, outer, points, point)
    assert placed == pytest.approx(expected)
