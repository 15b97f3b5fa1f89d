"""The compiled search counts and finds what a plain recursive one does, complete, first hit, or cut short."""

import numpy as np
import pytest
from slow_trees import SCENES, SlowSearch, assert_as_slow, poses_of

from cdcore.narrow.aabb.search import AabbSearch, build_world_box_tree


class SlowAabb(SlowSearch):
    def __init__(self, trees, *poses, **wanted):
        super().__init__(trees[0].corners, trees[1].corners, *poses, **wanted)
        self.tree_a, self.tree_b = trees
        self.boxes = {}

    def box(self, tree, world, node):
        key = id(tree), int(node)
        if key not in self.boxes:
            self.boxes[key] = self.fitted(tree, world, node)
        return self.boxes[key]

    def fitted(self, tree, world, node):
        if tree.child[node] < 0:
            return world[tree.leaf[node]].min(axis=0), world[tree.leaf[node]].max(axis=0)
        (low, high), (other_low, other_high) = (self.box(tree, world, tree.child[node] + k) for k in (0, 1))
        return np.minimum(low, other_low), np.maximum(high, other_high)

    def descend(self, a, b):
        low_a, high_a = self.box(self.tree_a, self.world_a, a)
        low_b, high_b = self.box(self.tree_b, self.world_b, b)
        if not self.ask_nodes(lambda: (low_a > high_b).any() or (low_b > high_a).any()):
            return
        first_a, first_b = self.tree_a.child[a], self.tree_b.child[b]
        if first_a < 0 and first_b < 0:
            self.ask_faces(int(self.tree_a.leaf[a]), int(self.tree_b.leaf[b]))
        elif first_b < 0 or (first_a >= 0 and (high_a - low_a).max() >= (high_b - low_b).max()):
            self.descend(first_a, b)
            self.descend(first_a + 1, b)
        else:
            self.descend(a, first_b)
            self.descend(a, first_b + 1)


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize(("every", "budget"), [(True, None), (False, None), (True, 150), (False, 40), (True, 1)])
def test_counts_and_faces_are_those_of_a_recursive_search(scene, every, budget):
    corners, poses = SCENES[scene]()
    search = AabbSearch(corners)

    def slow(row, **wanted):
        reference = SlowAabb(search.trees, *poses_of(poses, row), **wanted)
        return reference.run(reference.descend)

    hits = assert_as_slow(search, slow, poses, every=every, budget=budget)
    assert hits or budget


def test_every_face_has_one_leaf_and_leaves_are_no_deeper_than_the_tree_says():
    corners, _ = SCENES["rod and ball"]()
    tree = build_world_box_tree(corners[0])
    leaves = np.flatnonzero(tree.child < 0)
    assert sorted(tree.leaf[leaves].tolist()) == list(range(len(corners[0])))
    assert 2 ** (tree.depth - 1) >= len(corners[0])


def test_a_body_that_stands_still_is_fitted_once():
    corners, poses = SCENES["rod and ball"]()
    poses.turn_b[:], poses.move_b[:] = poses.turn_b[0], poses.move_b[0]
    search = AabbSearch(corners)
    fitted = search.search(0, 1, poses, every=True, budget=1).counts[:, 2]
    sizes = [len(tree.child) for tree in search.trees]
    assert fitted.tolist() == [sum(sizes)] + [sizes[0]] * (len(poses.pad) - 1)
