"""Levels cut every node in two until leaves are small: each face stands in one leaf, and cuts fall where asked."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdcore.narrow.level_tree import extents, grow_tree


def keys_of(values):
    return lambda faces, node, first: np.asarray(values, dtype=float)[faces]


def check(shape, count, leaf_faces):
    assert sorted(shape.order.tolist()) == list(range(count))
    for node, first in enumerate(shape.child.tolist()):
        size = shape.stop[node] - shape.start[node]
        if first < 0:
            assert 1 <= size <= leaf_faces
        else:
            assert first > node
            assert (shape.start[node], shape.stop[node]) == (shape.start[first], shape.stop[first + 1])
            assert shape.stop[first] == shape.start[first + 1]


@given(st.lists(st.integers(-3, 3), min_size=1, max_size=50), st.integers(1, 5), st.booleans())
def test_children_share_out_the_faces_of_their_parent(values, leaf_faces, balanced):
    check(grow_tree(len(values), leaf_faces, keys_of(values), balanced=balanced), len(values), leaf_faces)


def test_a_balanced_cut_is_at_the_median_and_the_other_at_zero():
    values = [5, 4, 3, 2, 1, -1]
    half = grow_tree(6, 5, keys_of(values), balanced=True)
    assert half.order[: half.stop[1]].tolist() == [5, 4, 3]
    zero = grow_tree(6, 5, keys_of(values), balanced=False)
    assert zero.order[: zero.stop[1]].tolist() == [5]


def test_keys_all_on_one_side_are_cut_in_the_middle():
    shape = grow_tree(8, 1, keys_of([1] * 8), balanced=False)
    assert shape.depth == 4


def test_extents_are_those_of_each_node():
    points = np.arange(24.0).reshape(4, 2, 3)
    low, high = extents(points, np.array([0, 1]))
    assert low.tolist() == [[0, 1, 2], [6, 7, 8]]
    assert high.tolist() == [[3, 4, 5], [21, 22, 23]]
