from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import along_x, cube

from replay.pipeline.engine import compute
from sessions import Session
from sessions.model.scene import Scene, SceneBody, SceneEffect
from sessions.model.track import HandTrack

STAMPS = np.arange(200) * 10_000_000
TIMES = STAMPS / 1e9
SCENE = Scene(
    bodies=(SceneBody("hand-left", tags=("hand", "left")), SceneBody("cup"), SceneBody("jar")),
    effects=tuple(SceneEffect("grasp", {"between": ["tag:hand", thing]}) for thing in ("cup", "jar")),
)


def world(hand, cup, trigger, grip=None, jar=None, lost=None):
    far = np.full(200, 9.0)
    poses = {"hand-left": along_x(hand), "cup": along_x(cup), "jar": along_x(far if jar is None else jar)}
    session = Session.from_arrays(STAMPS, poses, {name: cube(0.2) for name in poses}, SCENE)
    if lost is not None:
        session.frames.status.setflags(write=True)
        session.frames.status[lost, 0] = 2
    return replace(session, hands={"ann/left": HandTrack(STAMPS, trigger, grip)})


def events(session):
    run = compute(session, detectors=()).effects["grasp"]
    return [(e.name, e.bodies[1], round(e.time, 2)) for e in run.events], run


HAND = np.clip(TIMES - 0.8, 0.0, 0.5)
PRESSED = np.where((TIMES >= 0.5) & (TIMES < 1.6), 1.0, 0.0)


def test_a_pressed_trigger_and_a_thing_that_rides_are_a_grasp_until_the_release():
    found, run = events(world(HAND, HAND + 0.5, PRESSED))
    assert found == [("grasp", "cup", 0.5), ("release", "cup", 1.6)]
    grasp = run.events[0]
    assert grasp.end == pytest.approx(1.6) and grasp.values["moved_m"] == pytest.approx(0.5, abs=0.01)
    assert not grasp.values["touching"] and run.output.lanes["hand-left"][0].word == "cup"


def test_the_trigger_has_hysteresis_between_its_two_levels():
    wavering = np.where(PRESSED > 0, 0.7, 0.2) - 0.2 * ((TIMES > 0.9) & (TIMES < 1.2))
    assert len(events(world(HAND, HAND + 0.5, wavering))[0]) == 2
    assert events(world(HAND, HAND + 0.5, 0.59 * PRESSED))[0] == []


@pytest.mark.parametrize(
    "cup",
    [np.full(200, 0.9), HAND * 0.98 + 0.5, np.where(TIMES < 0.815, 0.8 + HAND, 0.815)],
    ids=["stays", "slides", "falls out soon"],
)
def test_what_does_not_ride_is_not_held(cup):
    assert events(world(HAND, cup, PRESSED))[0] == []


def test_a_press_on_a_touched_thing_that_stays_is_a_failed_grasp():
    found, run = events(world(np.zeros(200), np.full(200, 0.15), PRESSED))
    assert found == [("failed", "cup", 0.5)] and run.events[0].level == "warning"


def test_of_two_things_the_one_that_rides_is_taken():
    assert events(world(HAND, np.full(200, 0.3), PRESSED, jar=HAND - 0.4))[0][0] == ("grasp", "jar", 0.5)


def test_a_hand_that_is_lost_for_a_moment_keeps_what_it_holds():
    found, run = events(world(HAND, HAND + 0.5, PRESSED, lost=slice(100, 115)))
    assert found == [("grasp", "cup", 0.5), ("release", "cup", 1.6)]
    assert run.events[0].values["held_s"] > 1.0


def test_a_grasp_that_the_recording_does_not_end_has_no_end_and_no_release():
    found, run = events(world(HAND, HAND + 0.5, np.where(TIMES >= 0.5, 1.0, 0.0)))
    assert found == [("grasp", "cup", 0.5)] and run.events[0].end is None


def test_a_hand_without_buttons_is_counted_and_not_guessed():
    found, run = events(replace(world(HAND, HAND + 0.5, PRESSED), hands={}))
    assert found == [] and run.counters["no buttons recorded: hand-left"] == 1
