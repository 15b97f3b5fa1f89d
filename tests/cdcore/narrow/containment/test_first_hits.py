"""Crossings of rays and triangles are those of exact arithmetic."""

from fractions import Fraction

import numpy as np
import pytest

from cdcore.narrow.containment.first_hits import crossing


def exact_crossing(triangle, origin, ray):
    """How far along a ray a triangle is crossed, in fractions, by signed volumes; infinite: not."""
    a, b, c, o, d = ([Fraction(float(x)) for x in p] for p in (*triangle, origin, ray))

    def volume(p, q, r):
        return sum(p[i] * (q[(i + 1) % 3] * r[(i + 2) % 3] - q[(i + 2) % 3] * r[(i + 1) % 3]) for i in range(3))

    corners = [[x - y for x, y in zip(p, o, strict=True)] for p in (a, b, c)]
    sides = [volume(d, corners[k], corners[(k + 1) % 3]) for k in range(3)]
    if not (all(s >= 0 for s in sides) or all(s <= 0 for s in sides)) or not sum(sides):
        return np.inf
    along = volume(*corners) / sum(sides)
    return float(along) if along >= 0 else np.inf


def test_a_crossing_is_that_of_exact_arithmetic():
    rng = np.random.default_rng(1)
    triangles = rng.normal(size=(200, 1, 3)) + 0.3 * rng.normal(size=(200, 3, 3))
    for origin, ray in zip(3 * rng.normal(size=(10, 3)), rng.normal(size=(10, 3)), strict=True):
        expected = [exact_crossing(triangle, origin, ray) for triangle in triangles]
        assert crossing(triangles, origin, ray) == pytest.approx(expected, rel=1e-9)


def test_a_ray_in_the_plane_of_a_face_or_away_from_it_meets_nothing():
    face = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    origins = np.array([[-1.0, 0.2, 0], [0.2, 0.2, 1.0], [0.2, 0.2, 1.0]])
    rays = np.array([[1.0, 0, 0], [0.0, 0, 1], [0.0, 0, -1]])
    assert crossing(np.stack([face] * 3), origins, rays).tolist() == [np.inf, np.inf, 1.0]
