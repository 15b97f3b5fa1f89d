from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.effects.spans import hysteresis_spans, spans_of, steady_spans


def flags(text):
    """Per letter: whether it is C (on), and whether a pose is known (not "-")."""
    return np.array([letter == "C" for letter in text]), np.array([letter != "-" for letter in text])


ROWS = {
    ".CC..": [(1, 3)], ".C.C.": [], "CC.CC..": [(0, 5)], ".CC": [(1, 3)], "": [], "C--C..": [(0, 4)],
    "CC---..": [(0, 5)], "CC-.-CC": [(0, 7)], "--CC": [(2, 4)], ".CC..CC..": [(1, 3), (5, 7)],
}  # fmt: skip


@pytest.mark.parametrize("text", ROWS)
def test_two_frames_open_and_two_close_a_span(text):
    """C: on, .: off, -: not known, which neither opens nor closes. A span ends before its first closing frame."""
    assert steady_spans(*flags(text), 2) == ROWS[text]


@given(st.text(alphabet="C.-", max_size=60))
def test_spans_do_not_touch_and_contain_their_opening_frames(text):
    """``spans_of`` has every run of C; a steady span starts with C and holds the two known frames that open it."""
    flag, known = flags(text)
    assert [any(a <= k < b for a, b in spans_of(flag)) for k in range(len(flag))] == flag.tolist()
    spans = steady_spans(flag, known, 2)
    assert all(a[1] < b[0] for a, b in pairwise(spans))
    assert all(flag[first] and int((flag & known)[first:stop].sum()) >= 2 for first, stop in spans)


def test_hysteresis_switches_on_above_and_off_below():
    """On above 0.6 (frames 2 and 8), off below 0.4 (frame 6); at 0.5 or without a value the state stays."""
    value = np.array([0.0, 0.5, 0.7, 0.5, np.nan, 0.5, 0.3, 0.5, 0.61])
    assert hysteresis_spans(value, on_above=0.6, off_below=0.4) == [(2, 6), (8, 9)]
