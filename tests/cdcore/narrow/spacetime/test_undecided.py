"""Exact arithmetic on faces left open rounds the world points as ``place_points`` does."""

import numpy as np
from support.motions import rotations

from cdcore.narrow.spacetime.box_tree import build_box_tree
from cdcore.narrow.spacetime.pose_lanes import pose_lanes
from cdcore.narrow.spacetime.undecided import decide_undecided
from cdcore.narrow.triangles.predicates import triangles_intersect
from cdcore.numerics import place_points


def test_answers_are_those_of_the_predicate_at_the_reference_vertices():
    rng = np.random.default_rng(8)
    frames = 300
    turn, move = rotations(rng, (frames, 2)), rng.normal(size=(frames, 2, 3))
    turn[:, 1], move[:, 1] = turn[:, 0], move[:, 0]
    flat = rng.integers(0, 4, (2, 3, 3)).astype(float)
    trees = [build_box_tree(flat[k : k + 1]) for k in range(2)]
    a, b = (pose_lanes(turn, move, k, np.arange(frames), trees[k].boxes[0], trees[k].reach) for k in range(2))
    hits = np.zeros(frames, dtype=np.uint8)
    answers, exact, integers = decide_undecided(np.arange(frames), (0, 0), 0, tuple(trees), (a, b), True, hits)
    assert (exact, integers) == (frames, 0)
    world = np.array([[place_points(flat[k], turn[f, k], move[f, k]) for k in range(2)] for f in range(frames)])
    want = triangles_intersect(world)
    assert np.array_equal(answers, want)
    assert np.array_equal(hits, want)
