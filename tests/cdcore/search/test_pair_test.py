"""An evaluation tests every pair whose balls overlap, each once, and never skips one that touches."""

import numpy as np
import pytest
from support.search_scenes import I3, search_of
from support.shapes import box_mesh, random_rotations

from cdcore import TriangleMesh, intersecting_faces
from cdcore.kernels.compiling import kernel
from cdcore.numerics import place_points
from cdcore.search.features import features_of
from cdcore.search.pair_test import grow_table, is_new, meeting_pairs, placed_pairs
from cdcore.search.state import COUNTERS, ENTRIES, GENERATION, POSES, WORLD_A, WORLD_B


@kernel
def enter_all(table, count, keys, answers):
    for k in range(keys.shape[0]):
        answers[k] = is_new(table, count, keys[k])


def entered(table, count, keys):
    answers = np.zeros(len(keys), dtype=np.int64)
    enter_all(table, count, np.asarray(keys, dtype=np.int64), answers)
    return answers.astype(bool).tolist()


def test_the_table_knows_what_was_entered_and_nothing_else_also_after_growing():
    table, count = np.zeros((64, 2), dtype=np.int64), np.zeros(COUNTERS, dtype=np.int64)
    count[GENERATION] = 1
    keys = np.random.default_rng(0).permutation(10_000)[:30]
    assert all(entered(table, count, keys))
    assert not any(entered(table, count, keys))
    larger = np.zeros((128, 2), dtype=np.int64)
    grow_table(table, larger, count)
    assert count[ENTRIES] == 30
    assert not any(entered(larger, count, keys))
    assert all(entered(larger, count, keys + 20_000))


def test_a_new_generation_forgets_and_a_full_table_ends():
    table, count = np.zeros((16, 2), dtype=np.int64), np.zeros(COUNTERS, dtype=np.int64)
    for generation in (1, 2, 3):
        count[GENERATION], count[ENTRIES] = generation, 0
        assert all(entered(table, count, np.arange(12)))
        assert all(entered(table, count, np.arange(100, 150)))
        assert not any(entered(table, count, np.arange(12)))


@pytest.mark.parametrize("local", [0.0, 1.0, 1e3])
@pytest.mark.parametrize("world", [0.0, 1.0, 1e3, 1e6])
def test_touching_faces_are_never_skipped_wherever_they_lie(local, world):
    # one corner shared, the balls round both faces tangent there: they are thin and point at each other
    rng = np.random.default_rng(3)
    tip = np.array([local, 0.0, 0.0])
    away = np.array([[0, 0, 0], [0.5, 0.01, 0], [0.5, -0.01, 0]])
    meshes = [TriangleMesh(tip + side * away, [[0, 1, 2]]) for side in (1.0, -1.0)]
    search = search_of(*meshes, variant="random", budget=1)
    for turn in random_rotations(rng, 200):
        # the same pose for both, so that the shared corner stays shared to the bit
        pose = turn, rng.normal(size=3) * world
        assert search.look(pose, pose, 0.0).hit == (0, 0)


def test_faces_further_apart_than_their_balls_are_not_tested():
    triangle = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    search = search_of(triangle, triangle, variant="random", budget=50)
    look = search.look((I3, np.array([3.0, 0, 0])), (I3, np.zeros(3)), 0.0)
    assert (look.tests, look.evaluations) == (0, 50)
    near = search.look((I3, np.array([0.0, 0, 0.5])), (I3, np.zeros(3)), 0.0)
    assert (near.tests, near.evaluations, near.hit) == (1, 50, None)


@pytest.mark.parametrize("scale", [1.0, 2.0**-600, 2.0**500])
def test_boxes_that_share_a_side_meet_in_exactly_the_exact_pairs(scale):
    mesh = box_mesh((scale, scale, scale))
    features = features_of(mesh)
    pose = np.zeros(POSES)
    for at, x in ((WORLD_A, scale), (WORLD_B, 0.0)):
        pose[at : at + 9] = np.eye(3).ravel()
        pose[at + 9] = x
    every = np.stack(np.divmod(np.arange(144), 12), axis=1)
    found = meeting_pairs(features, features, pose, every)
    away = np.eye(4)
    away[0, 3] = scale
    faces = {(int(features.face[i]), int(features.face[j])) for i, j in found}
    assert faces == {tuple(row) for row in intersecting_faces(mesh, mesh, away).tolist()}
    assert 0 < len(found) < 144


def test_corners_are_placed_as_the_points_that_count():
    features = features_of(box_mesh())
    rng = np.random.default_rng(0)
    pose = rng.normal(size=POSES)
    pairs = np.array([[3, 5]])
    corners = features.rows[5, 4:].reshape(3, 3)
    expected = place_points(corners, pose[WORLD_B : WORLD_B + 9].reshape(3, 3), pose[WORLD_B + 9 : WORLD_B + 12])
    assert np.array_equal(placed_pairs(features, features, pose, pairs)[0, 1], expected)
