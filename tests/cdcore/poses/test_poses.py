"""Each question about poses has one answer for arrays and one in kernels, and both are the same."""

import numpy as np
import pytest
from support.shapes import random_rotations

from cdcore.kernels.compiling import kernel
from cdcore.narrow.bvh.traverse import place_face as place_face_in_lanes
from cdcore.numerics import readonly
from cdcore.poses import changed_poses, length_moved, place_points, relative_pose
from cdcore.poses import kernels as in_kernels
from cdcore.tolerances import EPS

POSES = 40


@pytest.fixture(params=[1.0, 2.0**-300, 1e6], ids="translations of {:.3g} m".format)
def poses(request):
    """Forty random rotations (n, 2, 3, 3) and translations (n, 2, 3) of two bodies, of about this size."""
    rng = np.random.default_rng(4)
    return random_rotations(rng, POSES, 2), rng.normal(size=(POSES, 2, 3)) * request.param


@kernel
def placed_in_kernel(pose, point, out):
    """Write a point placed by a pose, from compiled code."""
    out[0], out[1], out[2] = in_kernels.placed_by_row(pose, (point[0], point[1], point[2]))


def rows_of(rotations, translations):
    """Poses in one row (n, 12)."""
    return np.concatenate([rotations.reshape(-1, 9), translations], axis=1)


def test_kernels_place_points_bit_for_bit(poses):
    """A face placed by kernels, corner by corner (``placed_by_row``) and at once (``place_face``), and by NumPy.

    ``place_face`` writes nine numbers into a pair of faces, of the second from 9 on.
    """
    rotations, translations = poses
    # Read-only, as faces of bodies are: else the kernel is compiled once more.
    faces = readonly(np.random.default_rng(5).normal(size=(1, 3, 3)) * np.abs(translations).max())
    first_face, second_of_pair = 0, 9
    for rotation, translation in zip(rotations[:, 0], translations[:, 0], strict=True):
        expected = place_points(faces[first_face], rotation, translation)
        (pose_row,) = rows_of(rotation[None], translation[None])
        by_corner, pair = np.empty((3, 3)), np.empty(18)
        for corner in range(3):
            placed_in_kernel(pose_row, faces[first_face, corner], by_corner[corner])
        in_kernels.place_face(faces, first_face, rotation, translation, pair, second_of_pair)
        assert by_corner.tobytes() == expected.tobytes()
        assert pair[second_of_pair:].tobytes() == expected.tobytes()


def test_placing_in_lanes_uses_the_formula_of_poses():
    """The kernel that places a face in eight frames calls ``place_coordinate`` of ``cdcore.poses``, and multiplies
    nothing (``times``) itself.
    """
    assert place_face_in_lanes.__module__ == "cdcore.narrow.bvh.traverse"
    names = place_face_in_lanes.__code__.co_names
    assert "place_coordinate" in names
    assert "times" not in names


def test_relative_pose_agrees_between_arrays_rows_and_kernels(poses):
    """Body B's pose in A's frame, by NumPy, by a kernel of arrays and by a kernel of poses in rows (12,).

    The kernels agree bit for bit, with NumPy to 8 roundings of rotations, and 16 of the size of translations.
    """
    rotations, translations = poses
    (rotations_a, rotations_b), (translations_a, translations_b) = (
        (array[:, 0], array[:, 1]) for array in (rotations, translations)
    )
    expected_rotations, expected_moves = relative_pose(rotations_a, translations_a, rotations_b, translations_b)
    size = np.abs(translations).max()
    for k in range(POSES):
        rotation, move, row = np.empty((3, 3)), np.empty(3), np.empty(12)
        in_kernels.relative_pose(rotations_a[k], translations_a[k], rotations_b[k], translations_b[k], rotation, move)
        row_a, row_b = rows_of(rotations[k], translations[k])
        in_kernels.relative_row(row_a, row_b, row)
        assert rows_of(rotation[None], move[None]).tobytes() == row.tobytes(), k
        np.testing.assert_allclose(rotation, expected_rotations[k], rtol=0, atol=8 * EPS)
        np.testing.assert_allclose(move, expected_moves[k], rtol=0, atol=16 * EPS * size)


def test_relative_pose_takes_points_of_b_to_a(poses):
    """Points of B, taken to A's frame and from there to the world, are where B's pose puts them, to 64 roundings."""
    rotations, translations = poses
    pose_a, pose_b = ((rotations[:, k], translations[:, k]) for k in (0, 1))
    points = np.random.default_rng(6).normal(size=(POSES, 5, 3)) * np.abs(translations).max()
    in_world = place_points(points, *pose_b)
    in_frame_of_a = place_points(points, *relative_pose(*pose_a, *pose_b))
    np.testing.assert_allclose(
        place_points(in_frame_of_a, *pose_a), in_world, rtol=0, atol=64 * EPS * np.abs(in_world).max()
    )


def test_a_pose_changes_with_any_of_its_numbers():
    """14 poses: the first counts as changed; each of the next 12 differs in one more of nine entries or three
    coordinates, by a rounding; the last repeats the one before.
    """
    rotations, translations = np.tile(np.eye(3), (14, 1, 1)), np.zeros((14, 3))
    for pose in range(1, 13):
        numbers = rotations[pose:].reshape(-1, 9) if pose < 10 else translations[pose:]
        numbers[:, (pose - 1) % 9] += 2.0**-52
    changed = changed_poses(rotations, translations).tolist()
    assert changed == [True] * 13 + [False]
    entries, coordinates = rotations.ravel(), translations.ravel()
    in_kernel = [not in_kernels.same_pose(coordinates, entries, k, coordinates, entries, k - 1) for k in range(1, 14)]
    assert in_kernel == changed[1:]


def test_pairs_of_bodies_change_together():
    """Three frames of two bodies: the first is always a change, in the second a body moves, in the third none does."""
    rotations, translations = np.tile(np.eye(3), (3, 2, 1, 1)), np.zeros((3, 2, 3))
    translations[1, 1, 2] = 1.0
    translations[2, 1, 2] = 1.0
    assert changed_poses(rotations, translations).tolist() == [True, True, False]


def test_no_point_of_a_ball_moves_further_than_the_bound(poses):
    """A ball moves through 40 random poses; 200 points of its surface move by at most ``length_moved`` from each to the
    next, and the farthest by more than a quarter of that.

    Some point of the whole surface moves by 1 / (1 + 2**0.5) = 0.41 of it or more: the bound adds the step of the
    centre and 2**0.5 times the longest of the turn alone.
    """
    rotations, translations = poses
    rotations, translations = rotations[:, 0], translations[:, 0]
    rng, radius = np.random.default_rng(8), np.abs(translations).max()
    centre = rng.normal(size=3) * radius
    bound = length_moved(rotations, translations, centre, radius)
    directions = rng.normal(size=(200, 3))
    points = centre + radius * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    moves = np.linalg.norm(np.diff(place_points(points, rotations, translations), axis=0), axis=2)
    longest = moves.max(axis=1)
    assert (longest <= bound * (1 + 1e-9)).all()
    assert (longest > bound / 4).all()


def test_kernel_bounds_the_moves_of_a_ball_as_arrays_do(poses):
    """``length_moved`` from each of 40 random poses to the next, for a ball of radius 1 m about (1, 2, 3)."""
    rotations, translations = poses
    rotations, translations = rotations[:, 0], translations[:, 0]
    centre, radius = np.array([1.0, 2.0, 3.0]), 1.0
    bound = length_moved(rotations, translations, centre, radius)
    for k in range(POSES - 1):
        now, before = (rotations[k + 1], translations[k + 1]), (rotations[k], translations[k])
        assert in_kernels.length_moved(*now, *before, centre, radius) == pytest.approx(bound[k], rel=1e-12, abs=0), k
