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
    """A random point beside each of 200 random triangles: its distance, and the point of the triangle closest to it."""
    triangles = triangles_of(seed)
    points = np.random.default_rng(seed + 100).normal(size=(len(triangles), 3))
    distance, closest = distance_to_triangles(points, triangles)
    slow_distance, slow_closest = distance_to_triangles_slowly(points, triangles)
    assert distance == pytest.approx(slow_distance, rel=1e-9, abs=1e-12)
    assert closest == pytest.approx(slow_closest, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_nearest_triangle_is_that_of_the_slow_reference(seed):
    """64 points beside 200 random triangles: their distance is that of a slow search, and the least of all triangles.

    It is the distance from the triangle that is named.
    """
    triangles = triangles_of(seed)
    points = np.random.default_rng(seed + 200).normal(size=(64, 3))
    distance, nearest = nearest_triangles(points, triangles, *balls_of(triangles))
    slow_distance, _slow_nearest = nearest_triangles_slowly(points, triangles, *balls_of(triangles))
    assert distance == pytest.approx(slow_distance, rel=1e-9, abs=1e-12)
    distance_of_nearest, _closest = distance_to_triangles(points, triangles[nearest])
    assert distance_of_nearest == pytest.approx(distance, rel=1e-12, abs=0)
    for point, least in zip(points, distance, strict=True):
        distances, _closest = distance_to_triangles(np.tile(point, (len(triangles), 1)), triangles)
        assert least == pytest.approx(distances.min(), rel=1e-12, abs=0)


@pytest.mark.parametrize("size", [0.01, 0.3, 3.0], ids="{} m".format)
@pytest.mark.parametrize("seed", range(4))
def test_nearest_of_few_points_in_a_small_region(seed, size):
    """20 points in a region of this size beside 200 random triangles, most of which are left out before a distance is
    computed: distances, and the largest of them, are those of a slow search.
    """
    triangles, rng = triangles_of(seed), np.random.default_rng(seed + 300)
    points = rng.normal(size=3) + size * rng.normal(size=(20, 3))
    distance, _nearest = nearest_triangles(points, triangles, *balls_of(triangles))
    slow_distance, _slow_nearest = nearest_triangles_slowly(points, triangles, *balls_of(triangles))
    assert distance == pytest.approx(slow_distance, rel=1e-9, abs=1e-12)
    assert largest_distance(points, triangles, *balls_of(triangles)) == pytest.approx(
        slow_distance.max(), rel=1e-9, abs=0
    )


@pytest.mark.parametrize(
    ("point", "distance", "closest"),
    [
        pytest.param([1, 1, 2], 2.0, [1, 1, 0], id="above the face"),
        pytest.param([2, -1, 0], 1.0, [2, 0, 0], id="beside a leg"),
        pytest.param([-3, -4, 0], 5.0, [0, 0, 0], id="beyond the right angle"),
        pytest.param([4, 3, 0], 12 / 5, [4 - 36 / 25, 3 - 48 / 25, 0], id="beside the hypotenuse, 5 long"),
        pytest.param([1, 1, 0], 0.0, [1, 1, 0], id="on the face"),
    ],
)
def test_distances_have_their_closed_form_beside_above_and_at_corners(point, distance, closest):
    """A right triangle in z = 0 with legs of 4 and 3 along x and y.

    (4, 3) is as far from the hypotenuse as the right angle is, 4 * 3 / 5, in the direction (3, 4) / 5.
    """
    triangle = np.array([[[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]]])
    distances, closest_points = distance_to_triangles(np.array([point], dtype=float), triangle)
    assert distances == pytest.approx([distance])
    assert closest_points == pytest.approx(np.array([closest]))


def test_largest_distance_is_at_least_its_lower_bound():
    """20 points beside random triangles; a distance known beforehand is returned itself where none is larger."""
    triangles = triangles_of(seed=0)
    points = np.random.default_rng(5).normal(size=(20, 3))
    largest = largest_distance(points, triangles, *balls_of(triangles))
    assert largest_distance(points, triangles, *balls_of(triangles), 0.5 * largest) == largest
    assert largest_distance(points, triangles, *balls_of(triangles), 2.0 * largest) == 2.0 * largest


def test_of_triangles_equally_near_the_first_is_named():
    """Triangles below and behind a common edge, and a point above and before it, root of 2 from the edge.

    It is queried after a point 0.1 m from the second triangle, from which a search may begin.
    """
    below, behind = [[0, 0, 0], [1, 0, 0], [0, -1, 0]], [[0, 0, 0], [1, 0, 0], [0, 0, -1.0]]
    beside_the_second, beyond_the_edge = [0.3, 0.1, -0.5], [0.3, 1.0, 1.0]
    triangles, points = np.array([below, behind]), np.array([beside_the_second, beyond_the_edge])
    distance, nearest = nearest_triangles(points, triangles, *balls_of(triangles))
    assert nearest.tolist() == [1, 0]
    assert distance == pytest.approx([0.1, np.sqrt(2.0)])


@pytest.mark.parametrize("nearest_of", [nearest_triangles, nearest_triangles_slowly], ids=["kernel", "slow reference"])
def test_outlier_among_points_has_its_own_nearest_triangle(nearest_of):
    """Tiny triangles at x = 1 and -6 m; 31 points are at the first, and the last is at -3, 4 m and 3 m from them."""
    triangles = np.array([[1.0, 0.0, 0.0], [-6.0, 0.0, 0.0]])[:, None] + 1e-9 * np.eye(3)
    points = np.array([[1.0, 0.0, 0.0]] * 31 + [[-3.0, 0.0, 0.0]])
    distance, nearest = nearest_of(points, triangles, *balls_of(triangles))
    assert nearest.tolist() == [0] * 31 + [1]
    assert distance == pytest.approx([0.0] * 31 + [3.0], abs=1e-8)
