"""A motion holds finite rigid poses or names the frame and body that is none."""

import subprocess
import sys

import numpy as np
import pytest
from support.shapes import nearest_rotation, orthonormality_error, random_rotations

from cdcore import Motion
from cdcore.errors import InvalidPoseError
from cdcore.poses import rotation_from_quaternion
from cdcore.tolerances import ORTHONORMAL_KEEP

TIMES = np.arange(6) / 90


def random_translations_and_rotations(bodies=2, seed=0):
    """Poses of six frames."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=(6, bodies, 3)), random_rotations(rng, 6, bodies)


def homogeneous_matrices(translations, rotations):
    """Poses as matrices (T, N, 4, 4)."""
    poses = np.zeros((*translations.shape[:2], 4, 4))
    poses[..., :3, :3], poses[..., :3, 3], poses[..., 3, 3] = rotations, translations, 1.0
    return poses


def test_good_rotations_keep_every_bit():
    """Rotations that are orthonormal to ORTHONORMAL_KEEP are not repaired."""
    translations, rotations = random_translations_and_rotations()
    motion = Motion(TIMES, translations, rotations)
    assert motion.rotations.tobytes() == rotations.tobytes()
    assert motion.translations.tobytes() == translations.tobytes()
    assert motion.renormalised == 0
    assert motion.worst_orthonormality <= ORTHONORMAL_KEEP


def test_flags_of_poses_are_kept_in_c_order():
    """Kernels are compiled once more for arrays in another order."""
    translations, rotations = random_translations_and_rotations()
    motion = Motion(TIMES, translations, rotations, valid=np.ones((2, 6), dtype=bool).T)
    assert motion.valid.flags.c_contiguous


def test_three_constructors_give_the_same_bits():
    """From rotations, quaternions and 4x4 matrices."""
    rng = np.random.default_rng(1)
    translations, quaternions = rng.normal(size=(6, 2, 3)), rng.normal(size=(6, 2, 4))
    quaternions /= np.linalg.norm(quaternions, axis=-1, keepdims=True)
    rotations = rotation_from_quaternion(quaternions)
    plain = Motion(TIMES, translations, rotations)
    for other in (
        Motion.from_quaternions(TIMES, translations, quaternions),
        Motion.from_matrices(TIMES, homogeneous_matrices(translations, rotations)),
    ):
        assert other.rotations.tobytes() == plain.rotations.tobytes()
        assert other.translations.tobytes() == plain.translations.tobytes()


@pytest.mark.parametrize(("digits", "worst"), [(6, 2e-6), (4, 2e-4)])
def test_printed_digits_are_repaired_to_the_nearest_rotation_and_counted(digits, worst):
    """Two bodies at six times: 12 rotations, written with so many ``digits``."""
    translations, rotations = random_translations_and_rotations()
    motion = Motion(TIMES, translations, np.round(rotations, digits))
    assert motion.renormalised == 12
    assert 0 < motion.worst_orthonormality < worst
    assert orthonormality_error(motion.rotations).max() <= ORTHONORMAL_KEEP
    assert np.abs(motion.rotations - nearest_rotation(np.round(rotations, digits))).max() < 1e-14


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda translations, rotations: translations.__setitem__((3, 1, 0), np.nan), "translation .* is not finite"),
        (lambda translations, rotations: translations.__setitem__((3, 1, 1), np.inf), "translation .* is not finite"),
        (lambda translations, rotations: translations.__setitem__((3, 1, 2), -np.inf), "translation .* is not finite"),
        (lambda translations, rotations: rotations.__setitem__((3, 1, 0, 0), np.nan), "rotation is not finite"),
        (lambda translations, rotations: rotations.__setitem__((3, 1, 2, 2), np.inf), "rotation is not finite"),
        (
            lambda translations, rotations: rotations.__setitem__((3, 1), rotations[3, 1] * 1.01),
            r"not a rotation \(\|R\^T R - I\| reaches 0\.0201,",
        ),
        (lambda translations, rotations: rotations.__setitem__((3, 1), rotations[3, 1] * 0.5), "not a rotation"),
        (
            lambda translations, rotations: rotations.__setitem__(
                (3, 1), rotations[3, 1] @ [[1, 0.01, 0], [0, 1, 0], [0, 0, 1]]
            ),
            "not a rotation",
        ),
        (lambda translations, rotations: rotations.__setitem__((3, 1), -rotations[3, 1]), "a reflection"),
        (lambda translations, rotations: rotations.__setitem__((3, 1), 0.0), "not a rotation"),
    ],
    ids=["nan x", "inf y", "inf z", "nan turn", "inf turn", "stretched", "halved", "sheared", "mirrored", "zero"],
)
def test_invalid_pose_is_refused_with_frame_and_body(spoil, message):
    """``spoil`` changes the pose of body 1, cup, in frame 3, at 3 / 90 s; without names the body has its number.

    1.01 times a rotation R has |R^T R - I| = 1.01^2 - 1 = 0.0201.
    """
    translations, rotations = random_translations_and_rotations()
    spoil(translations, rotations)
    for build in (
        lambda: Motion(TIMES, translations, rotations, names=["a", "cup"]),
        lambda: Motion.from_matrices(TIMES, homogeneous_matrices(translations, rotations), names=["a", "cup"]),
    ):
        with pytest.raises(InvalidPoseError, match=rf"frame 3 \(0\.033333 s\), body cup: .*{message}.*flag the pose"):
            build()
    with pytest.raises(InvalidPoseError, match="body 1: "):
        Motion(TIMES, translations, rotations)


def test_pose_flagged_invalid_is_not_read():
    """The pose of body 1 in frame 3 is not a number; it is replaced by that of a body at rest in the origin."""
    translations, rotations = random_translations_and_rotations()
    translations[3, 1], rotations[3, 1] = np.nan, np.inf
    valid = np.ones((6, 2), dtype=bool)
    valid[3, 1] = False
    for motion in (
        Motion(TIMES, translations, rotations, valid),
        Motion.from_matrices(TIMES, homogeneous_matrices(translations, rotations), valid),
    ):
        assert np.array_equal(motion.rotations[3, 1], np.eye(3))
        assert np.array_equal(motion.translations[3, 1], np.zeros(3))
        assert motion.renormalised == 0


@pytest.mark.parametrize(
    "quaternion",
    [[0] * 4, [0, 0, 0, 0.5], [0, 0, 0, 0.998], [0, 0, 0, 1.002], [0, np.nan, 0, 1], [1e200, 0, 0, 0]],
)
def test_non_unit_quaternion_is_refused_unless_flagged_invalid(quaternion):
    """Two bodies at six times; one quaternion (x, y, z, w) is replaced."""
    quaternions = np.tile([0.0, 0, 0, 1], (6, 2, 1))
    quaternions[4, 0] = quaternion
    with pytest.raises(
        InvalidPoseError, match=r"frame 4 .* body left: quaternion .* has norm .*, not 1; flag the pose"
    ):
        Motion.from_quaternions(TIMES, np.zeros((6, 2, 3)), quaternions, names=["left", "right"])
    valid = np.ones((6, 2), dtype=bool)
    valid[4, 0] = False
    motion = Motion.from_quaternions(TIMES, np.zeros((6, 2, 3)), quaternions, valid)
    assert np.array_equal(motion.rotations[4, 0], np.eye(3))


@pytest.mark.parametrize(("entry", "value"), [(0, 1e-300), (1, np.nan), (2, -1.0), (3, 1.0 + 1e-15)])
def test_last_row_is_checked_where_poses_are_valid(entry, value):
    """The last row of a homogeneous matrix is 0, 0, 0, 1 exactly."""
    poses, valid = homogeneous_matrices(*random_translations_and_rotations()), np.ones((6, 2), dtype=bool)
    poses[4, 1, 3, entry] = poses[5, 0, 3, entry] = value
    with pytest.raises(InvalidPoseError, match=r"frame 4 .*body cup.* last row"):
        Motion.from_matrices(TIMES, poses, names=["a", "cup"])
    valid[4, 1] = valid[5, 0] = False
    assert len(Motion.from_matrices(TIMES, poses, valid)) == 6


def test_a_motion_is_frozen_and_does_not_follow_its_source():
    """Arrays are overwritten after the motion was made of them; its own cannot be."""
    translations, rotations = random_translations_and_rotations()
    poses = homogeneous_matrices(translations, rotations)
    motion, other = Motion(TIMES, translations, rotations), Motion.from_matrices(TIMES, poses)
    before = translations.copy()
    translations[:], poses[:] = 9.0, 9.0
    assert np.array_equal(motion.translations, before)
    assert np.array_equal(other.translations, before)
    with pytest.raises(ValueError, match="read-only"):
        motion.rotations[0] = 0


def test_frames_link_only_between_valid_neighbours():
    """A frame links to the one before it; body 0 is invalid in frame 2, and body 1 was cut before frame 4."""
    valid = np.ones((6, 2), dtype=bool)
    valid[2, 0] = False
    linked = np.ones((6, 2), dtype=bool)
    linked[4, 1] = False
    motion = Motion(TIMES, *random_translations_and_rotations(), valid, linked=linked)
    assert motion.linked[:, 0].tolist() == [False, True, False, False, True, True]
    assert motion.linked[:, 1].tolist() == [False, True, True, True, False, True]


def test_blocks_hold_the_same_bits_and_cover_every_frame_once():
    """Six frames in blocks of 1, of 4 (the last is shorter), of 6 and of up to 100."""
    motion = Motion(TIMES, *random_translations_and_rotations())
    for size in (1, 4, 6, 100):
        blocks = list(motion.blocks(size))
        assert np.concatenate([block.times for block in blocks]).tobytes() == motion.times.tobytes()
        assert np.concatenate([block.rotations for block in blocks]).tobytes() == motion.rotations.tobytes()
        assert max(len(block) for block in blocks) <= size


def test_selected_frames_are_linked_only_to_adjacent_frames():
    """Frames 0, 1, 3, 4 are selected: no motion is known from 1 to 3 without 2."""
    taken = Motion(TIMES, *random_translations_and_rotations()).take(np.array([0, 1, 3, 4]))
    assert taken.linked[:, 0].tolist() == [False, True, False, True]
    assert np.array_equal(taken.times, TIMES[[0, 1, 3, 4]])


def resting_motion():
    """Five bodies at nine times: at rest, moved once by the least there is, turned once, repaired, lost for a frame."""
    rotations, positions = np.tile(np.eye(3), (9, 5, 1, 1)), np.zeros((9, 5, 3))
    positions[8, 1, 2] = 5e-324
    rotations[4:, 2] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    rotations[:, 3] *= 1 + 1e-6
    valid = np.ones((9, 5), dtype=bool)
    positions[:3, 4], positions[3:, 4], valid[3, 4] = 1.0, 2.0, False
    return Motion(np.arange(9), positions, rotations, valid)


def test_a_motion_knows_where_each_body_changes():
    """Frames in which each body of ``resting_motion`` changes; all nine rotations of body 3 are repaired."""
    motion = resting_motion()
    changes = [np.flatnonzero(column).tolist() for column in motion.changed.T]
    assert changes == [[0], [0, 8], [0, 4], [0], [0, 4]], "a body that is lost changes where it is seen again"
    assert motion.renormalised == 9


def test_changed_poses_agree_in_rigid_sliced_and_selected_motions():
    """``changed`` tells for each frame and body whether its pose differs from the frame before.

    Bodies 2 and 4 change in frame 4: of the frames 0, 2, 3, 5 and 8 that is seen in 5.
    """
    motion = resting_motion()
    components = motion.translations.copy(), motion.rotations.copy(), motion.valid, motion.linked
    assert Motion.of_rigid(motion.times, *components).changed.tolist() == motion.changed.tolist()
    assert motion.frames(3, 7).changed.tolist() == motion.changed[3:7].tolist()
    kept = np.array([0, 2, 3, 5, 8])
    assert motion.take(kept).changed[:, [2, 4]].tolist() == [[1, 1], [0, 0], [0, 0], [1, 1], [0, 0]]


@pytest.mark.parametrize(
    ("times", "message"),
    [
        ([0.0, np.nan, 2.0], "frame 1: time nan is not finite"),
        ([-np.inf, 0.0, 1.0], "frame 0: time -inf is not finite"),
        ([0.0, 1.0, np.inf], "frame 2: time inf is not finite"),
        ([0.0, 1.0, 1.0], "frame 2: .* does not come after"),
        ([0.0, 2.0, 1.0], "frame 2: .* does not come after"),
    ],
)
def test_times_that_do_not_increase_are_refused_by_frame(times, message):
    """A body at rest in three frames, at ``times``."""
    with pytest.raises(InvalidPoseError, match=message):
        Motion(times, np.zeros((3, 1, 3)), np.tile(np.eye(3), (3, 1, 1, 1)))


@pytest.mark.parametrize("spoil", ["turn", "last row"])
def test_bad_pose_after_repeated_poses_is_refused(spoil):
    """Body 1 of frame 3 has a rotation with a NaN, or a last row other than 0, 0, 0, 1."""
    poses = np.tile(np.eye(4), (5, 2, 1, 1))
    poses[3, 1, 3, 0] = 1.0 if spoil == "last row" else 0.0
    poses[3, 1, 0, 0] = 1.0 if spoil == "last row" else np.nan
    with pytest.raises(InvalidPoseError, match="frame 3"):
        Motion.from_matrices(np.arange(5), poses)


def test_motion_may_have_no_frames():
    assert len(Motion([], np.zeros((0, 3, 3)), np.zeros((0, 3, 3, 3)))) == 0
    assert Motion.from_quaternions([], np.zeros((0, 3, 3)), np.zeros((0, 3, 4))).valid.shape == (0, 3)


def test_rigid_motion_keeps_poses_without_the_compiler():
    """A new process makes a motion of poses that are known to be rigid, and has not loaded numba."""
    code = (
        "import sys, numpy as np; from cdcore import Motion; yes = np.ones((2, 1), dtype=bool);"
        "m = Motion.of_rigid(np.arange(2.0), np.zeros((2, 1, 3)), np.tile(np.eye(3), (2, 1, 1, 1)), yes, yes);"
        "assert len(m) == 2 and m.linked.all() and 'numba' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
