"""The sphere stage rejects no pair that touches, and every pair that is apart by more than rounding."""

import numpy as np
import pytest
from support.shapes import random_rotations, unrotated_motion

from cdcore import Motion, Verdict
from cdcore.bounding.bounding_sphere import Sphere
from cdcore.broad.sphere_stage import SphereStage
from cdcore.poses import place_points
from cdcore.tolerances import EPS

FIRST_AND_SECOND = np.array([[0, 1]])
"""Bodies of the only pair."""


@pytest.mark.parametrize("offset", [0.0, 1e3, 1e7], ids="{:g} m from the origin".format)
def test_approaching_ball_is_a_candidate_from_touching_on(offset):
    """Two balls of radius 1 m in four frames, apart by 1 m, 1 micrometre, 100 roundings of their coordinates, and 0."""
    gaps = np.array([1.0, 1e-6, 100 * EPS * (2.0 + offset), 0.0])
    positions = np.zeros((4, 2, 3))
    positions[:, 0, 0], positions[:, 1, 0] = 2.0 + gaps + offset, offset
    verdict, tests = SphereStage([Sphere(np.zeros(3), 1.0)] * 2, FIRST_AND_SECOND).candidates(
        unrotated_motion(positions)
    )
    assert verdict[:, 0].tolist() == [Verdict.CLEAR, Verdict.CLEAR, Verdict.CLEAR, Verdict.CANDIDATE]
    assert tests == 4, "one a frame"


def test_a_pair_without_a_pose_is_not_tested():
    """Balls of radius 1 m: 9 m apart for ten frames, without a pose for ten, 0.5 m apart for ten."""
    positions, valid = np.zeros((30, 2, 3)), np.ones((30, 2), dtype=bool)
    positions[:10, 0, 0], positions[20:, 0, 0] = 9.0, 0.5
    valid[10:20, 0] = False
    verdict, tests = SphereStage([Sphere(np.zeros(3), 1.0)] * 2, FIRST_AND_SECOND).candidates(
        unrotated_motion(positions, valid=valid)
    )
    assert verdict[:, 0].tolist() == [Verdict.CLEAR] * 10 + [Verdict.NO_POSE] * 10 + [Verdict.CANDIDATE] * 10
    assert tests == 20, "frames with both poses"


def test_spheres_decide_by_distance_of_placed_centres():
    """Four spheres, three pairs and 200 random poses: candidates are as near as the sum of their radii."""
    rng = np.random.default_rng(0)
    motion = Motion(np.arange(200), rng.normal(size=(200, 4, 3)), random_rotations(rng, 200, 4))
    spheres = [Sphere(centre, radius) for centre, radius in zip(rng.normal(size=(4, 3)), (0.5, 1, 1.5, 2), strict=True)]
    pairs = np.array([[2, 0], [1, 3], [0, 3]])
    centres = [
        place_points(ball.centre[None], motion.rotations[:, k], motion.translations[:, k])[:, 0]
        for k, ball in enumerate(spheres)
    ]
    verdict, _count_of_tests = SphereStage(spheres, pairs).candidates(motion)
    for column, (a, b) in enumerate(pairs.tolist()):
        meet = np.linalg.norm(centres[a] - centres[b], axis=1) <= spheres[a].radius + spheres[b].radius
        assert 20 < meet.sum() < 180, "both answers are frequent"
        assert ((verdict[:, column] == Verdict.CANDIDATE) == meet).all(), column


@pytest.mark.parametrize("centre", [0.0, 1e3], ids="centre {:g} m from its body".format)
@pytest.mark.parametrize("away", [0.0, 1e3], ids="bodies {:g} m from the origin".format)
def test_tangent_spheres_stay_candidates_despite_rounding(centre, away):
    """Two balls of radius 1 m, in 3,000 random rotations, whose centres are placed 2 m apart but for rounding."""
    rng, count = np.random.default_rng(1), 3000
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    middle, rotations = np.array([centre, 0.0, 0.0]), random_rotations(rng, count, 2)
    positions = away - rotations @ middle
    positions[:, 1] += 2.0 * directions
    verdict, _count_of_tests = SphereStage([Sphere(middle, 1.0)] * 2, FIRST_AND_SECOND).candidates(
        Motion(np.arange(count), positions, rotations)
    )
    assert (verdict == Verdict.CANDIDATE).all()


def test_tangent_spheres_stay_candidates_where_squares_underflow():
    """Balls of 1e-160 m that touch in 100 directions: squares of such lengths have lost most of their digits."""
    directions = np.random.default_rng(2).normal(size=(100, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    positions = 2e-160 * np.stack([np.zeros((100, 3)), directions], axis=1)
    verdict, _count_of_tests = SphereStage([Sphere(np.zeros(3), 1e-160)] * 2, FIRST_AND_SECOND).candidates(
        unrotated_motion(positions)
    )
    assert (verdict == Verdict.CANDIDATE).all()
