from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sessions.synthetic.assembly import CLOCKS, stamps
from sessions.synthetic.looks import looks, predicted
from sessions.synthetic.truth import Episode, Truth


def test_a_quarter_of_the_rate_looks_at_every_fourth_frame():
    even = stamps(10.0, 90.0, CLOCKS["even"], np.random.default_rng(0)) + 5 * 10**17
    np.testing.assert_array_equal(looks(even, 22.5), np.arange(0, 901, 4))
    np.testing.assert_array_equal(looks(even, 90.0), np.arange(901))


@given(st.integers(0, 1000), st.floats(1.0, 200.0))
def test_each_look_is_the_first_frame_at_or_after_its_tick(seed, rate):
    times = stamps(3.0, 90.0, CLOCKS["browser"], np.random.default_rng(seed))
    plain = []
    tick = 0
    while (due := tick * 1e9 / rate) <= times[-1]:
        plain.append(int(np.argmax(times >= int(due) - 1)))
        tick += 1
    assert sorted(set(plain)) == looks(times, rate).tolist()


def test_no_frames_no_looks_and_no_rate_is_refused():
    assert looks([], 22.5).tolist() == []
    with pytest.raises(ValueError, match="positive"):
        looks([0, 1], 0.0)


def episode(start, end, slack=0.0):
    sure = (start + slack, end - slack)
    return Episode(("a", "b"), "contact", (start, end), sure, (start - slack, end + slack))


def fates(*episodes):
    answer = predicted(Truth("t", 0, 0, 10.0, "off", tuple(episodes)), (np.arange(900) * 1e9 / 90).astype(int), 22.5)
    return {name: len(found) for name, found in vars(answer).items() if found}


def test_episodes_between_looks_are_missed_and_between_frames_unseen():
    frame = 1.0 / 90.0
    assert fates(episode(3.9 * frame, 4.1 * frame)) == {"caught": 1}
    assert fates(episode(4.1 * frame, 7.9 * frame)) == {"missed": 1}
    assert fates(episode(4.1 * frame, 4.9 * frame)) == {"unseen": 1}
    assert fates(episode(4.05 * frame, 7.9 * frame, slack=0.1 * frame)) == {"undecided": 1}


def test_contained_and_near_misses_are_no_contact_episodes():
    contained = Episode(("a", "b"), "contained", (1.0, 2.0), (1.0, 2.0), (1.0, 2.0))
    near = Episode(("a", "b"), "contact", None, None, (1.0, 2.0))
    assert fates(contained, near) == {}
