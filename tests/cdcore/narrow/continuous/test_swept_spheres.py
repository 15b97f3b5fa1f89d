"""A leg that the spheres dismiss holds no moment at which the bodies meet; legs not asked about are not answered."""

import numpy as np
from support.motions import turned_by
from support.shapes import ball_mesh, moved

from cdcore.bounding.sphere import sphere_best
from cdcore.narrow.continuous.motion_segments import LEG_WIDTH, fill_leg, pose_at
from cdcore.narrow.continuous.swept_spheres import SweptSpheres

PAIRS = np.array([[0, 1], [2, 1], [0, 2]])


def scene(seed, frames=120):
    rng = np.random.default_rng(seed)
    meshes = [ball_mesh(0.1), moved(ball_mesh(0.05), (0.3, 0, 0)), moved(ball_mesh(0.2), (0, -0.5, 0.2))]
    turn = np.stack([turned_by(rng, frames, 1.5) for _ in meshes], axis=1)
    move = rng.normal(size=(frames, 3, 3)) * 0.4
    return [sphere_best(mesh) for mesh in meshes], turn, move


def centre_at(sphere, turn, move, frame, body, share):
    leg, pose = np.empty(LEG_WIDTH), np.empty(12)
    fill_leg(turn[frame - 1, body], move[frame - 1, body], turn[frame, body], move[frame, body], leg)
    pose_at(leg, share, pose)
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
