"""Effects of bodies at the limits: a single frame, two, a hand that is lost, a leap in every step, equal poses."""

from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import along_x, cube

from replay.engine import compute
from sessions import Session
from sessions.model.scene import Scene, SceneBody, SceneEffect
from sessions.model.session import HandTrack, Track

HAND_AND_POT = {"between": ["hand-left", "pot"]}
DECLARED = {
    "contact": HAND_AND_POT,
    "grasp": HAND_AND_POT,
    "breakage": {**HAND_AND_POT, "speed_m_s": 1.0},
    "burn-exposure": {**HAND_AND_POT, "threshold_c": 65.0, "seconds": 0.5, "surface_c": 80.0},
    "hazard-proximity": {"of": ["hand-left"], "hazard": "pot", "distance": 0.1},
}
"""Kind of effect -> how a scene declares it."""
FAR, NEAR = 3.0, 0.9
"""Metres from hand to pot, cubes of 1 m: apart, and in contact."""

WORLDS = {
    "one frame apart": ([FAR], None),
    "one frame in contact": ([NEAR], None),
    "two frames in contact": ([NEAR, NEAR], None),
    "in contact all the time": ([NEAR] * 40, None),
    "at the same place": ([0.0] * 40, None),
    "lost all the time": ([NEAR] * 40, [False] * 40),
    "lost in every other frame": ([FAR, NEAR] * 20, [True, False] * 20),
    "seen once": ([NEAR] * 40, [False] * 20 + [True] + [False] * 19),
    "a leap in every step": ([FAR, NEAR] * 20, None),
    "a kilometre away": ([1e3] * 40, None),
}
"""Name -> metres from hand to pot, frame by frame, and whether the hand is tracked there (``None``: always)."""


def session_of_hand_and_pot(positions, valid, kind):
    """A hand at these metres from a pot at rest, 11 ms a frame, in a scene with one kind of effect."""
    stamps = np.arange(len(positions)) * 11_000_000
    tracks = {
        "hand-left": Track(stamps, *along_x(positions), valid),
        "pot": Track(stamps, *along_x([0.0] * len(positions))),
    }
    bodies = (SceneBody("hand-left", tags=("hand", "left")), SceneBody("pot", extra={"mass": 0.2}))
    scene = Scene(bodies=bodies, effects=(SceneEffect(kind, DECLARED[kind]),))
    session = Session.from_tracks(tracks, {name: cube() for name in tracks}, scene)
    return replace(session, hands={"ann/left": HandTrack(stamps, np.ones(len(positions)))})


def effect_run(name, kind):
    """The result of an effect for a row of WORLDS."""
    positions, valid = WORLDS[name]
    return compute(session_of_hand_and_pot(positions, valid, kind), detectors=()).effects[kind]


@pytest.mark.sampled(6)
@pytest.mark.parametrize("name", WORLDS)
@pytest.mark.parametrize("kind", DECLARED)
def test_effect_at_its_limits_answers_with_finite_numbers(kind, name):
    """A hand (a cube of 1 m) and a pot at rest, tracked as a row of WORLDS says, never or in a single frame, for
    instance. Numbers are finite and times ascend, no frame is counted twice.

    Nothing is broken: leaps, losses and contacts from the start show no impact. Nothing is grasped: the pot rests.
    """
    run, frames = effect_run(name, kind), len(WORLDS[name][0])
    for event in run.events:
        numbers = [value for value in event.values.values() if not isinstance(value, str)]
        assert np.isfinite([event.time, *numbers]).all(), event
        assert event.end is None or event.end >= event.time
        assert event.name not in ("broken", "grasp")
    for series in run.series.values():
        assert np.isfinite(series.values).all()
        assert (np.diff(series.times) >= 0).all()
    for spans in run.output.lanes.values():
        assert all(span.start <= span.end for span in spans)
    assert run.frames == frames
    assert 0 <= run.frames_run <= frames


@pytest.mark.parametrize("name", ["lost all the time", "seen once", "a kilometre away"])
@pytest.mark.parametrize("kind", ["breakage", "burn-exposure"])
def test_breakage_and_burns_skip_frames_of_a_distant_hand(kind, name):
    """A hand tracked never or in one frame, and a hand 1 km from the pot: no frame is followed, and nothing happens."""
    run = effect_run(name, kind)
    assert run.frames_run == 0
    assert run.events == ()
