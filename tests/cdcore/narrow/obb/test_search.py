"""The compiled search counts and finds what a plain recursive one does, complete, first hit, or cut short."""

import pytest
from slow_trees import SCENES, SlowSearch, assert_as_slow, boxes_apart, poses_of

from cdcore.narrow.obb.search import ObbSearch


class SlowObb(SlowSearch):
    def __init__(self, trees, *poses, **wanted):
        super().__init__(trees[0].corners, trees[1].corners, *poses, **wanted)
        self.trees, self.poses = trees, poses

    def box(self, side, node):
        tree = self.trees[side]
        return tree.centre[node], tree.axes[node], tree.half[node]

    def children(self, side, node):
        first = self.trees[side].child[node]
        return [node] if first < 0 else [first, first + 1]

    def descend(self, a, b):
        def apart():
            return boxes_apart(self.box(0, a), self.poses[0], self.box(1, b), self.poses[1], edges=True)

        if not self.ask_nodes(apart):
            return
        if self.children(0, a) == [a] and self.children(1, b) == [b]:
            for i in range(self.trees[0].start[a], self.trees[0].stop[a]):
                for j in range(self.trees[1].start[b], self.trees[1].stop[b]):
                    self.ask_faces(i, j)
            return
        for first in reversed(self.children(0, a)):
            for second in reversed(self.children(1, b)):
                self.descend(first, second)


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize(("every", "budget"), [(True, None), (False, None), (True, 150), (False, 40), (True, 1)])
def test_counts_and_faces_are_those_of_a_recursive_search(scene, every, budget):
    corners, poses = SCENES[scene]()
    search = ObbSearch(corners)

    def slow(row, **wanted):
        reference = SlowObb(search.trees, *poses_of(poses, row), **wanted)
        reference.run(reference.descend)
        numbers = [tree.number for tree in search.trees]
        reference.found = [(int(numbers[0][a]), int(numbers[1][b])) for a, b in reference.found]
        return reference

    hits = assert_as_slow(search, slow, poses, every=every, budget=budget)
    assert hits or budget
