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
def stay_apart(corners, margin):
    """Whether two moving triangles are proven to stay apart, from compiled code."""
    return faces_stay_separated(corners, margin)


def corners_of(before, after, other):
    """The corners of a triangle before and after its motion, and of one at rest, as one row."""
    return np.concatenate([before.ravel(), after.ravel(), other.ravel()])


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_faces_reported_separate_never_meet(kind):
    """Face ``before`` moves straight to ``after``; sampled at 33 instants it must not meet ``other``."""
    rng = np.random.default_rng(5)
    dismissed = 0
    for _ in range(400):
        before, after = KINDS[kind](rng)[rng.integers(0, 12, 2)]
        other = KINDS[kind](rng)[3] + rng.integers(-2, 3, 3)
        if not stay_apart(corners_of(before, after, other), 1e-12):
            continue
        dismissed += 1
        direction = np.linspace(0, 1, 33)[:, None, None]
        placed = (1 - direction) * before + direction * after
        assert not triangles_intersect(np.stack([placed, np.broadcast_to(other, placed.shape)], axis=1)).any()
    assert dismissed > 40


PAIRS = np.array([[0, 1], [2, 1], [0, 2]])


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


def test_on_a_dismissed_leg_the_spheres_meet_at_no_time():
    """Legs are moves from frame to frame; a dismissed one is sampled at seven instants."""
    spheres, rotation, move = spheres_and_random_poses(seed=0, frames=60)
    requested = np.ones((len(rotation), 3), dtype=bool)
    requested[0] = False
    near = SweptSpheres(spheres).may_meet(rotation, move, np.ones(rotation.shape[:2], bool), PAIRS, requested)
    assert 0.05 < near[1:].mean() < 0.95
    for frame, column in np.argwhere(requested & ~near).tolist():
        i, j = PAIRS[column]
        for fraction in np.linspace(0, 1, 7):
            directions = [centre_at(spheres[k], rotation, move, frame, k, fraction) for k in (i, j)]
            assert np.linalg.norm(directions[0] - directions[1]) > spheres[i].radius + spheres[j].radius


@pytest.mark.parametrize(
    ("gap", "far", "near"),
    [(1e-9, 0.0, False), (-1e-9, 0.0, True), (1e-6, 1e6, True), (1e-4, 1e6, False)],
)
def test_passing_spheres_are_near_by_rounding_only(gap, far, near):
    """Spheres of 1 m beside the origins of their bodies, ``gap`` apart in passing; at 1,000 km micrometres are lost.

    In passing one is at y = 2 m, the other at 5 + gap - 1 m.
    """
    spheres = [Sphere(np.array([0.0, 2.0, 0.0]), 1.0), Sphere(np.array([0.0, -1.0, 0.0]), 1.0)]
    moves = np.array([[(-3, 0, 0), (0, 5 + gap, 0)], [(3, 0, 0), (0, 5 + gap, 0)]])
    moves[..., 2] = far
    still = np.tile(np.eye(3), (2, 2, 1, 1))
    requested = np.array([[False], [True]])
    answer = SweptSpheres(spheres).may_meet(still, moves, np.ones((2, 2), bool), np.array([[0, 1]]), requested)
    assert answer.tolist() == [[False], [near]]


def test_skipped_legs_are_not_near_and_invalid_poses_harmless():
    """Requested are frames 20 to 29, and 60 to 69 of the first pair; body 2 is NaN in 40 to 49."""
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
