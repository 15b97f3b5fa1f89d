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
"""Seconds."""


def assembly_of_hand(x):
    """Bodies and poses of a hand at these metres on X, a frame each 10 ms, beside a cube that stands at 9 m."""
    return assemble(unit_cubes_on_x({"hand": x, "cube": np.full(len(x), 9.0)}))


HAND, CUBE = 0, 1
"""Numbers of the bodies."""


def test_path_and_idle_time_of_a_half_idle_hand():
    """The hand moves at 0.1 m/s for 30 s, 3 m, then rests for 30 s."""
    assembly = assembly_of_hand(x=np.where(MINUTE_IN_STEPS_OF_10_MS < 30.0, 0.1 * MINUTE_IN_STEPS_OF_10_MS, 3.0))
    result = measure_hands(assembly, hands=[HAND])
    assert result.path_m == pytest.approx(3.0, rel=1e-9)
    assert result.idle_fraction == pytest.approx(30 / 60, abs=0.005), "a step of 0.1 s may lie on both sides"
    assert result.valid_minutes == pytest.approx(1.0, rel=1e-9)
    assert result.flagged_fraction == 0.0, "no pose was lost"


def test_a_lost_tracker_adds_no_path_and_no_valid_time():
    """The hand goes a metre a frame and is lost in 100 of 300 frames of 10 ms: 2 s and at most 200 m count.

    Paths are measured in steps of 0.1 s, so that up to three steps at the ends of what is lost may count or not.
    Of the 600 poses of hand and cube 100 are flagged.
    """
    status = np.ones((300, 2), dtype=np.uint8)
    status[100:200, HAND] = Status.ABSENT
    assembly = assemble(session_of_frames(np.arange(300) * 10_000_000, status, names=("hand", "cube")))
    result = measure_hands(assembly, hands=[HAND])
    assert 2.0 - 0.3 < result.valid_minutes * 60 < 2.0 + 0.1
    assert 200.0 - 30.0 < result.path_m < 200.0 + 10.0
    assert result.flagged_fraction == pytest.approx(100 / 600, abs=0.01)


def test_a_trackers_noise_adds_little_to_the_path():
    """A resting hand, with noise of 0.3 mm at 100 Hz for a minute: steps of 10 ms would add up to over 1.5 m.

    Measured ten times a second it is a tenth of the steps, below 0.3 m, and the hand rests.
    """
    noise = np.random.default_rng(0).normal(0.0, 0.0003, len(MINUTE_IN_STEPS_OF_10_MS))
    assert np.abs(np.diff(noise)).sum() > 1.5
    result = measure_hands(assembly_of_hand(x=noise), hands=[HAND])
    assert result.path_m < 0.3
    assert result.idle_fraction > 0.99


@given(
    times=st.lists(st.floats(0.0, 60.0), min_size=1, unique=True).map(sorted),
    step=st.sampled_from([0.1, 0.25, 1 / 90]),
)
@example(times=[5.0, 5.04, 5.1, 5.18], step=0.1)
# From the first frame these are 94 and 99 steps but for rounding, which is down for one and up for the other.
@example(times=[0.21111111111111114, 1.2555555555555555, 1.3111111111111111, 1.4666666666666668], step=1 / 90)
def test_frames_at_clock_ticks_equal_a_search_of_every_tick(times, step):
    """Expected is the first frame at or after each tick; ticks come every ``step`` seconds from the first frame on."""
    times = np.array(times)
    end = times[-1] + step / 2
    ticks = times[0] + step * np.arange(np.ceil((end - times[0]) / step) + 1)
    expected = np.unique(np.minimum(np.searchsorted(times, ticks[ticks < end]), len(times) - 1))
    assert frames_at(times, step, end).tolist() == expected.tolist()


@pytest.fixture(params=[slice(-1, None), slice(1, None)], ids=["last", "all but the first"])
def assembly_with_jump(request):
    """300 frames at 100 Hz, 3 s, of which the last, or all but the first, have stamps of the year 2026."""
    stamps = np.arange(300) * 10_000_000
    stamps[request.param] += 1_780_000_000 * 10**9
    return assemble(session_of_frames(stamps, np.ones((300, 2))))


def test_jump_from_zero_to_unix_time_adds_no_minutes(assembly_with_jump):
    """3 s have poses, and up to 0.5 s may be lost at the jump; its half century is no time with poses."""
    result = measure_hands(assembly_with_jump, hands=[0, 1])
    assert 2.5 <= result.valid_minutes * 60 <= 3.0


def test_jump_from_zero_to_unix_time_makes_no_near_miss(assembly_with_jump):
    """Two bodies that stay metres apart; half a century is searched where frames are, and not tick by tick."""
    only_pair = np.array([0])
    assert close_intervals(assembly_with_jump, only_pair) == ()


@pytest.fixture
def session_with_tasks():
    """A session in which tasks are timed in nanoseconds: stir from 0 to 15, within it pour from 10 to 20, and so on."""
    intervals = [
        Interval(10, 20, "task", "pour"),
        Interval(0, 15, "task", "stir"),
        Interval(12, 13, "task", "stir"),
        Interval(40, 50, "task", "pour"),
        Interval(0, 60, "stage", "first"),
    ]
    return unit_cubes_on_x({"a": [0.0]}, intervals=intervals)


def test_a_moment_belongs_to_the_span_that_began_last(session_with_tasks):
    """Pour begins within stir, which begins again at 12 and then ends at 13; ends belong to a span."""
    task_at = {
        -1: None, 0: "stir", 9: "stir", 10: "pour", 12: "stir", 13: "stir", 14: "pour", 20: "pour", 21: None,
        45: "pour", 60: None,
    }  # fmt: skip
    stamps = np.array([*task_at])
    assert activities_at(session_with_tasks, "task", stamps) == [*task_at.values()]
    assert activities_at(session_with_tasks, "stage", stamps) == [None, *["first"] * (len(stamps) - 1)]


def test_names_of_spans_stand_in_order_of_time_each_once(session_with_tasks):
    """Tasks: stir from 0 and 12 ns, pour from 10 and 40 ns; there is no span of the kind "feature"."""
    assert span_names(session_with_tasks, "task") == ["stir", "pour"]
    assert span_names(session_with_tasks, "feature") == []


def test_seconds_of_a_task_are_those_of_all_its_spans(session_with_tasks):
    """Stir goes from 0 to 15 and from 12 to 13 ns, pour from 10 to 20 and from 40 to 50 ns."""
    assert task_seconds(session_with_tasks) == {
        "stir": pytest.approx(16e-9, rel=1e-9, abs=0),
        "pour": pytest.approx(20e-9, rel=1e-9, abs=0),
    }
