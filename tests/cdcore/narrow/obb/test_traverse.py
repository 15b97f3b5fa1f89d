"""A budget stops between two tests, wherever it falls, also inside a leaf of several faces."""

import numpy as np
from slow_trees import SCENES

from cdcore.narrow.exact_sums import new_digits
from cdcore.narrow.obb.search import ObbSearch
from cdcore.narrow.obb.traverse import search_rows


def run(trees, poses, every, budget):
    counts, truncated = np.zeros((len(poses.pad), 2), dtype=np.int64), np.zeros(len(poses.pad), dtype=np.uint8)
    stack = np.empty((64, 2), dtype=np.int64)
    found = search_rows(
        trees[0], trees[1], stack, poses.turn_a, poses.move_a, poses.turn_b, poses.move_b, poses.pad, every, budget,
        new_digits(), counts, truncated,
    )  # fmt: skip
    return found, counts, truncated


def test_each_budget_does_one_test_more_and_never_loses_what_a_smaller_found():
    corners, poses = SCENES["rod and ball"]()
    trees = ObbSearch(corners).trees
    _, whole, _ = run(trees, poses, True, 10**9)
    before = set()
    for budget in range(1, int(whole.sum(axis=1).max()) + 2, 7):
        found, counts, truncated = run(trees, poses, True, budget)
        assert np.array_equal(counts.sum(axis=1), np.minimum(budget, whole.sum(axis=1)))
        assert np.array_equal(truncated == 1, whole.sum(axis=1) > budget)
        now = {tuple(row) for row in found.tolist()}
        assert before <= now
        before = now
    assert before
