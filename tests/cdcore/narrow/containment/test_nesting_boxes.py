"""A box lets through what lies in it, wherever both bodies are and however their poses are laid out."""

import numpy as np
import pytest
from support.motions import random_rotations

from cdcore.narrow.containment.nesting_boxes import may_be_inside
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


def test_what_lies_between_the_parts_of_a_body_is_let_through_by_none_of_their_boxes():
    turns, places = np.tile(np.eye(3), (3, 2, 1, 1)), np.zeros((3, 2, 3))
    places[:, 0, 0] = [-0.5, 0.0, 0.5]
    boxes = np.array([[[-0.7, -1, -1], [0.7, 1, 1]], [[-0.7, -1, -1], [-0.3, 1, 1]], [[0.3, -1, -1], [0.7, 1, 1]]])
    may = np.empty(3, dtype=bool)
    may_be_inside(turns, places, np.arange(3), 0, 1, np.zeros((1, 3)), boxes, 1.0, PAD, may)
    assert may.tolist() == [True, False, True]
