"""Frame by frame, volumes name the pairs that the broad phase names, until points may have moved by a margin."""

from time import perf_counter

import numpy as np
from scipy.spatial.transform import Rotation
from support.shapes import box_mesh, lab_bodies_and_motion, random_rotations

from cdcore import Body, Motion, Verdict
from cdcore.broad.broad_phase import BroadPhase
from cdcore.broad.live_pairs import LivePairs
from cdcore.poses import place_points
from cdcore.protocol import resolve_pairs


def lab_bodies_at_random_poses(seed, frames=60):
    """Five bodies of a laboratory, and a motion in which they lie 0.2 m about the origin, anew in each frame."""
    bodies, rng = lab_bodies_and_motion(frames=2)[0], np.random.default_rng(seed)
    positions = rng.normal(scale=0.2, size=(frames, len(bodies), 3))
    return bodies, Motion(np.arange(frames), positions, random_rotations(rng, frames, len(bodies)))


def live_pairs_without_narrow_phase(broad_phase):
    """The broad phase frame by frame: ``near`` names the pairs to be decided in a frame, ``verdict`` is kept a pair."""
    return LivePairs(broad_phase, decide=None, inside=None)


def test_live_candidate_pairs_equal_the_offline_broad_phase():
    """Five bodies lie anew in each of 60 frames: the pairs whose volumes overlap, live and of the whole motion."""
    bodies, motion = lab_bodies_at_random_poses(seed=0)
    broad_phase = BroadPhase(bodies, resolve_pairs(bodies, pairs=None))
    live = live_pairs_without_narrow_phase(broad_phase)
    offline = broad_phase.candidates(motion)  # row k: pair columns[k] may meet in frame frames[k]
    assert 0 < len(offline.frames) < offline.verdict.size, "some pairs may meet in some frames, and some may not"
    for frame in range(len(motion)):
        candidate_pairs = sorted(offline.columns[offline.frames == frame].tolist())
        assert live.near(motion.frames(frame, frame + 1)) == candidate_pairs, frame


def test_verdicts_stay_until_a_move_or_a_lost_pose():
    """Two bodies whose boxes overlap are decided (pair 0) in the first of six frames, and again in three more.

    Body 1 has no pose in frame 1; body 0 moves in frame 3 and turns in frame 4, by 1e-9 m and 1e-9 radians.
    """
    bodies, motion = lab_bodies_at_random_poses(seed=1, frames=1)
    a_tenth_as_far = 0.1  # 2 cm instead of 20 cm about the origin, where the boxes of bodies overlap
    positions = np.repeat(motion.translations, 6, axis=0) * a_tenth_as_far
    rotations = np.repeat(motion.rotations, 6, axis=0)
    positions[3:, 0] += 1e-9
    rotations[4:, 0] = Rotation.from_rotvec([1e-9, 0.0, 0.0]).as_matrix() @ rotations[4, 0]
    valid = np.ones((6, len(bodies)), dtype=bool)
    valid[1, 1] = False
    motion = Motion(np.arange(6), positions, rotations, valid)
    live = live_pairs_without_narrow_phase(BroadPhase(bodies, np.array([[0, 1]])))
    pairs_to_decide = [live.near(motion.frames(frame, frame + 1)) for frame in range(6)]
    assert pairs_to_decide == [
        [0],  # the first frame
        [],  # no pose
        [0],  # after a lost pose
        [0],  # moved
        [0],  # turned
        [],  # at rest
    ]


def test_live_verdict_of_a_lost_pose_is_no_pose():
    """Two bodies with poses in frame 0; in frame 1 the second has none."""
    bodies, motion = lab_bodies_at_random_poses(seed=1, frames=2)
    valid = np.ones((2, len(bodies)), dtype=bool)
    valid[1, 1] = False
    motion = Motion(motion.times, motion.translations, motion.rotations, valid)
    live = live_pairs_without_narrow_phase(BroadPhase(bodies, np.array([[0, 1]])))
    live.near(motion.frames(0, 1))
    assert live.verdict.tolist() == [Verdict.CLEAR], "until a narrow phase decides"
    live.near(motion.frames(1, 2))
    assert live.verdict.tolist() == [Verdict.NO_POSE]


def test_pairs_are_tested_again_once_points_moved_by_the_margin():
    """A narrow phase that measured a margin lets the pair rest until points may have moved by it.

    The margin here is what the farthest corners of both boxes move until the next frame, which uses it up. The boxes
    lie 2 m from the origin of their bodies, so that a turn moves them as a shift does.
    """
    rng, pairs, frames = np.random.default_rng(2), np.array([[0, 1]]), 60
    bodies = [Body(name, box_mesh(centre=(2.0, 0.0, 0.0))) for name in "ab"]
    rotations = Rotation.from_rotvec(rng.normal(scale=0.01, size=(2 * frames, 3))).as_matrix().reshape(frames, 2, 3, 3)
    motion = Motion(np.arange(frames), rng.normal(scale=0.01, size=(frames, 2, 3)), rotations)
    corners = np.stack(
        [place_points(body.mesh.vertices, rotations[:, k], motion.translations[:, k]) for k, body in enumerate(bodies)]
    )
    moves = np.linalg.norm(np.diff(corners, axis=1), axis=3)  # (body, frame, corner), metres
    longest_moves = moves.max(axis=2).sum(axis=0)  # of both bodies together
    for frame in range(1, frames):
        live = live_pairs_without_narrow_phase(BroadPhase(bodies, pairs))
        live.near(motion.frames(frame - 1, frame))
        live.verdict[0] = Verdict.CLEAR
        live.skips.keep_margin(pair=0, margin=longest_moves[frame - 1], separated=True)
        assert live.near(motion.frames(frame, frame + 1)) == [0], frame


def test_stage_seconds_of_a_sample_fit_into_its_time():
    """``seconds`` of a frame by stage (volumes, surfaces, containment); the narrow phase says contact at once."""
    bodies, motion = lab_bodies_at_random_poses(seed=0, frames=1)
    broad_phase = BroadPhase(bodies, resolve_pairs(bodies, pairs=None))
    contact, surfaces_separated = Verdict.CONTACT, False
    live = LivePairs(broad_phase, decide=lambda *_: (contact, surfaces_separated), inside=None)
    start = perf_counter()
    live.look(motion)
    elapsed = perf_counter() - start
    assert min(live.seconds.values()) >= 0.0
    assert 0.0 < sum(live.seconds.values()) <= elapsed
