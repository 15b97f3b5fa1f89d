"""What a scene says of itself is so: exact agrees with all face pairs, and cases hold both answers."""

import numpy as np
import pytest

from cdcore import Verdict, create_detector
from replay.studies.stress.scenes import AT_INSTANTS, degenerate, meeting, resting


def scenes(number, seed=7):
    return list(AT_INSTANTS[number][1](np.random.default_rng(seed)))


@pytest.mark.parametrize("number", AT_INSTANTS)
def test_exact_is_right_on_every_frame_of_every_scene(number):
    for scene in scenes(number):
        verdict = create_detector("exact", scene.bodies).detect(scene.motion).verdict[:, 0]
        assert np.array_equal(verdict, scene.truth), scene.name
        assert len(scene.truth) == len(scene.motion)


@pytest.mark.parametrize("number", [37, 38, 39, 41])
def test_cases_of_contact_hold_frames_with_and_without(number):
    truth = np.concatenate([scene.truth for scene in scenes(number)])
    assert {Verdict.CLEAR, Verdict.CONTACT} == set(truth.tolist())


def test_the_same_seed_makes_the_same_worlds_and_another_other_ones():
    first, again, other = (scenes(41, seed)[0].motion.translations for seed in (1, 1, 2))
    assert np.array_equal(first, again) and not np.array_equal(first, other)


def test_a_lifted_glass_is_clear_as_it_stands_and_a_sunk_one_meets_the_table():
    for scene in resting(np.random.default_rng(0)):
        assert (scene.truth[0] == Verdict.CONTACT) == (float(scene.name.split()[2]) <= 0), scene.name


def test_icospheres_kiss_in_36_face_pairs():
    (kiss,) = (scene for scene in degenerate(np.random.default_rng(0)) if "kissing" in scene.name)
    assert len(meeting(kiss.bodies, kiss.motion, 0)) == 36
