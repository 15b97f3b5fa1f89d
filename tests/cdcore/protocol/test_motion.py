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
    """Poses of two bodies in six frames: (6, 2, 3) and (6, 2, 3, 3)."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=(6, bodies, 3)), random_rotations(rng, 6, bodies)


def homogeneous_matrices(translations, rotations):
    """Poses as matrices (T, N, 4, 4)."""
    poses = np.zeros((*translations.shape[:2], 4, 4))
    poses[..., :3, :3], poses[..., :3, 3], poses[..., 3, 3] = rotations, translations, 1.0
    return poses


def test_good_rotations_keep_every_bit():
    """Twelve random rotations: orthonormal to ORTHONORMAL_KEEP, they are not repaired (``renormalised`` counts)."""
    translations, rotations = random_translations_and_rotations()
    motion = Motion(TIMES, translations, rotations)
    assert motion.rotations.tobytes() == rotations.tobytes()
    assert motion.translations.tobytes() == translations.tobytes()
    assert motion.renormalised == 0
    assert motion.worst_orthonormality <= ORTHONORMAL_KEEP


def test_flags_of_poses_are_kept_in_c_order():
    """Flags ``valid`` are given as a transposed array; kernels would be compiled once more for such an order."""
    translations, rotations = random_translations_and_rotations()
    motion = Motion(TIMES, translations, rotations, valid=np.ones((2, 6), dtype=bool).T)
    assert motion.valid.flags.c_contiguous


def test_three_constructors_give_the_same_bits():
    """Twelve random poses, given with rotations, with quaternions of length 1, and as 4x4 matrices."""
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


@pytest.mark.parametrize(("digits", "largest_error"), [(6, 2e-6), (4, 2e-4)])
def test_printed_digits_are_repaired_to_the_nearest_rotation_and_counted(digits, largest_error):
    """Two bodies in six frames: 12 rotations, written with so many digits, become the nearest rotations.

    The error of a matrix R is the largest entry of |R^T R - I|: of six digits, off by 0.5e-6 at most, it is at most
    2 * 3**0.5 times that, 1.7e-6, and of four 1.7e-4.
    """
    translations, rotations = random_translations_and_rotations()
    printed = np.round(rotations, digits)
    motion = Motion(TIMES, translations, printed)
    assert motion.renormalised == 12
    assert 0 < motion.worst_orthonormality < largest_error
    assert orthonormality_error(motion.rotations).max() <= ORTHONORMAL_KEEP
    assert np.abs(motion.rotations - nearest_rotation(printed)).max() < 1e-14


def assert_pose_is_refused(translations, rotations, message):
    """Asserts that the pose of body 1 in frame 3, at 3 / 90 s, is refused, named by its frame and body.

    The motion is made of arrays and of 4x4 matrices, and without names, where the body has its number.
    """
    with_body_and_frame = rf"frame 3 \(0\.033333 s\), body cup: .*{message}.*flag the pose"
    with pytest.raises(InvalidPoseError, match=with_body_and_frame):
        Motion(TIMES, translations, rotations, names=["a", "cup"])
    with pytest.raises(InvalidPoseError, match=with_body_and_frame):
        Motion.from_matrices(TIMES, homogeneous_matrices(translations, rotations), names=["a", "cup"])
    with pytest.raises(InvalidPoseError, match="body 1: "):
        Motion(TIMES, translations, rotations)


@pytest.mark.parametrize("axis", [0, 1, 2], ids="xyz".__getitem__)
@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf])
def test_infinite_translation_is_refused_with_frame_and_body(axis, number):
    """A coordinate of body 1, cup, in frame 3 is no finite number."""
    translations, rotations = random_translations_and_rotations()
    translations[3, 1, axis] = number
    assert_pose_is_refused(translations, rotations, "translation .* is not finite")


IDENTITY = np.eye(3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        pytest.param(np.diag([np.nan, 1, 1]), "rotation is not finite", id="nan"),
        pytest.param(np.diag([1, 1, np.inf]), "rotation is not finite", id="infinite"),
        pytest.param(1.01 * IDENTITY, r"not a rotation \(\|R\^T R - I\| reaches 0\.0201,", id="stretched: 1.01^2 - 1"),
        pytest.param(0.5 * IDENTITY, "not a rotation", id="halved"),
        pytest.param(np.array([[1, 0.01, 0], [0, 1, 0], [0, 0, 1]]), "not a rotation", id="sheared"),
        pytest.param(-IDENTITY, "a reflection", id="mirrored"),
        pytest.param(0.0 * IDENTITY, "not a rotation", id="zero"),
    ],
)
def test_non_rotation_is_refused_with_frame_and_body(change, message):
    """The rotation of body 1, cup, in frame 3 is multiplied by a matrix."""
    translations, rotations = random_translations_and_rotations()
    rotations[3, 1] = rotations[3, 1] @ change
    assert_pose_is_refused(translations, rotations, message)


@pytest.mark.parametrize("of_matrices", [False, True], ids=["arrays", "4x4 matrices"])
def test_pose_flagged_invalid_is_not_read(of_matrices):
    """The pose of body 1 in frame 3 is not a number; in its place stands that of a body at rest in the origin."""
    translations, rotations = random_translations_and_rotations()
    translations[3, 1], rotations[3, 1] = np.nan, np.inf
    valid = np.ones((6, 2), dtype=bool)
    valid[3, 1] = False
    if of_matrices:
        motion = Motion.from_matrices(TIMES, homogeneous_matrices(translations, rotations), valid)
    else:
        motion = Motion(TIMES, translations, rotations, valid)
    assert np.array_equal(motion.rotations[3, 1], np.eye(3))
    assert np.array_equal(motion.translations[3, 1], np.zeros(3))
    assert motion.renormalised == 0


@pytest.mark.parametrize(
    "quaternion",
    [[0, 0, 0, 0], [0, 0, 0, 0.5], [0, 0, 0, 0.998], [0, 0, 0, 1.002], [0, np.nan, 0, 1], [1e200, 0, 0, 0]],
    ids=str,
)
def test_non_unit_quaternion_is_refused_unless_flagged_invalid(quaternion):
    """Bodies left and right in six frames; the quaternion (x, y, z, w) of left in frame 4 has another length than 1.

    Flagged invalid it is not read: a body at rest stands in its place.
    """
    quaternions, valid = np.tile([0.0, 0, 0, 1], (6, 2, 1)), np.ones((6, 2), dtype=bool)
    quaternions[4, 0] = quaternion
    with pytest.raises(
        InvalidPoseError, match=r"frame 4 .* body left: quaternion .* has norm .*, not 1; flag the pose"
    ):
        Motion.from_quaternions(TIMES, np.zeros((6, 2, 3)), quaternions, names=["left", "right"])
    valid[4, 0] = False
    motion = Motion.from_quaternions(TIMES, np.zeros((6, 2, 3)), quaternions, valid)
    assert np.array_equal(motion.rotations[4, 0], np.eye(3))


@pytest.mark.parametrize(("entry", "value"), [(0, 1e-300), (1, np.nan), (2, -1.0), (3, 1.0 + 1e-15)])
def test_last_row_is_checked_where_poses_are_valid(entry, value):
    """The last row of a 4x4 matrix is 0, 0, 0, 1 exactly; one entry of it is not in frame 4 of cup and in frame 5 of a.

    Both flagged invalid, the matrices are accepted.
    """
    poses, valid = homogeneous_matrices(*random_translations_and_rotations()), np.ones((6, 2), dtype=bool)
    a, cup = 0, 1
    poses[4, cup, 3, entry] = poses[5, a, 3, entry] = value
    with pytest.raises(InvalidPoseError, match=r"frame 4 .*body cup.* last row"):
        Motion.from_matrices(TIMES, poses, names=["a", "cup"])
    valid[4, cup] = valid[5, a] = False
    assert len(Motion.from_matrices(TIMES, poses, valid)) == 6


def test_a_motion_is_frozen_and_does_not_follow_its_source():
    """Arrays and 4x4 matrices are overwritten after motions were made of them; a motion's own arrays cannot be."""
    translations, rotations = random_translations_and_rotations()
    poses = homogeneous_matrices(translations, rotations)
    of_arrays, of_matrices = Motion(TIMES, translations, rotations), Motion.from_matrices(TIMES, poses)
    before = translations.copy()
    translations[:], poses[:] = 9.0, 9.0
    assert np.array_equal(of_arrays.translations, before)
    assert np.array_equal(of_matrices.translations, before)
    with pytest.raises(ValueError, match="read-only"):
        of_arrays.rotations[0] = 0


def test_frames_link_only_between_valid_neighbours():
    """A frame links to the one before it; body 0 is invalid in frame 2, and body 1 was cut before frame 4."""
    valid = np.ones((6, 2), dtype=bool)
    valid[2, 0] = False
    linked = np.ones((6, 2), dtype=bool)
    linked[4, 1] = False
    motion = Motion(TIMES, *random_translations_and_rotations(), valid, linked=linked)
    assert motion.linked[:, 0].tolist() == [False, True, False, False, True, True]
    assert motion.linked[:, 1].tolist() == [False, True, True, True, False, True]


@pytest.mark.parametrize("size", [1, 4, 6, 100], ids="blocks of {}".format)
def test_blocks_hold_the_same_bits_and_cover_every_frame_once(size):
    """Six frames in blocks of so many: the last block may be shorter."""
    motion = Motion(TIMES, *random_translations_and_rotations())
    blocks = list(motion.blocks(size))
    assert np.concatenate([block.times for block in blocks]).tobytes() == motion.times.tobytes()
    assert np.concatenate([block.rotations for block in blocks]).tobytes() == motion.rotations.tobytes()
    assert max(len(block) for block in blocks) == min(size, 6)


def test_selected_frames_are_linked_only_to_adjacent_frames():
    """Frames 0, 1, 3 and 4 of six are selected: nothing is known of the motion from 1 to 3 without 2."""
    selection = Motion(TIMES, *random_translations_and_rotations()).take(np.array([0, 1, 3, 4]))
    assert np.array_equal(selection.times, TIMES[[0, 1, 3, 4]])
    assert selection.linked[:, 0].tolist() == [False, True, False, True]


def resting_motion():
    """Five bodies in nine frames: 0 at rest, 1 moved in frame 8 by the least there is, 2 rotated in frame 4.

    Rotations of body 3 are 1e-6 too long; body 4 has no pose in frame 3, and another one from frame 4 on.
    """
    rotations, positions = np.tile(np.eye(3), (9, 5, 1, 1)), np.zeros((9, 5, 3))
    positions[8, 1, 2] = 5e-324
    rotations[4:, 2] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    rotations[:, 3] *= 1 + 1e-6
    valid = np.ones((9, 5), dtype=bool)
    positions[:3, 4], positions[3:, 4], valid[3, 4] = 1.0, 2.0, False
    return Motion(np.arange(9), positions, rotations, valid)


def test_a_motion_knows_where_each_body_changes():
    """Five bodies in nine frames, each of which changes in frame 0: body 0 rests, body 1 moves by 5e-324 m in frame 8.

    Body 2 rotates in frame 4; body 3 rests; body 4 is lost in frame 3 and stands elsewhere in frame 4.
    """
    changes = [np.flatnonzero(column).tolist() for column in resting_motion().changed.T]
    assert changes == [[0], [0, 8], [0, 4], [0], [0, 4]]


def test_repeated_poses_are_counted_as_repaired_in_each_frame():
    """The matrices of one of five bodies in nine frames are 1e-6 too long, and all the same."""
    assert resting_motion().renormalised == 9


def test_changed_poses_are_the_same_in_a_rigid_motion():
    """``of_rigid`` takes arrays that are known to be poses; ``changed`` is whether a pose differs from the last."""
    motion = resting_motion()
    arrays = motion.translations.copy(), motion.rotations.copy(), motion.valid, motion.linked
    assert Motion.of_rigid(motion.times, *arrays).changed.tolist() == motion.changed.tolist()


def test_changed_poses_of_a_slice_are_those_of_the_whole():
    """Frames 3 to 6 of nine, in some of which bodies change: ``changed`` says so for each frame and body."""
    motion = resting_motion()
    assert motion.frames(3, 7).changed.tolist() == motion.changed[3:7].tolist()


def test_changes_between_selected_frames_count_in_the_next():
    """Bodies 2 and 4 change in frame 4, which is not selected: the change is in the next selected frame, 5."""
    selection = resting_motion().take(np.array([0, 2, 3, 5, 8]))
    changed = [bool(flag) for flag in selection.changed[:, 2]]
    assert changed == [True, False, False, True, False]
    assert selection.changed[:, 4].tolist() == changed


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


@pytest.mark.parametrize("bad_entry", ["rotation", "last row"])
def test_bad_pose_after_repeated_poses_is_refused(bad_entry):
    """Bodies at rest in five frames; in frame 3 body 1 has a rotation with a NaN, or a last row other
    than 0, 0, 0, 1.
    """
    poses = np.tile(np.eye(4), (5, 2, 1, 1))
    if bad_entry == "rotation":
        poses[3, 1, 0, 0] = np.nan
    else:
        poses[3, 1, 3, 0] = 1.0
    with pytest.raises(InvalidPoseError, match=rf"frame 3.*body 1: {bad_entry} is "):
        Motion.from_matrices(np.arange(5), poses)


def test_motion_may_have_no_frames():
    """Three bodies, and arrays without frames."""
    assert len(Motion([], np.zeros((0, 3, 3)), np.zeros((0, 3, 3, 3)))) == 0
    assert Motion.from_quaternions([], np.zeros((0, 3, 3)), np.zeros((0, 3, 4))).valid.shape == (0, 3)


def test_rigid_motion_keeps_poses_without_the_compiler():
    """A new process makes a motion of poses that are known to be rigid, and has not loaded numba, which takes time."""
    code = (
        "import sys, numpy as np; from cdcore import Motion; yes = np.ones((2, 1), dtype=bool);"
        "m = Motion.of_rigid(np.arange(2.0), np.zeros((2, 1, 3)), np.tile(np.eye(3), (2, 1, 1, 1)), yes, yes);"
        "assert len(m) == 2 and m.linked.all() and 'numba' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
