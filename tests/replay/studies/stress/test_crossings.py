"""Frame by frame a thin wall is missed as often as arithmetic says; between frames every scene is as it says."""

import numpy as np
import pytest

from cdcore import Verdict, create_detector
from replay.studies.stress.crossings import OVER_INTERVALS, PHASES, SPEEDS, crossing, thin_wall


def first_scenes(number, count):
    return list(OVER_INTERVALS[number][1](np.random.default_rng(5)))[:count]


@pytest.mark.parametrize(("speed", "missed"), list(zip(SPEEDS, (0, 0.1, 0.46, 0.73, 0.865), strict=True)))
def test_instants_miss_the_share_of_phases_that_arithmetic_says(speed, missed):
    scene = list(thin_wall(np.random.default_rng(0)))[2 * SPEEDS.index(speed)]
    verdict = create_detector("exact", scene.bodies).detect(scene.motion).verdict.reshape(PHASES, -1)
    assert (verdict != Verdict.CONTACT).all(axis=1).mean() == pytest.approx(missed, abs=0.005 + 1e-9)


@pytest.mark.parametrize("number", [30, 31, 32, 33])
def test_continuous_agrees_with_every_scene(number):
    for scene in first_scenes(number, 10):
        verdict = create_detector("continuous", scene.bodies).detect(scene.motion).verdict
        assert (verdict == Verdict.CONTACT).any() == bool(scene.truth[0]), scene.name
        assert not (verdict == Verdict.UNRESOLVED).any(), scene.name


def test_every_case_of_motion_holds_contacts_and_misses():
    for number in OVER_INTERVALS:
        assert {0, 1} == set(np.concatenate([scene.truth for scene in first_scenes(number, 99)]).tolist())


def test_crossings_are_apart_at_both_ends_and_not_linked_to_each_other():
    motion = crossing(1.0, 7)
    height = motion.translations[:, 0, 2].reshape(7, -1)
    assert (height[:, 0] > 0.003).all() and (height[:, -1] < -0.003).all()
    assert not motion.linked.reshape(7, -1, 2)[:, 0].any() and motion.linked.reshape(7, -1, 2)[:, 1:].all()
