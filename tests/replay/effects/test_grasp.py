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


def world(hand, cup, trigger, jar=None, lost=None):
    far = np.full(200, 9.0)
    poses = {"hand-left": along_x(hand), "cup": along_x(cup), "jar": along_x(far if jar is None else jar)}
    session = Session.from_arrays(STAMPS, poses, {name: cube(0.2) for name in poses}, SCENE)
    if lost is not None:
        session.frames.status.setflags(write=True)
        session.frames.status[lost, 0] = 2
    return replace(session, hands={"ann/left": HandTrack(STAMPS, trigger)})


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


WAVERING = np.where(PRESSED > 0, 0.7, 0.2) - 0.2 * ((TIMES > 0.9) & (TIMES < 1.2))
TAKEN = [("grasp", "cup", 0.5), ("release", "cup", 1.6)]


@pytest.mark.parametrize(
    ("hand", "cup", "trigger", "more", "wanted"),
    [
        (HAND, HAND + 0.5, WAVERING, {}, TAKEN),  # hysteresis between its two levels
        (HAND, HAND + 0.5, 0.59 * PRESSED, {}, []),
        (HAND, np.full(200, 0.9), PRESSED, {}, []),
        (HAND, HAND * 0.98 + 0.5, PRESSED, {}, []),
        (HAND, np.where(TIMES < 0.815, 0.8 + HAND, 0.815), PRESSED, {}, []),
        (np.zeros(200), np.full(200, 0.15), PRESSED, {}, [("failed", "cup", 0.5)]),
        (HAND, np.full(200, 0.3), PRESSED, {"jar": HAND - 0.4}, [("grasp", "jar", 0.5), ("release", "jar", 1.6)]),
        (HAND, HAND + 0.5, PRESSED, {"lost": slice(100, 115)}, TAKEN),
        (HAND, HAND + 0.5, np.where(TIMES >= 0.5, 1.0, 0.0), {}, TAKEN[:1]),
    ],
    ids=["wavers", "too low", "stays", "slides", "falls out soon", "touched and stays", "of two the one that rides",
         "lost for a moment", "the recording does not end it"],
)  # fmt: skip
def test_what_rides_on_a_hand_with_a_pressed_trigger_is_taken(hand, cup, trigger, more, wanted):
    found, run = events(world(hand, cup, trigger, **more))
    assert found == wanted
    assert all((event.end is None) == (len(wanted) == 1) for event in run.events if event.name == "grasp")


def test_a_hand_without_buttons_is_counted_and_not_guessed():
    found, run = events(replace(world(HAND, HAND + 0.5, PRESSED), hands={}))
    assert found == [] and run.counters["no buttons recorded: hand-left"] == 1
