import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from support.small_worlds import session_of_frames, unit_cubes_on_x

from replay.document.metrics.hands import activities_at, frames_at, measure_hands, span_names, task_seconds
from replay.document.metrics.near import close_intervals
from replay.prepare.assemble import assemble
from sessions.model.event import Interval
from sessions.model.session import Status

MINUTE_IN_STEPS_OF_10_MS = np.arange(6001) * 0.01


def test_path_and_idle_time_of_a_half_idle_hand():
    """The hand moves at 0.1 m/s for half of a minute, then rests."""
    hand = np.where(MINUTE_IN_STEPS_OF_10_MS < 30.0, 0.1 * MINUTE_IN_STEPS_OF_10_MS, 3.0)
    assembly = assemble(unit_cubes_on_x({"hand": hand, "cube": np.full(len(MINUTE_IN_STEPS_OF_10_MS), 9.0)}))
    result = measure_hands(assembly, [0])
    assert result.path_m == pytest.approx(3.0, rel=1e-9)
    assert result.idle_fraction == pytest.approx(0.5, abs=0.005)
    assert result.valid_minutes == pytest.approx(1.0, rel=1e-9)
    assert result.flagged_fraction == 0.0


def test_a_lost_tracker_adds_no_path_and_no_valid_time():
    """The hand goes a metre a frame and is lost in 100 of 300 frames of 10 ms: 2 s and at most 200 m count.

    Of 600 samples of two bodies 100 are flagged.
    """
    status = np.ones((300, 2), dtype=np.uint8)
    status[100:200, 0] = Status.ABSENT
    assembly = assemble(session_of_frames(np.arange(300) * 10_000_000, status, names=("hand", "cube")))
    result = measure_hands(assembly, [0])
    assert 1.7 < result.valid_minutes * 60 < 2.1
    assert 170.0 < result.path_m < 210.0
    assert result.flagged_fraction == pytest.approx(100 / 600, abs=0.01)


def test_a_trackers_noise_adds_little_to_the_path():
    """Noise of 0.3 mm at 100 Hz for a minute: its steps add up to more than 1.5 m."""
    noise = np.random.default_rng(0).normal(0.0, 0.0003, len(MINUTE_IN_STEPS_OF_10_MS))
    assembly = assemble(unit_cubes_on_x({"hand": noise, "cube": np.full(len(MINUTE_IN_STEPS_OF_10_MS), 9.0)}))
    result = measure_hands(assembly, [0])
    assert result.path_m < 0.3 and result.idle_fraction > 0.99
    assert np.abs(np.diff(noise)).sum() > 1.5


@given(st.lists(st.floats(0.0, 60.0), min_size=1, unique=True).map(sorted), st.sampled_from([0.1, 0.25, 1 / 90]))
@example([5.0, 5.04, 5.1, 5.18], 0.1)
# From the first frame these are 94 and 99 steps but for rounding, which is down for one and up for the other.
@example([0.21111111111111114, 1.2555555555555555, 1.3111111111111111, 1.4666666666666668], 1 / 90)
def test_frames_at_clock_ticks_equal_a_search_of_every_tick(times, step):
    """The first frame at or after each tick of ``step`` seconds."""
    times = np.array(times)
    end = times[-1] + step / 2
    ticks = times[0] + step * np.arange(np.ceil((end - times[0]) / step) + 1)
    want = np.unique(np.minimum(np.searchsorted(times, ticks[ticks < end]), len(times) - 1))
    assert frames_at(times, step, end).tolist() == want.tolist()


@pytest.mark.parametrize("unix", [slice(-1, None), slice(1, None)], ids=["last", "all but the first"])
def test_jump_from_zero_to_unix_time_adds_no_minutes(unix):
    """300 frames at 100 Hz are 3 s, though stamps jump from 0 to the year 2026."""
    stamps = np.arange(300) * 10_000_000
    stamps[unix] += 1_780_000_000 * 10**9
    assembly = assemble(session_of_frames(stamps, np.ones((300, 2))))
    result = measure_hands(assembly, [0, 1])
    assert 2.5 <= result.valid_minutes * 60 <= 3.0
    assert close_intervals(assembly, np.array([0])) == ()


def test_a_moment_belongs_to_the_span_that_began_last():
    """Spans are (first, last nanosecond, kind, name); "pour" begins within "stir", which begins again at 12."""
    spans = [(10, 20, "task", "pour"), (0, 15, "task", "stir"), (12, 13, "task", "stir"), (40, 50, "task", "pour")]
    session = unit_cubes_on_x({"a": [0.0]}, intervals=[Interval(*span) for span in (*spans, (0, 60, "stage", "first"))])
    stamps = np.array([-1, 0, 9, 10, 12, 13, 14, 20, 21, 45, 60])
    stir, pour = ["stir"], ["pour"]
    assert activities_at(session, "task", stamps) == [None, *stir * 2, *pour, *stir * 2, *pour * 2, None, *pour, None]
    assert activities_at(session, "stage", stamps) == [None] + ["first"] * 10
    assert span_names(session, "task") == ["stir", "pour"] and span_names(session, "feature") == []
    assert task_seconds(session) == {"stir": pytest.approx(16e-9), "pour": pytest.approx(20e-9)}
