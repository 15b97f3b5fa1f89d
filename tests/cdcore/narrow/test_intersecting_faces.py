"""One placement of two meshes: all pairs of faces, one pair, and the answer of a search are the predicate's."""

import numpy as np
import pytest
from support.motions import placed, rotations, soup
from support.shapes import random_rotations

from cdcore import TriangleMesh, intersecting_faces
from cdcore.errors import InvalidPoseError
from cdcore.narrow import brute_force as exhaustive
from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.narrow.face_pair import decided_by_integers, faces_meet, keep_found
from cdcore.narrow.triangles.filter import UNDECIDED
from cdcore.narrow.triangles.predicates import triangles_intersect
from cdcore.narrow.triangles.sums import new_digits
from cdcore.numerics import place_points


def mesh_of(triangles):
    return TriangleMesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3))


def test_it_equals_the_exhaustive_test():
    rng = np.random.default_rng(1)
    a, b = soup(rng, 60), soup(rng, 50)
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = rotations(rng, (2,)), rng.normal(size=(2, 3)) * 0.3
    found = intersecting_faces(mesh_of(a), mesh_of(b), *poses)
    want = meeting_faces_exhaustive(*(placed(t, p[:3, :3], p[:3, 3]) for t, p in zip((a, b), poses, strict=True)))
    assert found.dtype == np.int64
    assert len(want) > 5
    assert np.array_equal(found, want)


def test_a_pose_that_is_none_is_refused_by_its_body():
    mesh = mesh_of(np.zeros((1, 3, 3)))
    with pytest.raises(InvalidPoseError, match="body B"):
        intersecting_faces(mesh, mesh, np.eye(4), np.full((4, 4), np.nan))


def test_it_finds_exactly_the_pairs_the_predicate_says_meet(monkeypatch):
    rng = np.random.default_rng(0)
    first, second = soup(rng, 23, 1.0), soup(rng, 31, 1.0)
    every = np.array([[a, b] for a in first for b in second])
    want = np.argwhere(triangles_intersect(every).reshape(23, 31))
    assert len(want) > 10
    assert np.array_equal(meeting_faces_exhaustive(first, second), want)
    monkeypatch.setattr(exhaustive, "PAIRS_AT_ONCE", 40)
    assert np.array_equal(meeting_faces_exhaustive(first, second), want)


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
