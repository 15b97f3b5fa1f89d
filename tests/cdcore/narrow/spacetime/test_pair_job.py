"""Repeated and missing poses are left out and come back in the answer."""

import numpy as np
from motions import grid_plate

from cdcore.narrow.spacetime.box_tree import build_box_tree
from cdcore.narrow.spacetime.pair_job import PairJob, Poses

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
    assert asked.stretch(0, 3).hits.tolist() == [False, True, False]


def test_frames_without_a_pose_are_left_out():
    valid = np.ones((4, 2), dtype=bool)
    valid[1, 0] = valid[2, 1] = False
    asked = job(poses([0, 0, 0, 1], valid))
    assert asked.frames.tolist() == [0, 3]


def test_faces_come_in_the_order_of_the_pair_whichever_body_is_larger():
    forward, backward = job(poses([0.0])).stretch(0, 1), job(poses([0.0]), 1, 0).stretch(0, 1)
    assert len(forward.faces) > 8
    assert forward.faces[:, 0].max() < 8 <= forward.faces[:, 1].max()
    assert sorted(map(tuple, forward.faces[:, ::-1].tolist())) == [tuple(row) for row in backward.faces.tolist()]


def test_any_stretch_answers_as_the_whole_does():
    asked = job(poses([0, 0.5, -0.5, 0, 1e-300, 0.25]))
    whole = asked.stretch(0, asked.count)
    parts = [asked.stretch(k, k + 2) for k in range(0, asked.count, 2)]
    assert np.array_equal(whole.hits, np.concatenate([part.hits for part in parts]))
    assert np.array_equal(whole.faces, np.concatenate([part.faces for part in parts]))
    assert np.array_equal(whole.frame, np.concatenate([part.frame for part in parts]))
