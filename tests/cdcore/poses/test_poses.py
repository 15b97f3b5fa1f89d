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


@pytest.fixture(params=[1.0, 2.0**-300, 1e6])
def poses(request):
    """Two bodies' rotations (n, 2, 3, 3) and translations (n, 2, 3), of one size."""
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
    """Corner by corner, and a whole face at once, beside NumPy; the face is written as the second of two, from 9 on."""
    rotations, translations = poses
    # Read-only, as faces of bodies are: else the kernel is compiled once more.
    corners = readonly(np.random.default_rng(5).normal(size=(1, 3, 3)) * np.abs(translations).max())
    for rotation, translation, row in zip(
        rotations[:, 0], translations[:, 0], rows_of(rotations[:, 0], translations[:, 0]), strict=True
    ):
        expected = place_points(corners[0], rotation, translation)
        by_row, pair = np.empty((3, 3)), np.empty(18)
        for corner in range(3):
            placed_in_kernel(row, corners[0, corner], by_row[corner])
        in_kernels.place_face(corners, 0, rotation, translation, pair, 9)
        assert by_row.tobytes() == pair[9:].tobytes() == expected.tobytes()


def test_placing_in_lanes_uses_the_formula_of_poses():
    """The kernel of eight lanes calls ``place_coordinate`` of ``cdcore.poses``, and no product (``times``) itself."""
    assert place_face_in_lanes.__module__ == "cdcore.narrow.bvh.traverse"
    names = place_face_in_lanes.__code__.co_names
    assert "place_coordinate" in names
    assert "times" not in names


def test_relative_pose_agrees_between_arrays_rows_and_kernels(poses):
    """To a few roundings: 8 of a rotation's entries, 16 of the size of translations."""
    rotations, translations = poses
    expected = relative_pose(rotations[:, 0], translations[:, 0], rotations[:, 1], translations[:, 1])
    size = np.abs(translations).max()
    for k in range(POSES):
        rotation, move, row = np.empty((3, 3)), np.empty(3), np.empty(12)
        in_kernels.relative_pose(
            rotations[k, 0], translations[k, 0], rotations[k, 1], translations[k, 1], rotation, move
        )
        pose_rows = rows_of(rotations[k], translations[k])
        in_kernels.relative_row(pose_rows[0], pose_rows[1], row)
        assert rows_of(rotation[None], move[None])[0].tobytes() == row.tobytes()
        np.testing.assert_allclose(rotation, expected[0][k], rtol=0, atol=8 * EPS)
        np.testing.assert_allclose(move, expected[1][k], rtol=0, atol=16 * EPS * size)


def test_relative_pose_takes_points_of_b_to_a(poses):
    """Points of b, taken to the axes of a and from there to the world, are where b's pose puts them."""
    rotations, translations = poses
    points = np.random.default_rng(6).normal(size=(POSES, 5, 3)) * np.abs(translations).max()
    world = place_points(points, rotations[:, 1], translations[:, 1])
    seen = place_points(
        points, *relative_pose(rotations[:, 0], translations[:, 0], rotations[:, 1], translations[:, 1])
    )
    back = place_points(seen, rotations[:, 0], translations[:, 0])
    np.testing.assert_allclose(back, world, rtol=0, atol=64 * EPS * np.abs(world).max())


def test_a_pose_changes_with_any_of_its_numbers():
    """Each of 12 steps changes one of nine entries or three coordinates by a rounding; the last none."""
    rotations, translations = np.tile(np.eye(3), (14, 1, 1)), np.zeros((14, 3))
    for step in range(1, 13):
        rows = rotations[step:].reshape(-1, 9) if step < 10 else translations[step:]
        rows[:, (step - 1) % 9] += 2.0**-52
    changed = changed_poses(rotations, translations)
    assert changed.tolist() == [True] * 13 + [False]
    entries, coordinates = rotations.ravel(), translations.ravel()
    in_kernel = [not in_kernels.same_pose(coordinates, entries, k, coordinates, entries, k - 1) for k in range(1, 14)]
    assert in_kernel == changed[1:].tolist()


def test_pairs_of_bodies_change_together():
    """Three frames of two bodies: the first is always a change, in the second a body moves, in the third none does."""
    rotations, translations = np.tile(np.eye(3), (3, 2, 1, 1)), np.zeros((3, 2, 3))
    translations[1, 1, 2] = 1.0
    translations[2, 1, 2] = 1.0
    assert changed_poses(rotations, translations).tolist() == [True, True, False]


def test_no_point_of_a_ball_moves_further_than_the_bound(poses):
    """Points on the ball's surface, from frame to frame; the bound is at most four times what they move."""
    rotations, translations = poses
    rng, radius = np.random.default_rng(8), np.abs(translations).max()
    centre = rng.normal(size=3) * radius
    bound = length_moved(rotations[:, 0], translations[:, 0], centre, radius)
    directions = rng.normal(size=(200, 3))
    points = centre + radius * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    moved = np.linalg.norm(np.diff(place_points(points, rotations[:, 0], translations[:, 0]), axis=0), axis=2)
    assert (moved.max(axis=1) <= bound * (1 + 1e-9)).all()
    assert (moved.max(axis=1) > bound / 4).all()
    for k in range(POSES - 1):
        now, before = (rotations[k + 1, 0], translations[k + 1, 0]), (rotations[k, 0], translations[k, 0])
        assert in_kernels.length_moved(*now, *before, centre, radius) == pytest.approx(bound[k], rel=1e-12)
