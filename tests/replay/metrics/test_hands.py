from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.small_worlds import cubes, framed

from replay.metrics.hands import fixed_bodies, frames_at, grasps, hand_bodies, moving, task_seconds
from replay.metrics.near import close_stretches
from replay.prepare.assemble import assemble
from sessions.model.event import Interval
from sessions.model.hand import HandTrack
from sessions.model.scene import Pose, Scene, SceneBody

STEP = 10_000_000
FRAMES = 300


def world(places, trigger, *, scene=None):
    hands = {"p/right": HandTrack(np.arange(FRAMES) * STEP, trigger)}
    session = replace(cubes(places, scene=scene), hands=hands)
    return assemble(session), session


def carried():
    """The hand comes to the cube at 1 s, presses, carries it 0.5 m until 2 s and lets go."""
    t = np.arange(FRAMES) * 0.01
    hand = np.where(t < 1.0, -3.0 + 2.0 * t, -1.0 + 0.5 * np.clip(t - 1.0, 0.0, 1.0))
    cube = 0.5 * np.clip(t - 1.0, 0.0, 1.0)
    trigger = ((t >= 1.0) & (t < 2.0)).astype(float)
    return {"hand-right": hand, "cube": cube, "far": np.full(FRAMES, 9.0)}, trigger


def test_what_moves_along_while_the_trigger_is_pressed_was_taken():
    assembly, session = world(*carried())
    (one,) = grasps(assembly, session)
    assert assembly.names[one.thing] == "cube" and assembly.names[one.hand] == "hand-right"
    assert (one.start, one.end) == pytest.approx((1.0, 2.0), abs=0.02)


def test_a_press_in_the_air_takes_nothing_and_counts_as_an_attempt():
    places, trigger = carried()
    assembly, session = world({**places, "cube": np.zeros(FRAMES)}, trigger)
    assert [one.thing for one in grasps(assembly, session)] == [-1]


def test_a_press_shorter_than_three_tenths_takes_nothing():
    places, _ = carried()
    trigger = np.zeros(FRAMES)
    trigger[110:138] = 1.0
    assembly, session = world(places, trigger)
    assert [one.thing for one in grasps(assembly, session)] == [-1]


def test_a_finger_that_trembles_between_the_levels_presses_once():
    places, trigger = carried()
    trigger[120:180] = np.where(np.arange(60) % 2, 0.45, 0.58)
    assert len(grasps(*world(places, trigger))) == 1


def test_without_a_trigger_nobody_knows_of_grasps():
    session = cubes(carried()[0])
    assert grasps(assemble(session), session) is None


def test_hands_are_those_tagged_so_and_else_those_named_so():
    places, trigger = carried()
    assembly, session = world(places, trigger)
    assert {assembly.names[k]: side for k, side in hand_bodies(assembly, session).items()} == {"hand-right": "right"}
    scene = Scene(bodies=(SceneBody("far", tags=("hand",)), SceneBody("hand-right"), SceneBody("cube")))
    assembly, session = world(places, trigger, scene=scene)
    assert [assembly.names[k] for k in hand_bodies(assembly, session)] == ["far"]


T = np.arange(6001) * 0.01


def test_path_and_idle_time_of_a_hand_that_moves_half_of_the_minute():
    hand = np.where(T < 30.0, 0.1 * T, 3.0)
    assembly = assemble(cubes({"hand": hand, "cube": np.full(len(T), 9.0)}))
    found = moving(assembly, [0])
    assert found.path_m == pytest.approx(3.0, rel=1e-9)
    assert found.idle_share == pytest.approx(0.5, abs=0.005)
    assert found.valid_minutes == pytest.approx(1.0, rel=1e-9)
    assert found.flagged_share == 0.0


def test_a_lost_tracker_adds_no_path_and_no_valid_time():
    status = np.ones((300, 2), dtype=np.uint8)
    status[100:200, 0] = 0
    assembly = assemble(framed(np.arange(300) * 10_000_000, status, names=("hand", "cube")))
    found = moving(assembly, [0])
    assert found.valid_minutes * 60 < 2.1
    assert found.flagged_share == pytest.approx((100 - 0) / 600, abs=0.01)


def test_a_trackers_noise_adds_little_to_the_path():
    noise = np.random.default_rng(0).normal(0.0, 0.0003, len(T))
    assembly = assemble(cubes({"hand": noise, "cube": np.full(len(T), 9.0)}))
    found = moving(assembly, [0])
    assert found.path_m < 0.3 and found.idle_share > 0.99
    assert np.abs(np.diff(noise)).sum() > 1.5


def test_fixed_bodies_are_those_the_scene_fixes():
    scene = Scene(bodies=(SceneBody("hand"), SceneBody("bench", fixed=Pose())))
    session = cubes({"hand": np.linspace(0, 1, 50), "cube": np.full(50, 5.0)}, scene=scene)
    assert fixed_bodies(assemble(session)) == set()


def test_spans_of_one_task_add_up():
    session = cubes(
        {"a": np.zeros(4), "b": np.full(4, 3.0)},
        intervals=[Interval(0, 2_000_000_000, "task", "stir"), Interval(3_000_000_000, 4_000_000_000, "task", "stir"),
                   Interval(0, 9_000_000_000, "stage", "virtual reality")],
    )  # fmt: skip
    assert task_seconds(session) == {"stir": pytest.approx(3.0)}


@given(st.lists(st.floats(0.0, 60.0), min_size=1, unique=True).map(sorted), st.sampled_from([0.1, 0.25, 1 / 90]))
def test_frames_at_ticks_are_those_of_the_whole_clock(times, step):
    times = np.array(times)
    end = times[-1] + step / 2
    ticks = times[0] + step * np.arange(np.ceil((end - times[0]) / step) + 1)
    want = np.unique(np.minimum(np.searchsorted(times, ticks[ticks < end]), len(times) - 1))
    assert frames_at(times, step, end).tolist() == want.tolist()


@pytest.mark.parametrize("unix", [slice(-1, None), slice(1, None)], ids=["last", "all but the first"])
def test_stamps_in_unix_time_are_measured_without_making_half_a_century_of_ticks(unix):
    stamps = np.arange(300) * 10_000_000
    stamps[unix] += 1_780_000_000 * 10**9
    assembly = assemble(framed(stamps, np.ones((300, 2))))
    found = moving(assembly, [0, 1])
    assert 2.5 <= found.valid_minutes * 60 <= 3.0
    assert close_stretches(assembly, np.array([0])) == ()
