"""Pairs are ranked by what was missed, and boxes with numbers never overlap."""

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from replay.comparison.outcome import Comparison, Miss, Outcome
from replay.outputs.lanes import number_boxes, ranked_pairs


def test_pairs_are_ranked_by_missed_frames_and_held_ones_come_last():
    outcome = np.zeros((10, 5), dtype=np.uint8)
    outcome[:1, 0], outcome[:3, 1], outcome[:5, 2] = Outcome.MISSED, Outcome.MISSED, Outcome.BOTH
    outcome[:9, 3] = Outcome.MISSED
    held = np.array([False, False, False, True, False])
    assert ranked_pairs(Comparison("s", "o", outcome), held) == [1, 0, 2, 3]


def test_a_pair_that_was_only_left_out_has_no_lane():
    outcome = np.full((4, 1), Outcome.LEFT_OUT, dtype=np.uint8)
    assert ranked_pairs(Comparison("s", "o", outcome), np.array([False])) == []


def at(number, start, length=0.03):
    return Miss(
        number=number, pair=0, body_a="a", body_b="b", first=0, last=0, start=start, end=start + length,
        kind="never found", episode=1, deepest=0, point=(0, 0, 0), normal=(0, 1, 0), face_pairs=1, cut_length=0.0,
    )  # fmt: skip


@given(st.lists(st.floats(0, 60), min_size=1, max_size=300))
def test_boxes_never_overlap_and_hold_every_number_once(starts):
    misses = [at(number, start) for number, start in enumerate(sorted(starts), 1)]
    boxes = number_boxes(misses, 60_000_000_000)
    assert all(a[2] <= b[1] for a, b in pairwise(boxes))
    named = []
    for label, start, end in boxes:
        low, _, high = label.partition("-")
        named += range(int(low), int(high or low) + 1)
        assert end - start >= (0.011 + 0.0055 * len(label)) * 60e9 - 1
    assert named == [miss.number for miss in misses]
