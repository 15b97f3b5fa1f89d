"""Faces and boxes that are said to stay apart never meet; at rest, faces that are apart are always found so."""

import numpy as np
import pytest
from support.motions import KINDS, turned_by
from support.shapes import ball_mesh, moved

from cdcore.bounding.bounding_sphere import sphere_best
from cdcore.kernels.compiling import kernel
from cdcore.narrow.continuous.motion_segments import legs_of, pose_at
from cdcore.narrow.continuous.swept import faces_stay_separated
from cdcore.narrow.continuous.swept_spheres import SweptSpheres
from cdcore.narrow.triangles.predicates import triangles_intersect


@kernel
def stay_apart(corners, margin):
    return faces_stay_separated(corners, margin)


def corners_of(before, after, other):
    return np.concatenate([before.ravel(), after.ravel(), other.ravel()])


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_faces_said_to_stay_apart_meet_at_no_time(kind):
    rng = np.random.default_rng(5)
    said = 0
    for _ in range(400):
        before, after = KINDS[kind](rng)[rng.integers(0, 12, 2)]
        other = KINDS[kind](rng)[3] + rng.integers(-2, 3, 3)
        if not stay_apart(corners_of(before, after, other), 1e-12):
            continue
        said += 1
        way = np.linspace(0, 1, 33)[:, None, None]
        placed = (1 - way) * before + way * after
        assert not triangles_intersect(np.stack([placed, np.broadcast_to(other, placed.shape)], axis=1)).any()
    assert said > 40


PAIRS = np.array([[0, 1], [2, 1], [0, 2]])


def scene(seed, frames=120):
    rng = np.random.default_rng(seed)
    meshes = [ball_mesh(0.1), moved(ball_mesh(0.05), (0.3, 0, 0)), moved(ball_mesh(0.2), (0, -0.5, 0.2))]
    turn = np.stack([turned_by(rng, frames, 1.5) for _ in meshes], axis=1)
    move = rng.normal(size=(frames, 3, 3)) * 0.4
    return [sphere_best(mesh) for mesh in meshes], turn, move


def centre_at(sphere, turn, move, frame, body, share):
    pose = np.empty(12)
    pose_at(legs_of(turn[:, body], move[:, body], np.array([frame]))[:, 0], share, pose)
    return pose[:9].reshape(3, 3) @ sphere.centre + pose[9:]


def test_on_a_dismissed_leg_the_spheres_meet_at_no_time():
    spheres, turn, move = scene(0)
    asked = np.ones((len(turn), 3), dtype=bool)
    asked[0] = False
    near = SweptSpheres(spheres).may_meet(turn, move, np.ones(turn.shape[:2], bool), PAIRS, asked)
    assert 0.05 < near[1:].mean() < 0.95
    for frame, column in np.argwhere(asked & ~near).tolist():
        i, j = PAIRS[column]
        for share in np.linspace(0, 1, 17):
            ways = [centre_at(spheres[k], turn, move, frame, k, share) for k in (i, j)]
            assert np.linalg.norm(ways[0] - ways[1]) > spheres[i].radius + spheres[j].radius


def test_legs_that_are_not_asked_about_are_not_near_and_poses_that_do_not_count_do_no_harm():
    spheres, turn, move = scene(1)
    valid = np.ones(turn.shape[:2], dtype=bool)
    valid[40:50, 2] = False
    turn[40:50, 2], move[40:50, 2] = np.nan, np.inf
    asked = np.zeros((len(turn), 3), dtype=bool)
    asked[20:30] = True
    asked[60:70, 0] = True
    with np.errstate(all="raise"):
        near = SweptSpheres(spheres).may_meet(turn, move, valid, PAIRS, asked)
    assert near.any()
    assert not near[~asked].any()
