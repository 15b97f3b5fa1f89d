"""Repeated and missing poses are left out and come back in the answer."""

import numpy as np
import pytest
from support.motions import grid_plate

from cdcore.narrow.spacetime.box_tree import build_box_tree
from cdcore.narrow.spacetime.pair_job import PairJob, Poses
from cdcore.narrow.spacetime.pose_lanes import pose_lanes
from cdcore.narrow.spacetime.traverse import Workspace

TREES = [build_box_tree(grid_plate(2)), build_box_tree(grid_plate(4))]


def poses(places, valid=None):
    move = np.zeros((len(places), 2, 3))
    move[:, 0, 2] = places
    turn = np.tile(np.eye(3), (len(places), 2, 1, 1))
    return Poses(turn, move, np.ones((len(places), 2), dtype=bool) if valid is None else valid)


def job(given, i=0, j=1):
    return PairJob(TREES, i, j, given, [None, None], faces=True, verify=False)


def test_repeats_are_asked_once():
    asked = job(poses([1, 1, 1, 0, 0, 2, 2, 2]))
    assert asked.count == 3
    assert asked.which.tolist() == [0, 0, 0, 1, 1, 2, 2, 2]
    assert asked.stretch(0, 3, Workspace()).hits.tolist() == [False, True, False]


def test_frames_without_a_pose_are_left_out():
    valid = np.ones((4, 2), dtype=bool)
    valid[1, 0] = valid[2, 1] = False
    asked = job(poses([0, 0, 0, 1], valid))
    assert asked.frames.tolist() == [0, 3]


def test_faces_come_in_the_order_of_the_pair_whichever_body_is_larger():
    forward, backward = job(poses([0.0])).stretch(0, 1, Workspace()), job(poses([0.0]), 1, 0).stretch(0, 1, Workspace())
    assert len(forward.faces) > 8
    assert forward.faces[:, 0].max() < 8 <= forward.faces[:, 1].max()
    assert sorted(map(tuple, forward.faces[:, ::-1].tolist())) == [tuple(row) for row in backward.faces.tolist()]


def test_bodies_that_spans_keep_apart_are_asked_frame_by_frame_without_looking_for_repeats():
    given = poses([5.0] * 40 + [6.0] * 60)
    lanes = [
        pose_lanes(given.rotations, given.translations, k, given.everywhere, TREES[k].boxes[0], 9.0) for k in (0, 1)
    ]
    asked = PairJob(TREES, 0, 1, given, lanes, faces=False, verify=False)
    assert asked.count == 100
    assert asked.first_near(0) == asked.first_near(63) == 100
    assert not asked.stretch(0, 100, Workspace()).hits.any()


@pytest.mark.parametrize("scale", [1e-101, 1e76])
def test_bodies_too_small_or_too_large_for_the_bounds_are_decided_exhaustively(scale):
    trees = [build_box_tree(grid_plate(size) * scale) for size in (2, 4)]
    move = np.zeros((3, 2, 3))
    move[1, 0, 2] = scale
    given = Poses(np.tile(np.eye(3), (3, 2, 1, 1)), move, np.ones((3, 2), dtype=bool))
    asked = PairJob(trees, 0, 1, given, [None, None], faces=False, verify=False)
    found = asked.stretch(0, 3, Workspace())
    assert found.hits.tolist() == [True, False, True]
    assert not found.work.any()


def test_any_stretch_answers_as_the_whole_does():
    asked = job(poses([0, 0.5, -0.5, 0, 1e-300, 0.25]))
    whole = asked.stretch(0, asked.count, Workspace())
    parts = [asked.stretch(k, k + 2, Workspace()) for k in range(0, asked.count, 2)]
    assert np.array_equal(whole.hits, np.concatenate([part.hits for part in parts]))
    assert np.array_equal(whole.faces, np.concatenate([part.faces for part in parts]))
    assert np.array_equal(whole.frame, np.concatenate([part.frame for part in parts]))
