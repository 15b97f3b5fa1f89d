import numpy as np
import pytest
from support.shapes import box_mesh, shift_mesh

from replay.cutting.surface_distance import Surface, farthest_within, refined_triangles


@pytest.mark.parametrize(
    ("edges", "middle", "depth"),
    [
        pytest.param((0.5, 0.3, 0.4), (0.15, -0.05, 0.1), 0.5, id="region with the middle of the cube"),
        pytest.param((0.2, 0.1, 0.3), (0.3, 0.05, -0.1), 0.3, id="region from 0.2 to 0.4 m along x"),
        pytest.param((0.2, 0.1, 0.3), (-0.3, 0.05, -0.1), 0.3, id="region from -0.4 to -0.2 m along x"),
    ],
)
@pytest.mark.parametrize("fraction_known", [0.0, 0.99])
def test_deepest_point_of_a_region_is_returned(edges, middle, depth, fraction_known):
    """In a cube of 1 m about the origin a point is 0.5 m deep, less the largest of its coordinates; to 0.2 %.

    ``fraction_known``: the search is told that so much of the depth is known.
    """
    surface = Surface(box_mesh((1.0, 1.0, 1.0)).triangles)
    region = shift_mesh(box_mesh(edges), middle).triangles
    assert farthest_within(region, surface, fraction_known * depth) == pytest.approx(depth, rel=0.002)


def test_known_distance_is_returned_if_a_region_is_nowhere_deeper():
    """The search in a cube of 1 m begins with 0.6 m, and no point of it is deeper than 0.5 m."""
    surface = Surface(box_mesh((1.0, 1.0, 1.0)).triangles)
    region = box_mesh((0.5, 0.3, 0.4)).triangles
    assert farthest_within(region, surface, least_distance=0.6) == 0.6


def test_triangles_are_halved_at_their_longest_edge():
    """Legs of 1 m; three halvings make the longest edges 1.41, 1, 0.71 and 0.5 m long, and eight like triangles.

    They have edges of 0.35, 0.35 and 0.5 m, the area of the whole, and lie within it (x + y <= 1).
    """
    whole = np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])
    triangles = refined_triangles(whole, longest=0.51)
    edges = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2)
    assert np.sort(edges, axis=1) == pytest.approx(np.tile(np.sqrt([0.125, 0.125, 0.25]), (8, 1)))
    a, b, c = triangles.transpose(1, 0, 2)
    areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    assert areas.sum() == pytest.approx(0.5)
    assert triangles.min() >= 0.0 and triangles.sum(axis=2).max() <= 1.0 + 1e-12
