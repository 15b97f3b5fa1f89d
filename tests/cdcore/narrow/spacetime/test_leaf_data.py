"""A leaf keeps each distinct corner once."""

import numpy as np
from motions import grid_plate

from cdcore.narrow.spacetime.box_tree import build_box_tree


def test_two_triangles_of_a_square_share_two_of_their_corners():
    tree = build_box_tree(grid_plate(1))
    assert tree.leaves.tolist() == [[0, 2, 0, 4]]
    assert len(tree.corners) == 4
    shared = set(tree.picks[0].tolist()) & set(tree.picks[1].tolist())
    assert len(shared) == 2


def test_a_needle_has_a_plane_that_bounds_it_whatever_its_direction():
    needle = np.array([[[0, 0, 0], [1, 1e-17, 0], [2, 0, 1e-300]]])
    tree = build_box_tree(needle)
    x, y, z, low, high = tree.planes[0, 5:10]
    along = (needle[0] - tree.boxes[0, :3]) @ [x, y, z]
    assert low <= along.min() + 1e-15
    assert high >= along.max() - 1e-15
