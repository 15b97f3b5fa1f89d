"""The compiled search counts and finds what a plain recursive one does, complete, first contact, or cut short."""

import numpy as np
import pytest
from slow_trees import SCENES, SlowSearch, assert_as_slow, boxes_apart, poses_of

from cdcore.narrow.solid_style.search import SolidSearch


class SlowSolid(SlowSearch):
    def __init__(self, trees, *poses, **wanted):
        super().__init__(trees[0].corners, trees[1].corners, *poses, **wanted)
        self.trees, self.poses = trees, poses

    def box(self, side, node):
        tree = self.trees[side]
        return tree.centre[node], np.eye(3), tree.half[node]

    def descend(self, a, b):
        def apart():
            return boxes_apart(self.box(0, a), self.poses[0], self.box(1, b), self.poses[1], edges=False)

        if not self.ask_nodes(apart):
            return
        first_a, first_b = self.trees[0].child[a], self.trees[1].child[b]
        if first_a < 0 and first_b < 0:
            self.ask_faces(int(self.trees[0].leaf[a]), int(self.trees[1].leaf[b]))
        elif first_b < 0 or (first_a >= 0 and self.trees[0].half[a].max() >= self.trees[1].half[b].max()):
            self.descend(first_a, b)
            self.descend(first_a + 1, b)
        else:
            self.descend(a, first_b)
            self.descend(a, first_b + 1)


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize(("every", "budget"), [(True, None), (False, None), (True, 150), (False, 40), (True, 1)])
def test_counts_and_faces_are_those_of_a_recursive_search(scene, every, budget):
    corners, poses = SCENES[scene]()
    search = SolidSearch(corners)

    def slow(row, **wanted):
        reference = SlowSolid(search.trees, *poses_of(poses, row), **wanted)
        return reference.run(reference.descend)

    hits = assert_as_slow(search, slow, poses, every=every, budget=budget)
    assert hits or budget
