"""The leaf test is the exact test of faces placed as the reference vertices, integers where sums cannot tell."""

import numpy as np
from support.shapes import random_rotations

from cdcore import triangles_intersect
from cdcore.narrow.face_pair import decided_by_integers, faces_meet, keep_found
from cdcore.narrow.triangles.filter import UNDECIDED
from cdcore.narrow.triangles.sums import new_digits
from cdcore.numerics import place_points


def test_two_faces_meet_where_the_exact_test_of_the_placed_faces_says_so():
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(2, 200, 3, 3))
    b[:50] = a[:50, [1, 0, 2]]
    turns, moves = random_rotations(rng, 2, 200), rng.normal(size=(2, 200, 3)) * 0.3
    turns[1, :50], moves[1, :50] = turns[0, :50], moves[0, :50]
    pair, digits = np.empty((6, 3)), new_digits()
    found = [
        faces_meet(a, k, turns[0, k], moves[0, k], b, k, turns[1, k], moves[1, k], pair, digits) for k in range(200)
    ]
    world = np.stack([place_points(a, turns[0], moves[0]), place_points(b, turns[1], moves[1])], axis=1)
    want = triangles_intersect(world)
    assert np.array_equal(np.array(found) == 1, want)
    assert want[:50].all() and not want.all()


def test_coordinates_of_extreme_exponents_are_left_to_integers_which_decide_them():
    slope = np.array([[[0.0, 0, 0], [1, 0, 1], [0, 1, 0]]])
    below = [[1.0, 0, -1], [1, 0.1, -1]]
    corner = np.array([[[1e-300, 1e-301, 1e-300], *below], [[2e-300, 1e-301, 1e-300], *below]])
    up, here = np.eye(3), np.zeros(3)
    found = np.empty((1, 4), dtype=np.int64)
    for face in range(2):
        answer = faces_meet(slope, 0, up, here, corner, face, up, here, np.empty((6, 3)), new_digits())
        assert answer == UNDECIDED
        found = keep_found(found, face, 0, 0, face, answer)
    assert found.shape == (2, 4)
    kept = decided_by_integers(found, (slope, corner), (up[None],) * 2, (here[None],) * 2)
    assert kept[:, 1:3].tolist() == [[0, 0]]
