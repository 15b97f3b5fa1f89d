"""Effects of bodies at the limits: one frame, two, nobody there, everybody lost, a leap in every step, equal poses."""

from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import along_x, cube

from replay.engine import compute
from sessions import Session
from sessions.model.scene import Scene, SceneBody, SceneEffect
from sessions.model.session import HandTrack, Track

TWO = {"between": ["hand-left", "pot"]}
DECLARED = {
    "contact": TWO,
    "grasp": TWO,
    "breakage": {**TWO, "speed_m_s": 1.0},
    "burn-exposure": {**TWO, "threshold_c": 65.0, "seconds": 0.5, "surface_c": 80.0},
    "hazard-proximity": {"of": ["hand-left"], "hazard": "pot", "distance": 0.1},
}
FAR, NEAR = 3.0, 0.9

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


def world(positions, valid, kind):
    """A hand that comes to a pot at rest, in a scene with one kind of effect."""
    stamps = np.arange(len(positions)) * 11_000_000
    tracks = {
        "hand-left": Track(stamps, *along_x(positions), valid),
        "pot": Track(stamps, *along_x([0.0] * len(positions))),
    }
    bodies = (SceneBody("hand-left", tags=("hand", "left")), SceneBody("pot", extra={"mass": 0.2}))
    scene = Scene(bodies=bodies, effects=(SceneEffect(kind, DECLARED[kind]),))
    session = Session.from_tracks(tracks, {name: cube() for name in tracks}, scene)
    return replace(session, hands={"ann/left": HandTrack(stamps, np.ones(len(positions)))})


@pytest.mark.sampled(6)
@pytest.mark.parametrize("name", WORLDS)
@pytest.mark.parametrize("kind", DECLARED)
def test_effect_at_its_limits_answers_with_finite_numbers(kind, name):
    """Rows of WORLDS: metres from hand to pot, frame by frame, and where the hand is tracked; nothing breaks there.

    Breakage and burns follow no frame where the hand is tracked once or never, or is a kilometre away.
    """
    run = compute(world(*WORLDS[name], kind), detectors=()).effects[kind]
    for event in run.events:
        numbers = [value for value in event.values.values() if not isinstance(value, str)]
        assert np.isfinite([event.time, *numbers]).all(), event
        assert event.end is None or event.end >= event.time
        assert event.name not in ("broken", "grasp")
    for series in run.series.values():
        assert np.isfinite(series.values).all() and (np.diff(series.times) >= 0).all()
    for spans in run.output.lanes.values():
        assert all(span.start <= span.end for span in spans)
    assert 0 <= run.frames_run <= run.frames == len(WORLDS[name][0])
    if name in ("lost all the time", "seen once", "a kilometre away") and kind in ("breakage", "burn-exposure"):
        assert run.frames_run == 0 and run.events == ()
