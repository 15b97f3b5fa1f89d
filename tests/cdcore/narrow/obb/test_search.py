"""The compiled search counts and finds what a plain recursive one does, complete, first hit, or cut short."""

from slow_trees import SlowBoxes, assert_as_slow, complete_first_hit_or_cut_short, each_scene

from cdcore.narrow.obb.search import ObbSearch


class SlowObb(SlowBoxes):
    def children(self, side, node):
        first = self.trees[side].child[node]
        return [node] if first < 0 else [first, first + 1]

    def descend(self, a, b):
        if not self.ask_nodes(a, b):
            return
        if self.children(0, a) == [a] and self.children(1, b) == [b]:
            for i in range(self.trees[0].start[a], self.trees[0].stop[a]):
                for j in range(self.trees[1].start[b], self.trees[1].stop[b]):
                    self.ask_faces(i, j)
            return
        for first in reversed(self.children(0, a)):
            for second in reversed(self.children(1, b)):
                self.descend(first, second)

    def run(self):
        super().run()
        numbers = [tree.number for tree in self.trees]
        self.found = [(int(numbers[0][a]), int(numbers[1][b])) for a, b in self.found]
        return self


@each_scene
@complete_first_hit_or_cut_short
def test_counts_and_faces_are_those_of_a_recursive_search(scene, every, budget):
    assert_as_slow(scene, ObbSearch, SlowObb, every, budget)
