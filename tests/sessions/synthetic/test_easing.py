from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sessions.synthetic.easing import knock, knock_interval, minimum_jerk, minimum_jerk_inverse


def test_a_reach_starts_and_ends_at_rest_and_passes_its_middle_fastest():
    u = np.linspace(0.0, 1.0, 100_001)
    s = minimum_jerk(u)
    speed = np.gradient(s, u)
    assert (s[0], s[-1], s[50_000]) == pytest.approx((0.0, 1.0, 0.5), abs=1e-12)
    assert speed[[0, -1]] == pytest.approx([0.0, 0.0], abs=1e-8)
    assert speed.max() == pytest.approx(1.875, abs=1e-6)
    assert (np.diff(s) >= 0.0).all()
    assert minimum_jerk([-1.0, 2.0]).tolist() == [0.0, 1.0]


@given(st.floats(1e-9, 1.0 - 1e-9))
def test_the_inverse_gives_the_time_of_a_share(share):
    assert float(minimum_jerk(minimum_jerk_inverse(share))) == pytest.approx(share, abs=1e-14)


def test_the_inverse_refuses_what_is_no_share():
    assert (minimum_jerk_inverse(0.0), minimum_jerk_inverse(1.0)) == (0.0, 1.0)
    with pytest.raises(ValueError, match="between 0 and 1"):
        minimum_jerk_inverse(1.5)


@given(st.floats(0.001, 1.0))
def test_a_knock_is_out_far_enough_exactly_within_its_interval(share):
    start, end = knock_interval(share)
    inside = np.linspace(start, end, 50)[1:-1]
    assert (knock(inside) >= share - 1e-12).all()
    assert knock([start - 1e-4, end + 1e-4]).max() < share
    assert start + end == pytest.approx(1.0)


def test_a_knock_never_reaches_beyond_its_amplitude():
    assert knock_interval(1.0001) is None
    assert knock_interval(0.0) == (0.0, 1.0)
    assert knock([-0.5, 0.0, 1.0, 1.5]) == pytest.approx([0.0] * 4, abs=1e-15)
