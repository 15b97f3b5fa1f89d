"""The triangles of least total area, against all triangulations of a small outline."""

import numpy as np

from sessions.meshes.least_area import least_area_triangles


def every_triangulation(first, last):
    """Yields all lists of triangles between corners ``first`` and ``last`` of an outline, which an edge joins."""
    if last - first < 2:
        yield []
    for middle in range(first + 1, last):
        for before in every_triangulation(first, middle):
            for after in every_triangulation(middle, last):
                yield [*before, (first, middle, last), *after]


def total_area(points, triangles):
    """The sum of the areas of triangles (corner numbers) of points (n, 2)."""
    corners = points[np.array(triangles)]
    return np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum() / 2


def test_triangles_of_an_outline_have_the_least_area_of_all():
    """The total area is the least of all 42 triangulations (Catalan's number) of an outline of seven random points.

    Most of the five outlines cross themselves. ``flat``: no triangle counts as flat.
    """
    for seed in range(5):
        points = np.random.default_rng(seed).uniform(-1.0, 1.0, (7, 2))
        areas = [total_area(points, triangles) for triangles in every_triangulation(0, 6)]
        assert len(areas) == 42, seed
        assert np.isclose(total_area(points, least_area_triangles(points, flat=0.0)), min(areas)), seed
