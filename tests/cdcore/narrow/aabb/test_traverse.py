"""World boxes hold their faces in every pose and nothing more; touching boxes are not apart."""

import numpy as np
from shapes import ball_mesh, random_rotations

from cdcore.narrow.aabb.search import build_world_box_tree
from cdcore.narrow.aabb.traverse import place_and_fit, search_rows
from cdcore.narrow.exact_sums import new_digits
from cdcore.numerics import place_points


def fitted(tree, turn, move):
    world, boxes = np.empty(tree.corners.shape), np.empty((len(tree.child), 6))
    place_and_fit(tree.corners, turn, move, tree.child, tree.leaf, world, boxes)
    return world, boxes


def test_the_root_box_is_the_box_of_all_points_that_count():
    corners = ball_mesh(1.0, 6, 9).triangles
    rng = np.random.default_rng(3)
    turn, move = random_rotations(rng), rng.normal(size=3)
    world, boxes = fitted(build_world_box_tree(corners), turn, move)
    points = place_points(corners.reshape(-1, 3), turn, move)
    assert np.array_equal(world.reshape(-1, 3), points)
    assert np.array_equal(boxes[0], [*points.min(axis=0), *points.max(axis=0)])


def test_every_box_is_the_least_box_of_its_children():
    tree = build_world_box_tree(ball_mesh(1.0, 5, 7).triangles)
    _, boxes = fitted(tree, np.eye(3), np.zeros(3))
    for node in np.flatnonzero(tree.child >= 0):
        pair = boxes[tree.child[node] : tree.child[node] + 2]
        assert np.array_equal(boxes[node], [*pair[:, :3].min(axis=0), *pair[:, 3:].max(axis=0)])


def test_faces_whose_boxes_only_touch_are_still_asked_and_meet():
    floor = build_world_box_tree(np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]]))
    counts, truncated = np.zeros((1, 3), dtype=np.int64), np.zeros(1, dtype=np.uint8)
    up, here, there = np.eye(3)[None], np.zeros((1, 3)), np.array([[1.0, 0, 0]])
    stack = np.empty((4, 2), dtype=np.int64)
    found = search_rows(
        floor.corners, floor.child, floor.leaf, floor.corners, floor.child, floor.leaf, stack, up, here, up, there,
        True, 100, new_digits(), counts, truncated,
    )  # fmt: skip
    assert found.tolist() == [[0, 0, 0, 1]]
    assert counts.tolist() == [[1, 1, 2]]
