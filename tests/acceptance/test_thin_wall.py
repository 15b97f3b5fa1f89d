"""A 5 mm cube through a 1 mm plate at 90 Hz: frame by frame it is missed as often as arithmetic says, between frames
never; and what passes by is not reported.

The surfaces meet over 6 mm of the way. A step of s metres jumps over them from 1 - 0.006 / s of all phases.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.shapes import box_mesh

import replay
from cdcore import Body, Motion, Verdict, create_detector
from cdcore.protocol import counts_as_contact
from replay.comparison.outcome import Outcome
from replay.studies.stress.scenes import crossing
from sessions import Session
from sessions.geometry.shapes import make_shape

CUBE, PLATE = Body("cube", box_mesh((0.005,) * 3)), Body("plate", box_mesh((0.2, 0.2, 0.001)))
SIZES = (("plate", 0.2, 0.001), ("cube", 0.005, 0.005))
PHASES = (np.arange(1000) + 0.5) / 1000
REACH = 0.003
"""Half the cube and half the plate, metres: the surfaces meet while the centres are no further apart."""


def crossings(speed, aside=0.0):
    """1,000 crossings one after another, each from clear to clear; the motion, frames of each, and the last above."""
    motion = crossing(speed, 1000, aside)
    frames = len(motion) // 1000
    return motion, frames, frames // 2 - 1


@pytest.mark.parametrize(("speed", "missed"), [(0.4, 0), (0.6, 100), (1.0, 460), (2.0, 730), (4.0, 865)])
def test_frame_by_frame_misses_what_arithmetic_says_and_between_frames_nothing(speed, missed):
    motion, frames, before = crossings(speed)
    exact = create_detector("exact", (CUBE, PLATE)).detect(motion)
    seen = counts_as_contact(exact.verdict.reshape(1000, frames)).any(axis=1)
    assert 1000 - seen.sum() == missed
    detection = create_detector("continuous", (CUBE, PLATE)).detect(motion)
    verdict = detection.verdict.reshape(1000, frames)
    assert (verdict[:, 1:] == Verdict.CONTACT).any(axis=1).all()
    assert not (verdict == Verdict.UNRESOLVED).any()
    # frame `before` lies a share 1 - phase of a step below the first touch
    touch = (np.arange(1000) * frames + before - (1 - PHASES)) / 90
    times = np.array([detection.toi[k * frames + before, 0] for k in range(1000)])
    assert len(detection.toi) == 1000
    rounding = 4 * np.spacing(touch)
    assert (times[:, 0] <= touch + rounding).all()
    assert (touch - rounding <= times[:, 1]).all()
    assert (times[:, 1] - times[:, 0]).max() <= 1e-6


@pytest.mark.parametrize(("speed", "turns"), [(0.4, False), (4.0, False), (2.0, True)])
def test_a_thousand_near_passes_are_proven_clear_turning_or_not(speed, turns):
    # turning, nothing of the cube is further from its centre than half its diagonal across the axis it turns about
    reach = 0.0025 * (np.sqrt(2) if turns else 1.0)
    motion, frames, _ = crossings(speed, 0.1 + reach + np.geomspace(3e-6, 1e-3, 1000))
    turn = motion.rotations.copy()
    if turns:
        turn[:, 0] = np.tile(Rotation.from_euler("y", np.linspace(0, 1.5, frames)[:, None]).as_matrix(), (1000, 1, 1))
    beside = Motion(motion.times, motion.translations, turn, linked=motion.linked)
    verdict = create_detector("continuous", (CUBE, PLATE)).detect(beside).verdict.reshape(1000, frames)
    assert (verdict[:, 1:] == Verdict.CLEAR).all()


def test_a_run_with_continuous_as_oracle_names_the_miss_between_two_frames():
    count = 9
    upright, rest = np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)), np.zeros((count, 3))
    fall = rest.copy()
    fall[:, 1] = 0.0496 - 0.0111 * np.arange(count)
    shapes = {name: make_shape("box", {"x": x, "y": y, "z": x}) for name, x, y in SIZES}
    stamps = (np.arange(count) * 1e9 / 90).astype(np.int64)
    session = Session.from_arrays(stamps, {"plate": (rest, upright), "cube": (fall, upright)}, meshes=shapes)
    result = replay.run(session, detectors="exact", oracle="continuous")
    (miss,) = result.misses["exact"]
    assert (miss.first, miss.last, miss.kind) == (5, 5, "never found")
    ((low, high),) = result.detections["continuous"].toi.values()
    assert low <= (0.0496 - REACH) / 0.0111 / 90 + 1e-9
    assert high >= (0.0496 - REACH) / 0.0111 / 90 - 1e-9
    turned_round = replay.run(session, detectors="continuous", oracle="exact")
    outcome = turned_round.comparisons["continuous"].outcome[:, 0]
    assert (outcome[5], set(outcome[np.arange(count) != 5])) == (Outcome.BETWEEN_FRAMES, {Outcome.NEITHER})


@pytest.mark.slow
def test_of_intervals_that_survive_the_spheres_fewer_than_one_in_a_hundred_stay_open():
    rng = np.random.default_rng(2026)
    bodies = [CUBE, PLATE, Body("brick", box_mesh((0.03, 0.02, 0.05))), Body("bar", box_mesh((0.2, 0.004, 0.004)))]
    frames = 6000
    time = np.arange(frames) / 90
    place, turn = np.zeros((frames, 4, 3)), np.empty((frames, 4, 3, 3))
    for body in range(4):
        rate, phase = rng.uniform(0.2, 3, (3, 3)), rng.uniform(0, 6.28, (3, 3))
        place[:, body] = 0.02 * np.sin(time[:, None, None] * 6.28 * rate + phase).sum(axis=2)
        place[:, body] += rng.normal(scale=1.4e-4, size=(frames, 3))
        q = np.column_stack([np.sin(time[:, None] * rate[0] + phase[0]), 1 + 0 * time])
        q /= np.linalg.norm(q, axis=1, keepdims=True)
        turn[:, body] = Motion.from_quaternions(time, place[:, :1], q[:, None]).rotations[:, 0]
    detection = create_detector("continuous", bodies).detect(Motion(time, place, turn))
    verdict = detection.verdict
    assert detection.work["searched"] > 10_000
    assert (verdict == Verdict.CONTACT).any()
    open_ = int((verdict == Verdict.UNRESOLVED).sum())
    assert open_ == detection.work["unresolved"] <= 0.01 * detection.work["searched"]
    assert all(verdict[place] == Verdict.UNRESOLVED for place in detection.reasons)
    assert len(detection.reasons) == open_
