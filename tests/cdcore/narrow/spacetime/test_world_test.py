"""The world test never contradicts the predicate at the reference vertices, and leaves only near-ties open."""

import numpy as np
import pytest
from support.motions import rotations

from cdcore.kernels.compiling import kernel
from cdcore.narrow.spacetime.box_tree import build_box_tree
from cdcore.narrow.spacetime.pose_lanes import pose_lanes
from cdcore.narrow.spacetime.world_test import UNDECIDED, faces_meet
from cdcore.narrow.triangles.predicates import triangles_intersect
from cdcore.numerics import place_points
from replay.studies.stress.families import FAMILIES


@kernel
def asked(placed_a, pose_a, edge_a, placed_b, pose_b, edge_b, frame):
    scratch = np.empty(8)
    zero = 0 * frame
    return faces_meet(
        placed_a, zero, edge_a, pose_a.entries, pose_a.stride, frame * pose_a.step, placed_b, zero, edge_b,
        pose_b.entries, pose_b.stride, frame * pose_b.step, scratch,
    )  # fmt: skip


def answers(pair, turn, move):
    trees = [build_box_tree(pair[k : k + 1]) for k in range(2)]
    lanes = [pose_lanes(turn, move, k, np.arange(len(turn)), trees[k].boxes[0], trees[k].reach) for k in range(2)]
    placed = [tree.placed.ravel() for tree in trees]
    edges = [float(tree.planes[0, 10]) * 1.001 for tree in trees]
    ours = [asked(placed[0], lanes[0], edges[0], placed[1], lanes[1], edges[1], f) for f in range(len(turn))]
    world = [[place_points(pair[k], turn[f, k], move[f, k]) for k in range(2)] for f in range(len(turn))]
    return np.array(ours), triangles_intersect(np.array(world))


@pytest.mark.parametrize("number", [1, 2, 3, 6, 9, 10, 12, 13, 14, 15, 16, 17, 18, 20, 21, 22, 24])
def test_a_certain_answer_is_the_predicates(number):
    rng = np.random.default_rng(number)
    turn = rotations(rng, (6, 2))
    turn[:, 1] = turn[:, 0]
    turn[0] = np.eye(3)
    move = np.repeat(rng.normal(size=(6, 1, 3)) * (number < 14), 2, axis=1)
    move[0] = 0
    for pair in FAMILIES[number - 1].pairs(12, seed=31):
        ours, truth = answers(pair, turn, move)
        certain = ours != UNDECIDED
        assert np.array_equal(ours[certain], truth[certain])


def test_ordinary_pairs_are_all_certain():
    rng = np.random.default_rng(0)
    turn, move = rotations(rng, (200, 2)), rng.normal(size=(200, 2, 3)) * 0.3
    ours, truth = answers(rng.normal(size=(2, 3, 3)), turn, move)
    assert np.array_equal(ours, truth)
    assert 0 < truth.sum() < 200
