"""Every search of the table counts node tests first and leaf tests second, and takes an unlimited budget."""

import numpy as np
import pytest
from slow_trees import SCENES

from cdcore.narrow.aabb.search import AabbSearch
from cdcore.narrow.obb.search import ObbSearch
from cdcore.narrow.pair_search import UNLIMITED
from cdcore.narrow.rapid_style.search import RapidSearch
from cdcore.narrow.solid_style.search import SolidSearch

SEARCHES = [AabbSearch, ObbSearch, RapidSearch, SolidSearch]


@pytest.mark.parametrize("made", SEARCHES)
def test_node_and_leaf_tests_come_first_and_an_unlimited_search_is_not_truncated(made):
    corners, poses = SCENES["rod and ball"]()
    assert made.counters[:2] == ("node_tests", "leaf_tests")
    searched = made(corners).search(0, 1, poses, every=True, budget=UNLIMITED)
    assert searched.counts.shape == (len(poses.pad), len(made.counters))
    assert (searched.counts[:, 0] > 0).all() and not searched.truncated.any()
    assert searched.found.shape[1] == 4 and (np.diff(searched.found[:, 0]) >= 0).all()


def test_all_searches_find_the_same_faces():
    corners, poses = SCENES["ball and beaker"]()
    found = [made(corners).search(0, 1, poses, every=True, budget=UNLIMITED).found for made in SEARCHES]
    rows = [sorted(map(tuple, one[:, :3].tolist())) for one in found]
    assert rows[0] and all(one == rows[0] for one in rows)
