"""Points in another body's frame agree with matrix products; the margin for rounding grows with both bodies' places."""

import numpy as np
import pytest
from support.shapes import random_rotations

from cdcore.containment.placed_points import margin_at, margin_of, point_in_outer

TRANSLATIONS = np.array([[[9.0, 9.0, 9.0]] * 3, [[1.0, -2.0, 3.0], [9.0, 9.0, 9.0], [-4.0, 5.0, -6.0]]])
"""Of three bodies in two frames; below, body 0 is inside body 2 in frame 1."""


def test_margin_is_a_fixed_fraction_of_both_sizes_and_distances():
    """1024 eps of the size and of the coordinates of both bodies, here (1, 2, 3) and (4, 5, 6)."""
    frame, inner, outer, size = 1, 0, 2, 0.5
    expected = 1024 * np.finfo(float).eps * (size + (1 + 2 + 3) + (4 + 5 + 6))
    assert margin_at(TRANSLATIONS, frame, inner, outer, size) == pytest.approx(expected, rel=1e-15)
    assert margin_of(TRANSLATIONS[frame], inner, outer, size) == pytest.approx(expected, rel=1e-15)


def test_point_in_the_outer_frame_is_that_of_matrix_products():
    """Point 3 of body 0 in the axes of body 2, in frame 1."""
    rng = np.random.default_rng(0)
    rotations, points = random_rotations(rng, 2, 3), rng.normal(size=(4, 3))
    (inner, _, outer), (inner_position, _, outer_position) = rotations[1], TRANSLATIONS[1]
    expected = outer.T @ (inner @ points[3] + inner_position - outer_position)
    frame, inner_body, outer_body, point = 1, 0, 2, 3
    placed = point_in_outer(rotations, TRANSLATIONS, frame, inner_body, outer_body, points, point)
    assert placed == pytest.approx(expected)
