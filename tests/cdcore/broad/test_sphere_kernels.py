"""The compiled sphere loops use the numbers of the glossary, the points that count, and leap to the right frame."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from shapes import random_rotations

from cdcore import Verdict
from cdcore.broad import sphere_kernels
from cdcore.broad.sphere_kernels import last_certain_frame, place_centres
from cdcore.kernels.compiling import kernel
from cdcore.numerics import place_points


@kernel
def last_certain(path_a, path_b, frame, gap):
    return last_certain_frame(path_a, path_b, frame, gap)


def test_the_verdicts_written_are_those_of_the_glossary():
    assert sphere_kernels.CLEAR == Verdict.CLEAR
    assert sphere_kernels.CANDIDATE == Verdict.CANDIDATE
    assert sphere_kernels.NO_POSE == Verdict.NO_POSE


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
