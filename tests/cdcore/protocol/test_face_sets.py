"""Face sets give back what was put in, whether rows are shared or joined."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdcore import FaceSets

rows = st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), min_size=0, max_size=4).map(
    lambda pairs: np.array(sorted(set(pairs)), dtype=np.int32).reshape(-1, 2)
)
entries = st.dictionaries(st.tuples(st.integers(0, 7), st.integers(0, 3)), rows, max_size=12)


def made(table):
    frame, pair = [key[0] for key in table], [key[1] for key in table]
    return FaceSets.from_lists(frame, pair, list(table.values()))


@given(entries)
def test_every_set_comes_back_from_its_place(table):
    sets = made(table)
    counts = sets.counts(8, 4)
    for frame in range(8):
        for pair in range(4):
            expected = table.get((frame, pair), np.zeros((0, 2)))
            assert sets.at(frame, pair).tolist() == expected.tolist()
            assert counts[frame, pair] == len(expected)


@given(entries, st.integers(0, 8))
def test_blocks_joined_equal_the_whole(table, cut):
    before = {key: value for key, value in table.items() if key[0] < cut}
    after = {(frame - cut, pair): value for (frame, pair), value in table.items() if frame >= cut}
    joined = FaceSets.join([(0, made(before)), (cut, made(after))])
    for frame in range(8):
        for pair in range(4):
            assert joined.at(frame, pair).tolist() == made(table).at(frame, pair).tolist()


def test_frames_that_share_a_set_store_it_once():
    one = np.array([[1, 2], [3, 4]])
    sets = FaceSets.from_shared(np.arange(1000), np.zeros(1000, dtype=int), np.zeros(1000, dtype=int), [one])
    assert len(sets.faces) == 2
    assert sets.at(999, 0).tolist() == one.tolist()


def test_an_entry_without_faces_is_no_contact_and_is_left_out():
    sets = FaceSets.from_lists([0, 1], [0, 0], [np.zeros((0, 2)), np.array([[5, 6]])])
    assert sets.frame.tolist() == [1]


def test_they_are_read_only():
    sets = FaceSets.from_lists([0], [0], [np.array([[1, 2]])])
    with pytest.raises(ValueError, match="read-only"):
        sets.faces[0] = 0


def test_nothing_joined_is_nothing():
    assert FaceSets.join([]).counts(2, 2).tolist() == [[0, 0], [0, 0]]
    assert FaceSets.from_lists([], [], []).at(0, 0).shape == (0, 2)
