"""First contact finds what all contacts find first, with no more tests."""

import numpy as np
from slow_trees import SCENES

from cdcore.narrow.exact_sums import new_digits
from cdcore.narrow.rapid_style.search import RapidSearch
from cdcore.narrow.rapid_style.traverse import search_rows


def run(trees, poses, every):
    counts, truncated = np.zeros((len(poses.pad), 2), dtype=np.int64), np.zeros(len(poses.pad), dtype=np.uint8)
    found = search_rows(
        trees[0], trees[1], np.empty((200, 2), dtype=np.int64), poses.turn_a, poses.move_a, poses.turn_b,
        poses.move_b, poses.pad, every, 10**9, new_digits(), counts, truncated,
    )  # fmt: skip
    assert not truncated.any()
    return found, counts.sum(axis=1)


def test_the_first_contact_is_the_first_of_all_contacts_at_less_work():
    corners, poses = SCENES["ball and beaker"]()
    trees = RapidSearch(corners).trees
    (every, work), (first, less) = run(trees, poses, True), run(trees, poses, False)
    _, index = np.unique(every[:, 0], return_index=True)
    assert len(index) and np.array_equal(first, every[index])
    hit = np.isin(np.arange(len(poses.pad)), every[:, 0])
    assert (less[hit] < work[hit]).all() and (less[~hit] == work[~hit]).all()
