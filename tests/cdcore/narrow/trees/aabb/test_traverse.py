"""World boxes hold their faces in every pose and nothing more."""

import numpy as np
from support.shapes import ball_mesh, random_rotations

from cdcore.narrow.trees.aabb.traverse import build_world_box_tree, place_and_fit
from cdcore.numerics import place_points


def test_the_root_box_is_the_box_of_all_placed_points_and_every_box_the_least_one_of_its_children():
    rng = np.random.default_rng(3)
    tree, _ = build_world_box_tree(ball_mesh(1.0, 6, 9).triangles)
    world, boxes = np.empty(tree.corners.shape), np.empty((len(tree.child), 6))
    turn, move = random_rotations(rng), rng.normal(size=3)
    place_and_fit(tree, turn, move, world, boxes)
    points = place_points(tree.corners.reshape(-1, 3), turn, move)
    assert np.array_equal(world.reshape(-1, 3), points)
    assert np.array_equal(boxes[0], [*points.min(axis=0), *points.max(axis=0)])
    for node in np.flatnonzero(tree.child >= 0):
        pair = boxes[tree.child[node] : tree.child[node] + 2]
        assert np.array_equal(boxes[node], [*pair[:, :3].min(axis=0), *pair[:, 3:].max(axis=0)])
