from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sessions.synthetic.assembly import CLOCKS, stamps
from sessions.synthetic.looks import looks
from sessions.synthetic.paths import Tap
from sessions.synthetic.planting import Blinks, Dent


@given(st.floats(0.0005, 0.005), st.floats(0.01, 0.4), st.floats(0.01, 0.05))
def test_a_tap_is_in_contact_for_exactly_the_asked_time(depth, seconds, apart):
    dent = Dent(depth, seconds, apart + depth)
    tap = Tap(3.0, dent.period, (1.0, 0.0, 0.0), dent.amplitude)
    ((start, end),) = dent.intervals(tap, 0.0)
    assert end - start == pytest.approx(seconds, rel=1e-9)
    times = np.linspace(3.0, 3.0 + dent.period, 4001)
    beyond = tap(times)[:, 0] - dent.apart
    assert beyond.max() == pytest.approx(depth, rel=1e-4)
    inside = (times > start + 1e-7) & (times < end - 1e-7)
    assert (beyond[inside] > -1e-12).all()
    assert (beyond[(times < start - 1e-7) | (times > end + 1e-7)] < 1e-12).all()


def test_deeper_levels_are_shorter_and_none_below_the_bottom():
    dent = Dent(0.002, 0.02, 0.026)
    tap = Tap(0.0, dent.period, (1.0, 0.0, 0.0), dent.amplitude)
    lengths = [sum(b - a for a, b in dent.intervals(tap, level)) for level in (0.001, 0.0, -0.001, -0.0021)]
    assert lengths[0] > lengths[1] > lengths[2] > lengths[3] == 0.0
    (episode,) = dent.episodes(("a", "b"), tap, 0.001, (0.0, 9.0), "a tap")
    assert episode.note == "a tap"
    assert episode.possibly[0] < episode.nominal[0] < episode.surely[0]


@given(st.integers(0, 500), st.sampled_from(["even", "steady", "browser"]), st.floats(0.0, 8.0))
def test_a_blink_is_a_frame_with_room_to_both_looks(seed, clock, earliest):
    times = stamps(10.0, 90.0, CLOCKS[clock], np.random.default_rng(seed))
    frames = times * 1e-9
    centre = Blinks(frames, 0.022).centre(earliest, 0.015) + 0.022
    assert np.abs(frames - centre).min() < 1e-12
    assert np.abs(frames[looks(times, 22.5)] - centre).min() > 0.015
    assert centre > earliest


def test_a_session_too_short_for_a_blink_is_refused():
    with pytest.raises(ValueError, match="lengthen"):
        Blinks(np.arange(90) / 90.0, 0.0).centre(2.0, 0.01)
