import numpy as np
from small_worlds import cubes

from replay.assemble import assemble
from replay.assembly import PoseOrigin


def test_a_pair_is_named_after_its_bodies_in_the_order_of_the_pair():
    got = assemble(cubes({"b": [0, 1], "a": [5, 5], "c": [9, 9]}), pairs=[("c", "a"), ("a", "b")])
    assert [got.pair_name(p) for p in range(2)] == ["b-a", "a-c"]
    assert got.names == ("b", "a", "c")


def test_only_an_origin_of_none_means_that_there_is_no_pose():
    assert [origin for origin in PoseOrigin if not origin] == [PoseOrigin.NONE]
    assert np.array(list(PoseOrigin), dtype=np.uint8).max() < 256
