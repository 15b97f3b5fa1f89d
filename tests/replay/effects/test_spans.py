from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.effects.spans import spans_of, steadied, switched


def flags(text):
    return np.array([letter == "C" for letter in text]), np.array([letter != "-" for letter in text])


@given(st.lists(st.booleans(), max_size=40))
def test_spans_and_masks_say_the_same(mask):
    array = np.array(mask, dtype=np.bool_)
    assert [any(a <= k < b for a, b in spans_of(array)) for k in range(len(array))] == mask


@pytest.mark.parametrize(
    ("text", "spans"),
    [
        (".CC..", [(1, 3)]),
        (".C.C.", []),
        ("CC.CC..", [(0, 5)]),
        (".CC", [(1, 3)]),
        ("", []),
        ("C", []),
        ("C--C..", [(0, 4)]),
        ("CC---..", [(0, 5)]),
        ("CC-.-CC", [(0, 7)]),
        ("--CC", [(2, 4)]),
        (".CC..CC..", [(1, 3), (5, 7)]),
    ],
)
def test_two_frames_in_and_two_out_whatever_is_not_known_between(text, spans):
    assert steadied(*flags(text), 2) == spans


@given(st.text(alphabet="C.-", max_size=60))
def test_spans_do_not_touch_and_hold_the_frames_that_opened_them(text):
    flag, known = flags(text)
    spans = steadied(flag, known, 2)
    assert all(a[1] < b[0] for a, b in pairwise(spans))
    assert all(flag[first] and int((flag & known)[first:stop].sum()) >= 2 for first, stop in spans)


def test_a_switch_goes_on_above_one_level_and_off_below_another():
    value = np.array([0.0, 0.5, 0.7, 0.5, np.nan, 0.5, 0.3, 0.5, 0.61])
    assert switched(value, 0.6, 0.4) == [(2, 6), (8, 9)]
