import numpy as np
import pytest
from support.shapes import box_mesh, shift_mesh

from replay.cutting.surface_distance import Surface, farthest_within, refined_triangles


@pytest.mark.parametrize(
    ("sizes", "middle", "depth"),
    [
        ((0.5, 0.3, 0.4), (0.15, -0.05, 0.1), 0.5),  # holds the middle of the cube
        ((0.2, 0.1, 0.3), (0.3, 0.05, -0.1), 0.3),  # from 0.2 to 0.4 along x
        ((0.2, 0.1, 0.3), (-0.3, 0.05, -0.1), 0.3),
    ],
)
def test_deepest_point_of_a_region_is_returned(sizes, middle, depth):
    """In a cube of 1 m about the origin a point is 0.5 m deep, less the largest of its coordinates."""
    surface = Surface(box_mesh((1.0, 1.0, 1.0)).triangles)
    region = shift_mesh(box_mesh(sizes), middle).triangles
    for least_distance in (0.0, 0.99 * depth):
        assert farthest_within(region, surface, least_distance) == pytest.approx(depth, rel=0.002)
    assert farthest_within(region, surface, 0.6) == 0.6


def test_triangles_are_halved_at_their_longest_edge():
    """Legs of 1 m; three halvings make the longest edges 1.41, 1, 0.71 and 0.5 m long, and eight like triangles."""
    pieces = refined_triangles(np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]), longest=0.51)
    edges = np.linalg.norm(pieces - np.roll(pieces, 1, axis=1), axis=2)
    assert np.sort(edges, axis=1) == pytest.approx(np.tile(np.sqrt([0.125, 0.125, 0.25]), (8, 1)))
    areas = 0.5 * np.linalg.norm(np.cross(pieces[:, 1] - pieces[:, 0], pieces[:, 2] - pieces[:, 0]), axis=1)
    assert areas.sum() == pytest.approx(0.5)
    assert pieces.min() >= 0.0 and pieces.sum(axis=2).max() <= 1.0 + 1e-12
