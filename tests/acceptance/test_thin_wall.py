"""A 5 mm cube through a 1 mm plate at 90 Hz: frame by frame it is missed as often as arithmetic says, between frames
never; and what passes by is not reported.

The surfaces meet over 6 mm of the way. A step of s metres jumps over them from 1 - 0.006 / s of all phases.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.shapes import box_mesh

from cdcore import Body, Motion, Verdict, create_detector
from cdcore.protocol import counts_as_contact
from replay.studies.stress.scenes import crossing_motion

CUBE, PLATE = Body("cube", box_mesh((0.005,) * 3)), Body("plate", box_mesh((0.2, 0.2, 0.001)))
PHASES = (np.arange(1000) + 0.5) / 1000


def crossings(speed, aside=0.0):
    """1,000 crossings one after another, each from clear to clear; the motion, frames of each, and the last above."""
    motion = crossing_motion(speed, 1000, aside)
    frames = len(motion) // 1000
    return motion, frames, frames // 2 - 1


@pytest.mark.sampled(3)
@pytest.mark.parametrize(("speed", "missed"), [(0.4, 0), (0.6, 100), (1.0, 460), (2.0, 730), (4.0, 865)])
def test_frames_miss_what_arithmetic_predicts_and_intervals_nothing(speed, missed):
    """``speed`` in m/s; ``missed`` of 1,000 crossings: 1 - 0.006 / (speed / 90) of them, at least none."""
    motion, frames, before = crossings(speed)
    exact = create_detector("exact", (CUBE, PLATE)).detect(motion)
    visited = counts_as_contact(exact.verdict.reshape(1000, frames)).any(axis=1)
    assert 1000 - visited.sum() == missed
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


@pytest.mark.sampled(3)
@pytest.mark.parametrize(("speed", "rotations"), [(0.4, False), (4.0, False), (2.0, True)])
def test_a_thousand_near_passes_are_proven_clear_turning_or_not(speed, rotations):
    """The cube passes the rim of the plate, 0.1 m from its middle, by 3 micrometres to 1 mm."""
    # turning, nothing of the cube is further from its centre than half its diagonal across the axis it turns about
    reach = 0.0025 * (np.sqrt(2) if rotations else 1.0)
    motion, frames, _ = crossings(speed, 0.1 + reach + np.geomspace(3e-6, 1e-3, 1000))
    rotation = motion.rotations.copy()
    if rotations:
        rotation[:, 0] = np.tile(
            Rotation.from_euler("y", np.linspace(0, 1.5, frames)[:, None]).as_matrix(), (1000, 1, 1)
        )
    beside = Motion(motion.times, motion.translations, rotation, linked=motion.linked)
    verdict = create_detector("continuous", (CUBE, PLATE)).detect(beside).verdict.reshape(1000, frames)
    assert (verdict[:, 1:] == Verdict.CLEAR).all()
