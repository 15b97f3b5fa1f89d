"""The sphere stage rejects no pair that touches, and leaping over frames changes no verdict."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.shapes import random_rotations, unturned

from cdcore import Verdict
from cdcore.bounding.bounding_sphere import Sphere
from cdcore.broad.sphere_stage import SphereStage, last_certain_frame, place_centres
from cdcore.kernels.compiling import kernel
from cdcore.numerics import place_points

ALL = np.array([(i, j) for i in range(5) for j in range(i + 1, 5)])


@pytest.mark.parametrize("offset", [0.0, 1e3, 1e7])
def test_skipping_changes_no_verdict_on_paths_that_graze_the_gap(offset):
    # A ball comes straight on and stops where the spheres touch exactly: the leap must land no later.
    frames = 400
    way = np.linspace(1.0, 0.0, frames)
    places = np.zeros((frames, 2, 3))
    places[:, 0, 0] = 2.0 + way + offset
    places[:, 1, 0] = offset
    motion = unturned(places)
    balls = [Sphere(np.zeros(3), 1.0), Sphere(np.zeros(3), 1.0)]
    pair = np.array([[0, 1]])
    leaping = SphereStage(balls, pair).candidates(motion)
    plain = SphereStage(balls, pair, skip=False).candidates(motion)
    assert leaping.verdict.tobytes() == plain.verdict.tobytes()
    assert plain.verdict[-1, 0] == Verdict.CANDIDATE
    assert leaping.work["sphere_tests"] < frames / 4


def test_a_jump_across_missing_poses_is_not_leapt_over():
    places = np.zeros((30, 2, 3))
    places[:10, 0, 0], places[20:, 0, 0] = 9.0, 0.5
    valid = np.ones((30, 2), dtype=bool)
    valid[10:20, 0] = False
    motion = unturned(places, valid=valid)
    verdict = SphereStage([Sphere(np.zeros(3), 1.0)] * 2, np.array([[0, 1]])).candidates(motion).verdict[:, 0]
    assert verdict.tolist() == [Verdict.CLEAR] * 10 + [Verdict.NO_POSE] * 10 + [Verdict.CANDIDATE] * 10


@kernel
def last_certain(path_a, path_b, frame, gap):
    return last_certain_frame(path_a, path_b, frame, gap)


def test_centres_are_placed_to_the_bit_like_any_point_and_paths_add_up():
    rng = np.random.default_rng(0)
    turn, place = random_rotations(rng, 50, 3), rng.normal(size=(50, 3, 3))
    valid = np.ones((50, 3), dtype=bool)
    valid[20:25, 1] = False
    centres, radii = rng.normal(size=(3, 3)), rng.uniform(1, 2, 3)
    world, path, size = np.empty((3, 50, 3)), np.empty((3, 50)), np.empty((3, 50))
    place_centres(turn, place, valid, centres, radii, world, path, size)
    for k in range(3):
        placed = place_points(centres[[k]], turn[:, k], place[:, k])[:, 0]
        assert world[k][valid[:, k]].tobytes() == placed[valid[:, k]].tobytes()
        steps = np.linalg.norm(np.diff(placed[valid[:, k]], axis=0), axis=1)
        assert np.allclose(path[k][valid[:, k]], np.concatenate([[0], np.cumsum(steps)]), rtol=1e-13)
        expected = np.linalg.norm(centres[k]) + radii[k] + np.abs(place[:, k]).max(axis=1)
        assert np.allclose(size[k][valid[:, k]], expected[valid[:, k]], rtol=1e-13)
    assert (path[1, 20:25] == path[1, 19]).all()


@given(st.lists(st.floats(0, 1), min_size=1, max_size=60), st.integers(0, 59), st.floats(0.001, 20))
def test_the_leap_goes_to_the_last_frame_before_the_gap_is_used_up(steps, start, gap):
    path = np.cumsum(steps)
    start = min(start, len(path) - 1)
    last = last_certain(path, path, start, gap)
    moved = (path + path) - (path[start] + path[start])
    expected = start
    while expected + 1 < len(path) and moved[expected + 1] < gap:
        expected += 1
    assert last == expected
