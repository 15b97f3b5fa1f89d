from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import along_x, cube

from replay.effects.grasp import is_riding
from replay.effects.inputs import BodyPoses
from replay.engine import compute
from sessions import Session
from sessions.model.scene import Scene, SceneBody, SceneEffect
from sessions.model.session import HandTrack, Status

STAMPS = np.arange(200) * 10_000_000
TIMES = STAMPS / 1e9
SCENE = Scene(
    bodies=(SceneBody("hand-left", tags=("hand", "left")), SceneBody("cup"), SceneBody("jar")),
    effects=tuple(SceneEffect("grasp", {"between": ["tag:hand", thing]}) for thing in ("cup", "jar")),
)
WITH_SHORT_WINDOW = replace(SCENE, effects=(SceneEffect("grasp", {"between": ["tag:hand", "cup"], "window_s": 0.095}),))
FAR_AWAY = np.full(200, 9.0)


def grasps_by_hand(hand, cup, trigger, jar=FAR_AWAY, lost=None, degrees=0.0, scene=SCENE):
    """The effect ``grasp`` of a hand with this trigger, 0 to 1, or none; 200 frames of 10 ms.

    ``hand``, ``cup``, ``jar``: metres on X, of cubes of 0.2 m; ``lost``: frames without a pose of the hand;
    ``degrees``: a second, by which the cup rotates.
    """
    half = np.radians(degrees) * TIMES / 2.0
    spin = np.column_stack([np.zeros((200, 2)), np.sin(half), np.cos(half)])
    poses = {"hand-left": along_x(hand), "cup": (along_x(cup)[0], spin), "jar": along_x(jar)}
    session = Session.from_arrays(STAMPS, poses, {name: cube(edge=0.2) for name in poses}, scene)
    if lost is not None:
        session.frames.status.setflags(write=True)
        session.frames.status[lost, 0] = Status.LOST
    hands = {} if trigger is None else {"ann/left": HandTrack(STAMPS, trigger)}
    return compute(replace(session, hands=hands), detectors=()).effects["grasp"]


HAND = np.clip(TIMES - 0.8, 0.0, 0.5)
"""Metres: it moves by 1 m/s from 0.8 to 1.3 s."""

PRESSED = np.where((TIMES >= 0.5) & (TIMES < 1.6), 1.0, 0.0)
WAVERING = np.where(PRESSED > 0, 0.7, 0.2) - 0.2 * ((TIMES > 0.9) & (TIMES < 1.2))
"""0.7 while it is pressed, but 0.5 from 0.9 to 1.2 s."""

GRASP_AND_RELEASE = [("grasp", "cup", 0.5), ("release", "cup", 1.6)]


@pytest.mark.parametrize(
    ("hand", "cup", "trigger", "more", "expected"),
    [
        (HAND, HAND + 0.5, WAVERING, {}, GRASP_AND_RELEASE),
        (HAND, HAND + 0.5, 0.59 * PRESSED, {}, []),
        (HAND, np.full(200, 0.9), PRESSED, {}, []),
        (HAND, HAND * 0.95 + 0.5, PRESSED, {}, []),
        (HAND, np.where(TIMES < 0.815, 0.8 + HAND, 0.815), PRESSED, {}, []),
        (np.zeros(200), np.full(200, 0.15), PRESSED, {}, [("failed", "cup", 0.5)]),
        (np.zeros(200), np.where((TIMES < 0.3) | (TIMES > 1.8), 0.15, 0.9), PRESSED, {}, []),
        (HAND, np.full(200, 0.3), PRESSED, {"jar": HAND - 0.4}, [("grasp", "jar", 0.5), ("release", "jar", 1.6)]),
        (HAND, HAND + 0.5, PRESSED, {"lost": slice(100, 115)}, GRASP_AND_RELEASE),
        (HAND, HAND + 0.5, np.where(TIMES >= 0.5, 1.0, 0.0), {}, GRASP_AND_RELEASE[:1]),
        (HAND, HAND + 0.5, None, {}, []),
    ],
    ids=["wavers between two levels", "too low", "stays", "slides", "falls out soon", "touched and stays",
         "touched before and after", "of two the one that rides",
         "lost for a moment", "the recording does not end it", "no buttons recorded"],
)  # fmt: skip
def test_body_is_grasped_until_the_trigger_is_released(hand, cup, trigger, more, expected):
    """The trigger is pressed from 0.5 to 1.6 s of 2 s, and counts from 0.6 up; the hand moves 0.5 m from 0.8 s on.

    ``cup``: metres on X in each frame; it rides with the hand where the distance stays. ``expected``: an event's name,
    body and second. A grasp lasts to its release, or has no end, moves 0.5 m, and its lane names the body.
    """
    effect = grasps_by_hand(hand, cup, trigger, **more)
    assert [(event.name, event.bodies[1], round(event.time, 2)) for event in effect.events] == expected
    is_released = any(name == "release" for name, _body, _time in expected)
    for event in effect.output.events_named("grasp"):
        assert event.end == (pytest.approx(1.6) if is_released else None)
        assert event.values["moved_m"] == pytest.approx(0.5, abs=0.01) and not event.values["touching"]
        end_s = 1.6 if is_released else 2.0
        assert event.values["held_s"] == pytest.approx(end_s - event.time, abs=0.03)
        assert effect.output.lanes["hand-left"][0].word == event.bodies[1]
    assert effect.counters.get("no buttons recorded: hand-left", 0) == (trigger is None)


@pytest.mark.parametrize(
    ("slides_mm_s", "degrees_s", "grasps"),
    [(21, 0, 1), (23, 0, 0), (0, 21, 1), (0, 23, 0)],
    ids=["slides 1.9 mm", "slides 2.1 mm", "rotates 1.9 degrees", "rotates 2.1 degrees"],
)
def test_body_sliding_or_rotating_in_the_hand_is_not_grasped(slides_mm_s, degrees_s, grasps):
    """A cup moves with the hand while the trigger is pressed, but slides in it, or rotates.

    2 mm and 2 degrees are allowed in a window of 95 ms, nine frames of 10 ms; so 22 in a second.
    """
    cup = HAND + 0.5 + 1e-3 * slides_mm_s * TIMES
    effect = grasps_by_hand(HAND, cup, PRESSED, degrees=degrees_s, scene=WITH_SHORT_WINDOW)
    assert len(effect.output.events_named("grasp")) == grasps


def test_the_longer_of_two_intervals_is_the_grasp():
    """The trigger is pressed from 0.5 to 1.6 s; the cup rides with the moving hand until 0.7 s, and from 0.75 to 0.9 s.

    It slips between and after; a grasp takes more than 0.1 s (``held_s``). The first interval is the longer: from 0.5
    to 0.7 s, less a window of 20 ms, in which it slips.
    """
    limits = {"between": ["tag:hand", "cup"], "window_s": 0.02, "held_s": 0.1}
    scene = replace(SCENE, effects=(SceneEffect("grasp", limits),))
    slipped_m = np.interp(TIMES, [0.7, 0.75, 0.9, 2.0], [0.0, 0.1, 0.1, 1.2])
    hand = TIMES  # metres: 1 m/s
    (grasp,) = grasps_by_hand(hand, hand + 0.5 - slipped_m, PRESSED, scene=scene).output.events_named("grasp")
    assert grasp.values["held_s"] == pytest.approx(0.7 - 0.5 - 0.02, abs=0.015)


def rides_by_frame(xs, window_s, spread_m):
    """Whether a thing at these places along x in a hand's frame, 10 ms apart, rides with it, by frame."""
    times = 3.0 + np.arange(len(xs)) * 0.01
    points = np.column_stack([xs, np.zeros((len(xs), 2))])
    every_frame = np.ones(len(xs), dtype=bool)
    relative = BodyPoses(times, points, np.tile(np.eye(3), (len(xs), 1, 1)), every_frame, every_frame)
    return is_riding(relative, {"window_s": window_s, "spread_m": spread_m, "spread_rad": 0.1}).tolist()


def test_a_slide_within_the_window_ends_riding():
    """A thing slides 1 mm in a frame of 10 ms: in a window of 45 ms, four frames, by 4 mm, just allowed, or just not.

    A frame rides by the window that starts at it; of the last four windows the recording has only a part, in which the
    thing slides less.
    """
    slide_m = np.arange(20) * 1e-3
    assert rides_by_frame(slide_m, window_s=0.045, spread_m=4.01e-3) == [True] * 20
    assert rides_by_frame(slide_m, window_s=0.045, spread_m=3.99e-3) == [False] * 16 + [True] * 4


def test_window_of_whole_frames_contains_its_last_frame():
    """A thing slides 1 mm in a frame: a window of 0.04 s is four frames of 0.01 s, however float64 rounds its ends.

    So 4 mm count against the 3.99 mm allowed; the four last windows, cut off by the end of the recording, slide less.
    """
    slide_m = np.arange(20) * 1e-3
    assert rides_by_frame(slide_m, window_s=0.04, spread_m=3.99e-3) == [False] * 16 + [True] * 4


@pytest.mark.parametrize(
    ("hz", "millimetres", "seeds"),
    [(30, 0.3, 2), (90, 0.1, 2), *(pytest.param(hz, 0.3, 10, marks=pytest.mark.slow) for hz in (30, 90, 250))],
)
def test_a_noisy_grasp_is_detected_at_every_frame_rate(hz, millimetres, seeds):
    """A cup is grasped from 0.5 to 1.6 s and moves with the hand; a jar stays far away.

    Positions have noise of so many ``millimetres``; ``hz``: frames a second; ``seeds``: how many draws of the noise.
    """
    stamps = np.round(np.arange(2 * hz) * 1e9 / hz).astype(np.int64)
    times = stamps / 1e9
    hand = np.clip(times - 0.8, 0.0, 0.5)
    press_s, release_s = 0.5, 1.6
    trigger = np.where((times >= press_s) & (times < release_s), 1.0, 0.0)
    for seed in range(seeds):
        random = np.random.default_rng(seed)
        poses = {}
        for name, path in (("hand-left", hand), ("cup", hand + 0.5), ("jar", np.full(len(times), 9.0))):
            positions, rotations = along_x(path)
            poses[name] = positions + random.normal(0.0, 1e-3 * millimetres, positions.shape), rotations
        session = Session.from_arrays(stamps, poses, {name: cube(edge=0.2) for name in poses}, SCENE)
        session = replace(session, hands={"ann/left": HandTrack(stamps, trigger)})
        (grasp,) = compute(session, detectors=()).effects["grasp"].output.events_named("grasp")
        assert grasp.bodies[1] == "cup", seed
        # Poses are averaged over a window of 0.1 s.
        assert grasp.values["held_s"] == pytest.approx(release_s - press_s, abs=0.12), seed
