"""Distances to triangles: kernels against their slow references and against closed forms."""

import numpy as np
import pytest

from cdcore.narrow.surface_distance import (
    distance_to_triangles,
    distance_to_triangles_slowly,
    largest_distance,
    nearest_triangles,
    nearest_triangles_slowly,
)


def triangles_of(seed, count=200):
    """Random triangles, needles and points of triangles among them."""
    rng = np.random.default_rng(seed)
    triangles = rng.normal(size=(count, 3, 3)) * rng.uniform(0.01, 2.0, (count, 1, 1))
    triangles[::7, 2] = triangles[::7, 0] + 1e-9 * rng.normal(size=triangles[::7, 0].shape)
    triangles[::11] = triangles[::11, :1]
    return triangles


def balls_of(triangles):
    """Middles and radii of balls about triangles."""
    middles = triangles.mean(axis=1)
    return middles, np.linalg.norm(triangles - middles[:, None], axis=2).max(axis=1)


@pytest.mark.parametrize("seed", range(4))
def test_distances_to_triangles_agree_with_a_slow_reference(seed):
    """A random point beside each random triangle."""
    triangles = triangles_of(seed)
    points = np.random.default_rng(seed + 100).normal(size=(len(triangles), 3))
    distance, closest = distance_to_triangles(points, triangles)
    slow_distance, slow_closest = distance_to_triangles_slowly(points, triangles)
    assert distance == pytest.approx(slow_distance, rel=1e-9, abs=1e-12)
    assert closest == pytest.approx(slow_closest, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_nearest_triangle_is_that_of_the_slow_reference(seed):
    """64 points beside random triangles: by a slow search, and by the least distance to any triangle."""
    triangles = triangles_of(seed)
    points = np.random.default_rng(seed + 200).normal(size=(64, 3))
    distance, nearest = nearest_triangles(points, triangles, *balls_of(triangles))
    slow_distance, _ = nearest_triangles_slowly(points, triangles, *balls_of(triangles))
    assert distance == pytest.approx(slow_distance, rel=1e-9, abs=1e-12)
    assert distance_to_triangles(points, triangles[nearest])[0] == pytest.approx(distance, rel=1e-12)
    every = [distance_to_triangles(np.tile(point, (len(triangles), 1)), triangles)[0].min() for point in points]
    assert distance == pytest.approx(np.array(every), rel=1e-12)


@pytest.mark.parametrize("size", [0.01, 0.3, 3.0])
@pytest.mark.parametrize("seed", range(4))
def test_nearest_of_few_points_in_a_small_region(seed, size):
    """Most triangles are left out there before any distance is computed."""
    triangles, rng = triangles_of(seed), np.random.default_rng(seed + 300)
    points = rng.normal(size=3) + size * rng.normal(size=(20, 3))
    distance, _ = nearest_triangles(points, triangles, *balls_of(triangles))
    slow_distance, _ = nearest_triangles_slowly(points, triangles, *balls_of(triangles))
    assert distance == pytest.approx(slow_distance, rel=1e-9, abs=1e-12)
    assert largest_distance(points, triangles, *balls_of(triangles)) == pytest.approx(slow_distance.max(), rel=1e-9)


def test_distances_have_their_closed_form_beside_above_and_at_corners():
    """Legs of 4 and 3: (4, 3) is 2.4 from the hypotenuse, (-3, -4) is 5 from a corner."""
    triangle = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]])
    points = np.array([[1.0, 1.0, 2.0], [2.0, -1.0, 0.0], [-3.0, -4.0, 0.0], [4.0, 3.0, 0.0], [1.0, 1.0, 0.0]])
    distance, closest = distance_to_triangles(points, np.tile(triangle, (5, 1, 1)))
    assert distance == pytest.approx([2.0, 1.0, 5.0, 2.4, 0.0])
    assert closest[:3] == pytest.approx(np.array([[1, 1, 0], [2, 0, 0], [0, 0, 0]]))


def test_largest_distance_is_at_least_its_lower_bound():
    """The last argument is a distance known beforehand; where it exceeds the true maximum it is returned itself."""
    triangles = triangles_of(seed=0)
    points = np.random.default_rng(5).normal(size=(20, 3))
    alone = largest_distance(points, triangles, *balls_of(triangles))
    assert largest_distance(points, triangles, *balls_of(triangles), 0.5 * alone) == alone
    assert largest_distance(points, triangles, *balls_of(triangles), 2.0 * alone) == 2.0 * alone


def test_of_triangles_equally_near_the_first_is_named():
    """Two triangles with a common edge, and a point beyond it that is asked after one nearest to the second."""
    triangles = np.array([[[0, 0, 0], [1, 0, 0], [0, -1, 0]], [[0, 0, 0], [1, 0, 0], [0, 0, -1.0]]])
    points = np.array([[0.3, 0.1, -0.5], [0.3, 1.0, 1.0]])
    distance, nearest = nearest_triangles(points, triangles, *balls_of(triangles))
    assert nearest.tolist() == [1, 0]
    assert distance == pytest.approx([0.1, np.sqrt(2.0)])


@pytest.mark.parametrize("nearest_of", [nearest_triangles, nearest_triangles_slowly])
def test_outlier_among_points_has_its_own_nearest_triangle(nearest_of):
    """Tiny triangles at x = 1 and -6, 31 points beside the first; the last is 4 m from that one, 3 m from the other."""
    triangles = np.array([[1.0, 0.0, 0.0], [-6.0, 0.0, 0.0]])[:, None] + 1e-9 * np.eye(3)
    points = np.array([[1.0, 0.0, 0.0]] * 31 + [[-3.0, 0.0, 0.0]])
    distance, nearest = nearest_of(points, triangles, *balls_of(triangles))
    assert nearest.tolist() == [0] * 31 + [1]
    assert distance == pytest.approx([0.0] * 31 + [3.0], abs=1e-8)
