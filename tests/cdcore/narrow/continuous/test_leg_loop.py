"""Legs that no bound covers are told from those that were searched; the order of the two bodies changes nothing."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from shapes import box_mesh

from cdcore.narrow.continuous.leg_loop import HALF_TURN, TOO_LARGE, decide_legs
from cdcore.narrow.continuous.search import FREE, HIT, make_room
from cdcore.narrow.spacetime.box_tree import build_box_tree

TREES = [build_box_tree(box_mesh((0.1, 0.1, 0.1)).triangles), build_box_tree(box_mesh((0.4, 0.02, 0.02)).triangles)]


def decide(turn, move, trees=TREES):
    states, shares, faces = np.zeros(1, np.uint8), np.zeros((1, 2)), np.full((1, 2), -1)
    decide_legs(
        trees[0], 0, trees[1], 1, turn, move, np.array([1]), np.array([1.0]), np.array([1e-4, 1e-7]), 10_000,
        make_room(*trees), states, shares, faces,
    )  # fmt: skip
    return int(states[0]), shares[0], faces[0]


def poses(degrees=(0.0, 0.0), offset=(0.0, 0.15, 0.0)):
    turn, move = np.tile(np.eye(3), (2, 2, 1, 1)), np.zeros((2, 2, 3))
    for body in (0, 1):
        turn[1, body] = Rotation.from_euler("z", degrees[body], degrees=True).as_matrix()
    move[:, 0] = offset
    return turn, move


def test_half_a_turn_is_told_and_a_little_less_is_searched():
    assert decide(*poses((0, 180)))[0] == HALF_TURN
    assert decide(*poses((180, 0)))[0] == HALF_TURN
    assert decide(*poses((0, 179.99)))[0] == HIT


def test_coordinates_beyond_the_bounds_are_told():
    assert decide(*poses(offset=(1e80, 0, 0)))[0] == TOO_LARGE


@pytest.mark.parametrize("degrees", [(30, 0), (0, 30), (0, -30), (25, -25)])
def test_the_answer_is_that_of_the_swapped_pair(degrees):
    turn, move = poses(degrees)
    state, shares, faces = decide(turn, move)
    turned = decide(turn[:, ::-1].copy(), move[:, ::-1].copy(), TREES[::-1])
    assert state == turned[0]
    assert shares.tolist() == turned[1].tolist()
    if state == HIT:
        assert faces.tolist() == turned[2][::-1].tolist()


def test_a_bar_that_turns_into_a_block_hits_it_and_one_that_turns_short_of_it_does_not():
    assert decide(*poses((0, 80)))[0] == HIT
    assert decide(*poses((0, 5)))[0] == FREE
