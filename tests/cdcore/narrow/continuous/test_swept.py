"""Faces and boxes that are said to stay apart never meet; at rest, faces that are apart are always found so."""

import numpy as np
import pytest
from support.random_worlds import KINDS, random_walk_of_rotations
from support.shapes import ball_mesh, shift_mesh

from cdcore.bounding.bounding_sphere import Sphere, sphere_best
from cdcore.kernels.compiling import kernel
from cdcore.narrow.continuous.motion_segments import legs_of, pose_at
from cdcore.narrow.continuous.swept import SweptSpheres, faces_stay_separated
from cdcore.triangles.decide import triangles_intersect


@kernel
def certainly_separate(corners, margin):
    """Whether two moving triangles are proven to stay apart, from compiled code."""
    return faces_stay_separated(corners, margin)


def corners_of(before, after, other):
    """The corners of a triangle before and after its motion, and of one at rest, as one row."""
    return np.concatenate([before.ravel(), after.ravel(), other.ravel()])


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_faces_reported_separate_never_meet(kind):
    """A face moves straight from one random place to another beside a face at rest: 400 such moves.

    Where they are proven to stay apart, which is in more than 40, they do not meet at 33 instants of the move.
    """
    rng = np.random.default_rng(5)
    proven_separate = 0
    for _ in range(400):
        before, after = KINDS[kind](rng)[rng.integers(0, 12, 2)]
        at_rest = KINDS[kind](rng)[3] + rng.integers(-2, 3, 3)
        if not certainly_separate(corners_of(before, after, at_rest), 1e-12):
            continue
        proven_separate += 1
        fraction = np.linspace(0, 1, 33)[:, None, None]
        moving = (1 - fraction) * before + fraction * after
        assert not triangles_intersect(np.stack([moving, np.broadcast_to(at_rest, moving.shape)], axis=1)).any()
    assert proven_separate > 40


PAIRS = np.array([[0, 1], [2, 1], [0, 2]])
"""Of three bodies."""


def spheres_and_random_poses(seed, frames=120):
    """Bounding spheres of three bodies, and their rotations and positions, anew in each frame."""
    rng = np.random.default_rng(seed)
    meshes = [ball_mesh(0.1), shift_mesh(ball_mesh(0.05), (0.3, 0, 0)), shift_mesh(ball_mesh(0.2), (0, -0.5, 0.2))]
    rotation = np.stack([random_walk_of_rotations(rng, frames, step=1.5) for _ in meshes], axis=1)
    move = rng.normal(size=(frames, 3, 3)) * 0.4
    return [sphere_best(mesh) for mesh in meshes], rotation, move


def centre_at(sphere, rotation, move, frame, body, fraction):
    """The centre of a body's sphere at a fraction of the leg to a frame."""
    pose = np.empty(12)
    pose_at(legs_of(rotation[:, body], move[:, body], np.array([frame]))[:, 0], fraction, pose)
    return pose[:9].reshape(3, 3) @ sphere.centre + pose[9:]


def test_spheres_of_a_leg_that_is_not_near_never_meet():
    """Bounding spheres of three bodies in 60 frames; a leg is the move from a frame to the next, on a line and an arc.

    ``may_meet`` answers for the leg before each frame but the first; where it says no, the spheres are apart at seven
    instants of the leg.
    """
    spheres, rotation, move = spheres_and_random_poses(seed=0, frames=60)
    requested = np.ones((len(rotation), 3), dtype=bool)
    requested[0] = False
    near = SweptSpheres(spheres).may_meet(rotation, move, np.ones(rotation.shape[:2], bool), PAIRS, requested)
    assert 0.05 < near[1:].mean() < 0.95, "both answers are frequent"
    for frame, column in np.argwhere(requested & ~near).tolist():
        i, j = PAIRS[column]
        for fraction in np.linspace(0, 1, 7):
            first, second = (centre_at(spheres[k], rotation, move, frame, k, fraction) for k in (i, j))
            assert np.linalg.norm(first - second) > spheres[i].radius + spheres[j].radius, (frame, column, fraction)


@pytest.mark.parametrize(
    ("gap", "height", "is_near"),
    [
        pytest.param(1e-9, 0.0, False, id="1 nm apart"),
        pytest.param(-1e-9, 0.0, True, id="1 nm deep"),
        pytest.param(1e-6, 1e6, True, id="1 um apart, 1,000 km away"),
        pytest.param(1e-4, 1e6, False, id="0.1 mm apart, 1,000 km away"),
    ],
)
def test_passing_spheres_are_near_by_rounding_only(gap, height, is_near):
    """A sphere of 1 m passes another along x; their centres, at y = 2 and 5 + gap - 1 m, come 2 m and the gap near.

    1,000 km from the origin micrometres are lost.
    """
    spheres = [Sphere(np.array([0.0, 2.0, 0.0]), 1.0), Sphere(np.array([0.0, -1.0, 0.0]), 1.0)]
    moves = np.array([[(-3, 0, height), (0, 5 + gap, height)], [(3, 0, height), (0, 5 + gap, height)]])
    rotations, valid = np.tile(np.eye(3), (2, 2, 1, 1)), np.ones((2, 2), bool)
    requested = np.array([[False], [True]])
    answer = SweptSpheres(spheres).may_meet(rotations, moves, valid, np.array([[0, 1]]), requested)
    assert answer.tolist() == [[False], [is_near]]


def test_skipped_legs_are_not_near_and_invalid_poses_harmless():
    """Three bodies in 120 frames, and requests for some legs only, before frames 20 to 29, and 60 to 69 of pair 0.

    Body 2 has no pose in frames 40 to 49, where its numbers are NaN and infinite: they raise no floating-point error.
    """
    spheres, rotation, move = spheres_and_random_poses(seed=1)
    valid = np.ones(rotation.shape[:2], dtype=bool)
    valid[40:50, 2] = False
    rotation[40:50, 2], move[40:50, 2] = np.nan, np.inf
    requested = np.zeros((len(rotation), 3), dtype=bool)
    requested[20:30] = True
    requested[60:70, 0] = True
    with np.errstate(all="raise"):
        near = SweptSpheres(spheres).may_meet(rotation, move, valid, PAIRS, requested)
    assert near.any()
    assert not near[~requested].any()
