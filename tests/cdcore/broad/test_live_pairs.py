"""Looks at volumes name the pairs that the broad phase names, and paths never fall short of what a point moved."""

from time import perf_counter

import numpy as np
from scipy.spatial.transform import Rotation
from support.shapes import box_mesh, lab_bodies_and_motion, random_rotations

from cdcore import Body, Motion, Verdict
from cdcore.broad.broad_phase import BroadPhase
from cdcore.broad.live_pairs import LivePairs
from cdcore.protocol import resolve_pairs


def lab_bodies_at_random_poses(seed, frames=60):
    """Five bodies of a laboratory, and a motion in which they lie 0.2 m about the origin, anew in each frame."""
    bodies, rng = lab_bodies_and_motion(frames=2)[0], np.random.default_rng(seed)
    positions = rng.normal(scale=0.2, size=(frames, len(bodies), 3))
    return bodies, Motion(np.arange(frames), positions, random_rotations(rng, frames, len(bodies)))


def live_pairs_without_narrow_phase(broad_phase):
    """Live pairs that nobody decides further: they name the candidates of a frame and keep verdicts."""
    return LivePairs(broad_phase, decide=None, inside=None)


def test_live_candidate_pairs_equal_the_offline_broad_phase():
    """60 frames of bodies that lie anew in each: pairs whose volumes overlap, by frame and of the whole motion."""
    bodies, motion = lab_bodies_at_random_poses(seed=0)
    broad_phase = BroadPhase(bodies, resolve_pairs(bodies, pairs=None))
    live = live_pairs_without_narrow_phase(broad_phase)
    offline = broad_phase.candidates(motion)  # row k: pair columns[k] may meet in frame frames[k]
    assert 0 < len(offline.frames) < offline.verdict.size, "some pairs may meet in some frames, and some may not"
    for frame in range(len(motion)):
        candidate_pairs = sorted(offline.columns[offline.frames == frame].tolist())
        assert live.near(motion.frames(frame, frame + 1)) == candidate_pairs


def test_verdicts_stay_until_a_move_or_a_lost_pose():
    """Six frames; the second body has no pose in frame 1, the first moves in frame 3 and turns in frame 4, by 1e-9.

    In the end a frame without a pose is sampled once more: its verdict is NO_POSE.
    """
    bodies, motion = lab_bodies_at_random_poses(seed=1, frames=1)
    positions, rotations = np.repeat(motion.translations, 6, axis=0) * 0.1, np.repeat(motion.rotations, 6, axis=0)
    positions[3:, 0] += 1e-9
    rotations[4:, 0] = Rotation.from_rotvec([1e-9, 0.0, 0.0]).as_matrix() @ rotations[4, 0]
    valid = np.ones((6, len(bodies)), dtype=bool)
    valid[1, 1] = False
    samples, still = (
        live_pairs_without_narrow_phase(BroadPhase(bodies, np.array([[0, 1]]))),
        Motion(np.arange(6), positions, rotations, valid),
    )
    # Pair 0 is asked in the first frame, after the lost pose of frame 1, and after the moves in frames 3 and 4.
    assert [samples.near(still.frames(k, k + 1)) for k in range(6)] == [[0], [], [0], [0], [0], []]
    samples.near(still.frames(1, 2))
    assert samples.verdict.tolist() == [Verdict.NO_POSE]


def test_pairs_are_tested_again_once_points_moved_by_the_margin():
    """The margin kept is what the farthest corners of both bodies move in the next frame: that frame uses it up.

    The boxes lie far from the origin of their bodies, so that a turn moves them as a shift does.
    """
    rng, pairs, frames = np.random.default_rng(2), np.array([[0, 1]]), 60
    bodies = [Body(name, box_mesh(centre=(2.0, 0.0, 0.0))) for name in "ab"]
    rotations = Rotation.from_rotvec(rng.normal(scale=0.01, size=(2 * frames, 3))).as_matrix().reshape(frames, 2, 3, 3)
    close = Motion(np.arange(frames), rng.normal(scale=0.01, size=(frames, 2, 3)), rotations)
    for frame in range(1, frames):
        samples = live_pairs_without_narrow_phase(BroadPhase(bodies, pairs))
        samples.near(close.frames(frame - 1, frame))
        ends = [
            np.einsum("kij,vj->kvi", close.rotations[[frame - 1, frame], k], bodies[k].mesh.vertices)
            + close.translations[[frame - 1, frame], k][:, None]
            for k in (0, 1)
        ]
        moved = sum(np.linalg.norm(item[1] - item[0], axis=1).max() for item in ends)
        samples.verdict[0] = Verdict.CLEAR
        samples.skips.keep_margin(0, moved, True)
        assert samples.near(close.frames(frame, frame + 1)) == [0]


def test_stage_seconds_of_a_look_fit_into_its_time():
    """The narrow phase is a stand-in that says contact at once."""
    bodies, motion = lab_bodies_at_random_poses(seed=0, frames=1)
    broad_phase = BroadPhase(bodies, resolve_pairs(bodies, pairs=None))
    live = LivePairs(broad_phase, decide=lambda *_: (Verdict.CONTACT, False), inside=None)
    begun = perf_counter()
    live.look(motion)
    elapsed = perf_counter() - begun
    assert min(live.seconds.values()) >= 0.0 and sum(live.seconds.values()) <= elapsed
