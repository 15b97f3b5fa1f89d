"""Boxes called apart share no point; fifteen axes separate whenever boxes are apart, six sometimes do not."""

import numpy as np
from scipy.optimize import linprog
from support.shapes import random_rotations
from support.slow_trees import boxes_apart

from cdcore.kernels import box_axes
from cdcore.kernels.compiling import kernel


@kernel
def verdicts(ca, ra, ha, cb, rb, hb, turn, move, pad):
    m, d = np.empty((3, 3)), np.empty(3)
    box_axes.box_seen_from(ca, ra, cb, rb, turn, move, m, d)
    return box_axes.apart_on_all_axes(m, d, ha, hb, pad), box_axes.apart_on_face_axes(m, d, ha, hb, pad)


@kernel
def seen_from(ra, ta, rb, tb):
    turn, move = np.empty((3, 3)), np.empty(3)
    box_axes.pose_seen_from(ra, ta, rb, tb, turn, move)
    return turn, move


def scene(rng):
    axes, turns = random_rotations(rng, 2), random_rotations(rng, 2)
    centres, halves = rng.normal(size=(2, 3)) * 0.3, rng.random((2, 3)) + 0.05
    moves = rng.normal(size=(2, 3)) * 0.9
    return axes, turns, centres, halves, moves


def test_the_pose_of_one_body_in_the_frame_of_another_takes_points_there():
    rng = np.random.default_rng(0)
    (ra, rb), (ta, tb) = random_rotations(rng, 2), rng.normal(size=(2, 3))
    turn, move = seen_from(ra, ta, rb, tb)
    point = rng.normal(size=3)
    assert np.allclose(ra @ (turn @ point + move) + ta, rb @ point + tb, atol=1e-14)


def test_fifteen_axes_agree_with_a_projection_of_all_corners_and_six_never_separate_more():
    rng = np.random.default_rng(1)
    counts = np.zeros(3, dtype=int)
    for _ in range(700):
        axes, turns, centres, halves, moves = scene(rng)
        turn, move = seen_from(turns[0], moves[0], turns[1], moves[1])
        full, faces = verdicts(centres[0], axes[0], halves[0], centres[1], axes[1], halves[1], turn, move, 0.0)
        a, b = ((centres[k], axes[k], halves[k]) for k in (0, 1))
        want = [boxes_apart(a, (turns[0], moves[0]), b, (turns[1], moves[1]), edges=edges) for edges in (True, False)]
        assert [full, faces] == want
        counts += [full, faces, full and not faces]
    assert counts.min() > 7


def test_boxes_not_apart_on_fifteen_axes_have_a_point_in_common():
    """The claim behind the axes, against linear programming: |axes (x - centre)| <= half for both boxes."""
    rng = np.random.default_rng(2)
    outcomes = set()
    for _ in range(60):
        axes, _, centres, halves, moves = scene(rng)
        eye = np.eye(3)
        full, _ = verdicts(centres[0], axes[0], halves[0], centres[1], axes[1], halves[1], eye, moves[0], 0.0)
        rows, limits = [], []
        for k, centre in enumerate((centres[0], centres[1] + moves[0])):
            rows += [axes[k], -axes[k]]
            limits += [halves[k] + axes[k] @ centre, halves[k] - axes[k] @ centre]
        feasible = linprog(np.zeros(3), np.vstack(rows), np.concatenate(limits), bounds=(None, None)).status == 0
        assert full != feasible
        outcomes.add(feasible)
    assert outcomes == {True, False}


def test_a_pad_keeps_boxes_together_that_are_apart_by_less():
    eye, zero, one = np.eye(3), np.zeros(3), np.ones(3)
    for gap, pad, apart in [(0.1, 0.05, True), (0.1, 0.2, False), (0.0, 0.0, False)]:
        move = np.array([2.0 + gap, 0, 0])
        assert verdicts(zero, eye, one, zero, eye, one, eye, move, pad) == (apart, apart)
