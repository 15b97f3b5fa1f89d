"""The kept axis ends most leaf tests, and what GJK leaves open is asked exactly."""

import numpy as np
from slow_trees import SCENES

from cdcore.narrow.exact_sums import new_digits
from cdcore.narrow.solid_style.search import SolidSearch
from cdcore.narrow.solid_style.traverse import search_rows

NODE, LEAF, HITS, STEPS, EXACT = range(5)


def run(trees, poses, every=True):
    counts, truncated = np.zeros((len(poses.pad), 5), dtype=np.int64), np.zeros(len(poses.pad), dtype=np.uint8)
    found = search_rows(
        trees[0], trees[1], np.empty((200, 2), dtype=np.int64), poses.turn_a, poses.move_a, poses.turn_b,
        poses.move_b, poses.pad, every, 10**9, new_digits(), counts, truncated,
    )  # fmt: skip
    return found, counts


def test_cached_axes_are_hit_and_every_leaf_test_ends_one_of_three_ways():
    corners, poses = SCENES["ball and beaker"]()
    found, counts = run(SolidSearch(corners).trees, poses)
    total = counts.sum(axis=0)
    assert total[HITS] > 0.3 * total[LEAF] > 0
    assert total[EXACT] >= len(found) > 0
    searched = total[LEAF] - total[HITS] - total[EXACT]
    assert 0 < searched <= total[STEPS]


def test_gjk_leaves_little_to_the_exact_test_that_does_not_meet():
    corners, poses = SCENES["ball and beaker"]()
    found, counts = run(SolidSearch(corners).trees, poses)
    assert counts[:, EXACT].sum() <= 1.01 * len(found) + 2
