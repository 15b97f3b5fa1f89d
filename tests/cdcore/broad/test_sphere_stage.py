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


@pytest.mark.parametrize("offset", [0.0, 1e3, 1e7])
def test_approaching_ball_is_a_candidate_from_touching_on(offset):
    """Balls of radius 1 m; the smallest gap is 100 roundings of coordinates, ``offset`` m from the origin."""
    gaps = np.array([1.0, 1e-6, 100 * EPS * (2.0 + offset), 0.0])
    positions = np.zeros((4, 2, 3))
    positions[:, 0, 0], positions[:, 1, 0] = 2.0 + gaps + offset, offset
    verdict, tests = SphereStage([Sphere(np.zeros(3), 1.0)] * 2, FIRST_AND_SECOND).candidates(
        unrotated_motion(positions)
    )
    assert verdict[:, 0].tolist() == [Verdict.CLEAR] * 3 + [Verdict.CANDIDATE] and tests == 4


def test_a_pair_without_a_pose_is_not_tested():
    """Balls of radius 1 m: 9 m apart for ten frames, without a pose for ten, 0.5 m apart for ten."""
    positions, valid = np.zeros((30, 2, 3)), np.ones((30, 2), dtype=bool)
    positions[:10, 0, 0], positions[20:, 0, 0] = 9.0, 0.5
    valid[10:20, 0] = False
    verdict, tests = SphereStage([Sphere(np.zeros(3), 1.0)] * 2, FIRST_AND_SECOND).candidates(
        unrotated_motion(positions, valid=valid)
    )
    assert verdict[:, 0].tolist() == [Verdict.CLEAR] * 10 + [Verdict.NO_POSE] * 10 + [Verdict.CANDIDATE] * 10
    assert tests == 20


def test_spheres_decide_by_distance_of_placed_centres():
    """Four spheres, three pairs and 200 random poses; touching counts."""
    rng = np.random.default_rng(0)
    motion = Motion(np.arange(200), rng.normal(size=(200, 4, 3)), random_rotations(rng, 200, 4))
    spheres = [Sphere(centre, radius) for centre, radius in zip(rng.normal(size=(4, 3)), (0.5, 1, 1.5, 2), strict=True)]
    pairs = np.array([[2, 0], [1, 3], [0, 3]])
    placed = [
        place_points(ball.centre[None], motion.rotations[:, k], motion.translations[:, k])[:, 0]
        for k, ball in enumerate(spheres)
    ]
    verdict, _ = SphereStage(spheres, pairs).candidates(motion)
    for column, (a, b) in enumerate(pairs.tolist()):
        meet = np.linalg.norm(placed[a] - placed[b], axis=1) <= spheres[a].radius + spheres[b].radius
        assert 20 < meet.sum() < 180
        assert ((verdict[:, column] == Verdict.CANDIDATE) == meet).all()


@pytest.mark.parametrize("centre", [0.0, 1e3])
@pytest.mark.parametrize("away", [0.0, 1e3])
def test_tangent_spheres_stay_candidates_despite_rounding(centre, away):
    """Balls that touch but for rounding: far from the origin of their bodies, or with these far from the world's."""
    rng, count = np.random.default_rng(1), 3000
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    middle, rotations = np.array([centre, 0.0, 0.0]), random_rotations(rng, count, 2)
    positions = away - rotations @ middle
    positions[:, 1] += 2.0 * directions
    verdict, _ = SphereStage([Sphere(middle, 1.0)] * 2, FIRST_AND_SECOND).candidates(
        Motion(np.arange(count), positions, rotations)
    )
    assert (verdict == Verdict.CANDIDATE).all()


def test_tangent_spheres_stay_candidates_where_squares_underflow():
    """Balls of 1e-160 m that touch in 100 directions: squares of such lengths have lost most of their digits."""
    directions = np.random.default_rng(2).normal(size=(100, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    positions = 2e-160 * np.stack([np.zeros((100, 3)), directions], axis=1)
    verdict, _ = SphereStage([Sphere(np.zeros(3), 1e-160)] * 2, FIRST_AND_SECOND).candidates(
        unrotated_motion(positions)
    )
    assert (verdict == Verdict.CANDIDATE).all()
