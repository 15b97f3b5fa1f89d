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
CROSSINGS = 1000
PHASES = (np.arange(CROSSINGS) + 0.5) / CROSSINGS
"""Where the first touch of each crossing lies in its step, as a fraction of the way from frame to frame."""


def crossings(speed, aside=0.0):
    """1,000 crossings one after another, each from clear to clear, one of each of PHASES, at 90 Hz.

    The motion, the frames of each crossing, and the number of its first frame after the first touch. ``aside``: metres
    by which the cube passes the middle of the plate.
    """
    motion = crossing_motion(speed, CROSSINGS, aside)
    frames_each = len(motion) // CROSSINGS
    return motion, frames_each, frames_each // 2 - 1


MISSED_BY_SPEED = {0.4: 0, 0.6: 100, 1.0: 460, 2.0: 730, 4.0: 865}
"""Speed in m/s -> of 1,000 crossings those whose contact of 6 mm lies between two frames.

A step is speed / 90: 1 - 0.006 / (speed / 90) of the crossings, at least none.
"""


@pytest.mark.sampled(3)
@pytest.mark.parametrize(("speed", "missed"), MISSED_BY_SPEED.items())
def test_frames_miss_what_arithmetic_predicts(speed, missed):
    """A cube flies through a plate 1,000 times; ``exact`` tests frames at 90 Hz alone, and misses so many contacts.

    A contact is 6 mm of the way, a step speed / 90: it lies between two frames in 1 - 0.006 / step of the crossings.
    """
    motion, frames_each, _ = crossings(speed)
    verdict = create_detector("exact", (CUBE, PLATE)).detect(motion).verdict
    is_detected = counts_as_contact(verdict.reshape(CROSSINGS, frames_each)).any(axis=1)
    assert np.count_nonzero(~is_detected) == missed


@pytest.mark.sampled(3)
@pytest.mark.parametrize("speed", MISSED_BY_SPEED)
def test_intervals_miss_no_crossing_and_bracket_its_first_touch(speed):
    """A cube flies through a plate 1,000 times; ``continuous`` tests the way between frames, and reports each crossing.

    Its first touch lies between two moments a microsecond apart at most; by arithmetic it is 1 - phase of a step before
    the first frame after it. No frame is left open.
    """
    motion, frames_each, first_after = crossings(speed)
    detection = create_detector("continuous", (CUBE, PLATE)).detect(motion)
    verdict = detection.verdict.reshape(CROSSINGS, frames_each)
    assert (verdict[:, 1:] == Verdict.CONTACT).any(axis=1).all()
    assert not (verdict == Verdict.UNRESOLVED).any()
    assert len(detection.toi) == CROSSINGS

    frames_after = np.arange(CROSSINGS) * frames_each + first_after
    expected_s = (frames_after - (1 - PHASES)) / 90
    earliest_s, latest_s = np.array([detection.toi[frame, 0] for frame in frames_after.tolist()]).T
    rounding = 4 * np.spacing(expected_s)
    assert (earliest_s <= expected_s + rounding).all()
    assert (expected_s - rounding <= latest_s).all()
    assert (latest_s - earliest_s).max() <= 1e-6


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("speed", "rotates"),
    [
        pytest.param(0.4, False, id="slow"),
        pytest.param(4.0, False, id="fast"),
        pytest.param(2.0, True, id="rotating"),
    ],
)
def test_a_thousand_near_passes_are_proven_clear_turning_or_not(speed, rotates):
    """The cube passes the rim of the plate, 0.1 m from its middle, by 3 micrometres to 1 mm: no step is a contact.

    Where it rotates, by 1.5 rad about y in each crossing, its reach is half a diagonal of its face, else half an edge.
    """
    half_edge = 0.005 / 2
    reach = half_edge * (np.sqrt(2) if rotates else 1.0)
    gaps = np.geomspace(3e-6, 1e-3, CROSSINGS)
    motion, frames_each, _ = crossings(speed, aside=0.1 + reach + gaps)
    rotation = motion.rotations.copy()
    if rotates:
        angles = np.linspace(0, 1.5, frames_each)
        rotation[:, 0] = np.tile(Rotation.from_euler("y", angles[:, None]).as_matrix(), (CROSSINGS, 1, 1))
    beside = Motion(motion.times, motion.translations, rotation, linked=motion.linked)
    verdict = create_detector("continuous", (CUBE, PLATE)).detect(beside).verdict.reshape(CROSSINGS, frames_each)
    assert (verdict[:, 1:] == Verdict.CLEAR).all()
