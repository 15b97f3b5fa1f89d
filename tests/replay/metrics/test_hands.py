from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import cubes

from replay.metrics.hands import grasps, hand_bodies
from replay.prepare.assemble import assemble
from sessions.model.hand import HandTrack
from sessions.model.scene import Scene, SceneBody

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
