import re
from itertools import pairwise

import numpy as np
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


def test_two_frames_open_and_two_close_a_span():
    """A letter is a frame: C on, . off, - not known, which neither opens nor closes a span.

    A span is (first frame, frame after its last): two frames on open it at the first, two off close it at the first.
    """
    for text, expected in ROWS.items():
        is_on, is_known = flags(text)
        assert steady_spans(is_on, is_known, frames_in=2) == expected, text


@given(st.text(alphabet="C.-", max_size=60))
def test_spans_do_not_touch_and_contain_their_opening_frames(text):
    """``steady_spans`` opens a span with two frames on; letters of frames: C on, . off, - not known.

    Between two spans lies a frame; a span starts with a frame that is on, and has two known frames that are on.
    """
    is_on, is_known = flags(text)
    spans = steady_spans(is_on, is_known, 2)
    assert all(earlier_stop < later_first for (_, earlier_stop), (later_first, _) in pairwise(spans))
    assert all(is_on[first] and int((is_on & is_known)[first:stop].sum()) >= 2 for first, stop in spans)


@given(st.text(alphabet="C.", max_size=60))
def test_spans_are_all_runs_of_frames_that_are_on(text):
    """A letter is a frame, C on, . off; each run of C is a span, from its first frame to the first after it."""
    is_on, _is_known = flags(text)
    assert [tuple(span) for span in spans_of(is_on)] == [run.span() for run in re.finditer("C+", text)]


def test_hysteresis_switches_on_above_and_off_below():
    """On above 0.6 (frames 2 and 8), off below 0.4 (frame 6); at 0.5 or without a value the state stays.

    A span is (first frame, frame after its last).
    """
    value = np.array([0.0, 0.5, 0.7, 0.5, np.nan, 0.5, 0.3, 0.5, 0.61])
    assert hysteresis_spans(value, on_above=0.6, off_below=0.4) == [(2, 6), (8, 9)]
