"""A box lets through what lies in it, wherever both bodies are and however their poses are laid out."""

import numpy as np
import pytest
from support.motions import random_rotations

from cdcore import Motion
from cdcore.narrow.containment.nesting_boxes import Nesting, NestingBoxes, may_be_inside
from cdcore.numerics import EPS

BOX = np.array([[-1.0, -2.0, -3.0], [1.0, 2.0, 3.0]])
PAD = 1024 * EPS


def test_a_point_is_judged_in_the_frame_of_the_box():
    rng = np.random.default_rng(0)
    turns, places, inside = random_rotations(rng, 600).reshape(300, 2, 3, 3), rng.normal(size=(300, 2, 3)), 0
    may = np.empty(1, dtype=bool)
    for k in range(300):
        point = rng.normal(size=(1, 3)) * 2
        seen = turns[k, 1].T @ (turns[k, 0] @ point[0] + places[k, 0] - places[k, 1])
        may_be_inside(turns, places, np.array([k]), 0, 1, point, BOX[None], 8.0, 0.0, may)
        assert may[0] == ((seen >= BOX[0]).all() and (seen <= BOX[1]).all())
        inside += int(may[0])
    assert 30 < inside < 270


@pytest.mark.parametrize("world", [0.0, 1.0, 1e6])
def test_the_corners_of_the_box_itself_are_let_through_wherever_it_stands(world):
    rng = np.random.default_rng(1)
    corners = np.array([[x, y, z] for x in (-1.0, 1) for y in (-2.0, 2) for z in (-3.0, 3)])
    turn, place = random_rotations(rng, 500), rng.normal(size=(500, 3)) * world
    turns, places = np.repeat(turn[:, None], 2, 1), np.repeat(place[:, None], 2, 1)
    may = np.empty(500, dtype=bool)
    may_be_inside(turns, places, np.arange(500), 0, 1, corners, BOX[None], 8.0, PAD, may)
    assert may.all()
    may_be_inside(turns, places, np.arange(500), 0, 1, corners * (1 + 1e-6 + 1e-11 * world), BOX[None], 8.0, PAD, may)
    assert not may.any()


def test_one_point_outside_is_enough_and_frames_are_those_asked_for():
    turns, places = np.tile(np.eye(3), (3, 2, 1, 1)), np.zeros((3, 2, 3))
    places[1, 0, 0] = 5.0
    may = np.empty(2, dtype=bool)
    inside, partly = np.array([[0.5, 0, 0], [-0.5, 0, 0]]), np.array([[0.5, 0, 0], [-1.5, 0, 0]])
    may_be_inside(turns, places, np.array([0, 1]), 0, 1, inside, BOX[None], 8.0, PAD, may)
    assert may.tolist() == [True, False]
    may_be_inside(turns, places, np.array([0, 2]), 0, 1, partly, BOX[None], 8.0, PAD, may)
    assert may.tolist() == [False, False]


def test_what_lies_between_the_parts_of_a_body_is_let_through_by_none_of_their_boxes():
    turns, places = np.tile(np.eye(3), (3, 2, 1, 1)), np.zeros((3, 2, 3))
    places[:, 0, 0] = [-0.5, 0.0, 0.5]
    boxes = np.array([[[-0.7, -1, -1], [0.7, 1, 1]], [[-0.7, -1, -1], [-0.3, 1, 1]], [[0.3, -1, -1], [0.7, 1, 1]]])
    may = np.empty(3, dtype=bool)
    may_be_inside(turns, places, np.arange(3), 0, 1, np.zeros((1, 3)), boxes, 1.0, PAD, may)
    assert may.tolist() == [True, False, True]


def matrices(turns, places):
    poses = np.zeros((*turns.shape[:2], 4, 4))
    poses[..., :3, :3], poses[..., :3, 3], poses[..., 3, 3] = turns, places, 1.0
    return poses


@pytest.mark.parametrize("moving", [3, 2])
def test_all_pairs_at_once_say_what_each_says_alone_of_poses_in_arrays_and_side_by_side(moving):
    rng = np.random.default_rng(3)
    turns, places = random_rotations(rng, 1200).reshape(400, 3, 3, 3), rng.normal(size=(400, 3, 3))
    turns[:, moving:], places[:, moving:] = turns[:1, moving:], places[:1, moving:]
    part = np.concatenate([BOX[None], [[[-1, -2, -3], [0, 2, 3]], [[0.5, -2, -3], [1, 2, 3]]]])
    nestings = [
        [
            Nesting(0, 1, rng.normal(size=(2, 3)) * 0.5, BOX[None], 8.0),
            Nesting(1, 0, rng.normal(size=(1, 3)), part, 8.0),
        ],
        [],
        [Nesting(2, 1, rng.normal(size=(1, 3)), part, 8.0)],
    ]
    frames, columns = rng.integers(0, 400, 900), rng.integers(0, 3, 900)
    expected = np.zeros(900, dtype=bool)
    for k in range(900):
        for inner, outer, points, boxes, _ in nestings[columns[k]]:
            frame = frames[k]
            way = points @ turns[frame, inner].T + places[frame, inner] - places[frame, outer]
            seen = way @ turns[frame, outer]
            held = ((seen >= boxes[:, :1]) & (seen <= boxes[:, 1:])).all(axis=(1, 2))
            expected[k] |= held[0] and (len(boxes) == 1 or held[1:].any())
    motion = Motion(np.arange(400), places, turns)
    np.testing.assert_array_equal(NestingBoxes(nestings).may_hold(motion, frames, columns, 0.0), expected)
    assert 50 < expected[columns == 0].sum() < 250 and expected[columns == 2].sum() > 20
    assert not expected[columns == 1].any()


def test_of_no_pair_that_could_nest_nothing_may():
    motion = Motion(np.arange(2), np.zeros((2, 2, 3)), np.tile(np.eye(3), (2, 2, 1, 1)))
    assert NestingBoxes([[]]).may_hold(motion, np.arange(2), np.zeros(2, dtype=np.int64), 0.0).tolist() == [
        False,
        False,
    ]
