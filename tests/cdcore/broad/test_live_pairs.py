"""Looks at volumes name the pairs that the broad phase names, and paths never fall short of what a point moved."""

import numpy as np
from scipy.spatial.transform import Rotation
from support.shapes import box_mesh, lab_bodies_and_motion, random_rotations

from cdcore import Body, Motion, Verdict
from cdcore.broad.broad_phase import BroadPhase
from cdcore.broad.live_pairs import LivePairs
from cdcore.protocol import resolve_pairs


def walk(seed, frames=60):
    bodies, rng = lab_bodies_and_motion(frames=2)[0], np.random.default_rng(seed)
    positions = rng.normal(scale=0.2, size=(frames, len(bodies), 3))
    return bodies, Motion(np.arange(frames), positions, random_rotations(rng, frames, len(bodies)))


def test_live_candidate_pairs_equal_the_offline_broad_phase():
    bodies, motion = walk(0)
    broad = BroadPhase(bodies, resolve_pairs(bodies, None))
    samples, whole = LivePairs(broad, None, None), broad.candidates(motion)
    assert 0 < len(whole.frames) < whole.verdict.size
    for frame in range(len(motion)):
        assert samples.near(motion.frames(frame, frame + 1)) == sorted(whole.columns[whole.frames == frame].tolist())


def test_verdicts_stay_until_a_move_or_a_lost_pose():
    bodies, motion = walk(1, 1)
    positions, rotations = np.repeat(motion.translations, 6, axis=0) * 0.1, np.repeat(motion.rotations, 6, axis=0)
    positions[3:, 0] += 1e-9
    rotations[4:, 0] = Rotation.from_rotvec([1e-9, 0.0, 0.0]).as_matrix() @ rotations[4, 0]
    valid = np.ones((6, len(bodies)), dtype=bool)
    valid[1, 1] = False
    samples, still = (
        LivePairs(BroadPhase(bodies, np.array([[0, 1]])), None, None),
        Motion(np.arange(6), positions, rotations, valid),
    )
    assert [samples.near(still.frames(k, k + 1)) for k in range(6)] == [[0], [], [0], [0], [0], []]
    samples.near(still.frames(1, 2))
    assert samples.verdict.tolist() == [Verdict.NO_POSE]


def test_pairs_are_tested_again_once_points_moved_by_the_margin():
    """The boxes lie far from the origin of their bodies, so that a turn moves them as a shift does."""
    rng, pairs, frames = np.random.default_rng(2), np.array([[0, 1]]), 60
    bodies = [Body(name, box_mesh(centre=(2.0, 0.0, 0.0))) for name in "ab"]
    rotations = Rotation.from_rotvec(rng.normal(scale=0.01, size=(2 * frames, 3))).as_matrix().reshape(frames, 2, 3, 3)
    close = Motion(np.arange(frames), rng.normal(scale=0.01, size=(frames, 2, 3)), rotations)
    for frame in range(1, frames):
        samples = LivePairs(BroadPhase(bodies, pairs), None, None)
        samples.near(close.frames(frame - 1, frame))
        ends = [
            np.einsum("kij,vj->kvi", close.rotations[[frame - 1, frame], k], bodies[k].mesh.vertices)
            + close.translations[[frame - 1, frame], k][:, None]
            for k in (0, 1)
        ]
        moved = sum(np.linalg.norm(item[1] - item[0], axis=1).max() for item in ends)
        samples.verdict[0] = Verdict.CLEAR
        samples.keep_margin(0, moved, True)
        assert samples.near(close.frames(frame, frame + 1)) == [0]
