"""Poses keep their bits, and no point of a body ever moves further than its path says."""

import numpy as np
import pytest
from support.motions import motion_of, placed, soup

from cdcore.narrow.spacetime.box_tree import build_box_tree
from cdcore.narrow.spacetime.pose_lanes import pose_lanes

FRAMES = np.arange(61)


@pytest.fixture(scope="module")
def moving():
    rng = np.random.default_rng(1)
    mesh = soup(rng) + 3.0
    turn, move = motion_of("soup", rng, len(FRAMES), 2)
    tree = build_box_tree(mesh)
    return mesh, turn, move, tree, pose_lanes(turn, move, 1, FRAMES, tree.boxes[0], tree.reach)


def test_entries_are_the_poses_bit_for_bit_with_the_last_one_repeated(moving):
    _, turn, move, tree, lanes = moving
    rows = lanes.entries.reshape(15, lanes.stride)
    assert np.array_equal(rows[:9, : len(FRAMES)].T.reshape(-1, 3, 3), turn[:, 1])
    assert np.array_equal(rows[9:12, : len(FRAMES)].T, move[:, 1])
    assert (rows[:, len(FRAMES) :] == rows[:, len(FRAMES) - 1 :][:, :1]).all()
    assert lanes.stride >= len(FRAMES) + 7
    centre = turn[:, 1] @ tree.boxes[0, :3] + move[:, 1]
    assert np.allclose(rows[12:, : len(FRAMES)].T, centre, atol=1e-14)


def test_the_path_bounds_every_points_way_between_any_two_frames(moving):
    mesh, turn, move, _, lanes = moving
    points = np.array([placed(mesh, turn[f, 1], move[f, 1]).reshape(-1, 3) for f in FRAMES])
    for f in range(0, len(FRAMES), 7):
        for h in range(f, len(FRAMES), 5):
            way = np.linalg.norm(points[h] - points[f], axis=1).max()
            assert way <= lanes.path[h] - lanes.path[f]


def test_the_path_grows_exactly_where_the_pose_changes(moving):
    _, turn, move, _, lanes = moving
    changes = (turn[1:, 1] != turn[:-1, 1]).any(axis=(1, 2)) | (move[1:, 1] != move[:-1, 1]).any(axis=1)
    assert not changes.all()
    assert np.array_equal(np.diff(lanes.path) > 0, changes)


def test_a_change_in_the_last_bit_counts_as_one():
    turn, move = np.tile(np.eye(3), (9, 1, 1, 1)), np.ones((9, 1, 3))
    move[5:, 0, 1] = np.nextafter(1.0, 2.0)
    lanes = pose_lanes(turn, move, 0, np.arange(9), build_box_tree(np.zeros((1, 3, 3))).boxes[0], 0.0)
    assert np.flatnonzero(np.diff(lanes.path)).tolist() == [4]


def test_a_body_that_never_moves_is_one_pose():
    turn, move = np.tile(np.eye(3), (100, 1, 1, 1)), np.ones((100, 1, 3))
    tree = build_box_tree(soup(np.random.default_rng(0)))
    lanes = pose_lanes(turn, move, 0, np.arange(100), tree.boxes[0], tree.reach)
    assert (lanes.step, len(lanes.path), lanes.stride) == (0, 1, 16)
    assert lanes.size == pytest.approx(np.sqrt(3))


def test_skew_is_the_distance_from_orthonormal():
    turn, move = np.tile(np.eye(3), (20, 1, 1, 1)), np.zeros((20, 1, 3))
    turn[7, 0, 0, 0] = 1 + 1e-8
    lanes = pose_lanes(turn, move, 0, np.arange(20), np.zeros(16), 1.0)
    assert lanes.skew == pytest.approx(2e-8, rel=1e-3)


def test_poses_in_any_order_of_memory_give_the_same_entries(moving):
    _, turn, move, tree, lanes = moving
    turned, placed_ = np.asfortranarray(turn), np.asfortranarray(move)
    other = pose_lanes(turned, placed_, 1, FRAMES, tree.boxes[0], tree.reach)
    assert np.array_equal(other.entries, lanes.entries)
    assert np.array_equal(other.path, lanes.path)
