"""Pairs come out as body numbers, in the order asked for, or one sentence says what is wrong."""

import numpy as np
import pytest
from support.shapes import box_mesh

from cdcore import Body
from cdcore.errors import InvalidPairError
from cdcore.protocol import resolve_pairs

BODIES = [Body(name, box_mesh()) for name in ("table", "rod", "cup")]


def test_no_pairs_named_means_all_of_them_once():
    assert resolve_pairs(BODIES, None).tolist() == [[0, 1], [0, 2], [1, 2]]
    assert resolve_pairs(BODIES[:1], None).shape == (0, 2)


@pytest.mark.parametrize(
    "pairs",
    [[("cup", "table"), ("rod", "cup")], [[2, 0], [1, 2]], np.array([[2, 0], [1, 2]]), [("cup", 0), (1, "cup")]],
)
def test_names_and_numbers_mean_the_same_and_keep_their_order(pairs):
    resolved = resolve_pairs(BODIES, pairs)
    assert resolved.tolist() == [[2, 0], [1, 2]]
    assert resolved.dtype == np.int64


def test_an_empty_list_is_no_pairs():
    assert resolve_pairs(BODIES, []).shape == (0, 2)


@pytest.mark.parametrize(
    ("pairs", "message"),
    [
        ([("cup", "spoon")], "no body 'spoon'; there are: table, rod, cup"),
        ([(0, 3)], "no body 3"),
        ([(-1, 0)], "no body -1"),
        ([(0.0, 1)], "no body 0.0"),
        ([("cup", "cup")], "paired with itself"),
        ([(0, 1), ("rod", "table")], "pair table-rod is asked for twice"),
        ([(0, 1, 2)], "two bodies, not 3"),
    ],
)
def test_a_pair_that_is_none_is_refused(pairs, message):
    with pytest.raises(InvalidPairError, match=message):
        resolve_pairs(BODIES, pairs)


def test_two_bodies_of_one_name_are_refused():
    with pytest.raises(InvalidPairError, match="used twice: rod"):
        resolve_pairs([*BODIES, BODIES[1]], None)
