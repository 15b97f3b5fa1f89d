"""The compiled search counts and finds what a plain recursive one does, complete, first hit, or cut short."""

import numpy as np
from slow_trees import SCENES, SlowSearch, assert_as_slow, complete_first_hit_or_cut_short, each_scene

from cdcore.narrow.aabb.search import AabbSearch, build_world_box_tree


class SlowAabb(SlowSearch):
    def __init__(self, trees, *poses, **wanted):
        super().__init__(trees, *poses, **wanted)
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

    def both(self, a, b):
        return self.box(self.trees[0], self.world_a, a), self.box(self.trees[1], self.world_b, b)

    def apart(self, a, b):
        (low_a, high_a), (low_b, high_b) = self.both(a, b)
        return (low_a > high_b).any() or (low_b > high_a).any()

    def splits_first(self, a, b):
        (low_a, high_a), (low_b, high_b) = self.both(a, b)
        return (high_a - low_a).max() >= (high_b - low_b).max()


@each_scene
@complete_first_hit_or_cut_short
def test_counts_and_faces_are_those_of_a_recursive_search(scene, every, budget):
    assert_as_slow(scene, AabbSearch, SlowAabb, every, budget)


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
