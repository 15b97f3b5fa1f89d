"""The compiled search counts and finds what a plain recursive one does, complete, first contact, or cut short."""

from slow_trees import SlowBoxes, assert_as_slow, complete_first_hit_or_cut_short, each_scene

from cdcore.narrow.rapid_style.search import RapidSearch


class SlowRapid(SlowBoxes):
    def splits_first(self, a, b):
        return self.trees[0].half[a].max() > self.trees[1].half[b].max()


@each_scene
@complete_first_hit_or_cut_short
def test_counts_and_faces_are_those_of_a_recursive_search(scene, every, budget):
    assert_as_slow(scene, RapidSearch, SlowRapid, every, budget)
