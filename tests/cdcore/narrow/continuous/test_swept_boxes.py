"""Boxes that are said to stay apart hold no points that meet on the way."""

import numpy as np
from shapes import random_rotations

from cdcore.kernels.compiling import kernel
from cdcore.narrow.continuous.swept_boxes import boxes_stay_apart, turned_between


@kernel
def stay_apart(box_a, box_b, before, after, margin):
    return boxes_stay_apart(box_a, box_b, before, after, turned_between(before, after), margin, np.empty(15))


def box(rng, spread):
    half = rng.uniform(0.01, 0.3, 3)
    axes = random_rotations(rng)
    return np.concatenate([rng.normal(size=3) * spread, axes.ravel(), half, [np.linalg.norm(half)]])


def inside(box_, points):
    return (np.abs((points - box_[:3]) @ box_[3:12].reshape(3, 3).T) <= box_[12:15]).all(axis=1)


def sampled(rng, box_, count=400):
    along = rng.uniform(-1, 1, (count, 3))
    along[: count // 2] = np.sign(along[: count // 2])
    return box_[:3] + (along * box_[12:15]) @ box_[3:12].reshape(3, 3)


def test_boxes_said_to_stay_apart_share_no_point_along_the_chords():
    rng = np.random.default_rng(2)
    said = met = 0
    for _ in range(600):
        a, b = box(rng, 0.1), box(rng, 0.1)
        turns, places = random_rotations(rng, 2), rng.normal(size=(2, 3)) * 0.5
        if rng.random() < 0.5:
            turns[1] = turns[0]
        poses = [np.concatenate([turns[k].ravel(), places[k]]) for k in (0, 1)]
        points = sampled(rng, a)
        ends = [points @ turns[k].T + places[k] for k in (0, 1)]
        meets = any(inside(b, (1 - s) * ends[0] + s * ends[1]).any() for s in np.linspace(0, 1, 9))
        if stay_apart(a, b, *poses, 1e-12):
            said += 1
            assert not meets
        met += meets
    assert said > 100
    assert met > 100


def test_a_margin_wider_than_the_gap_takes_the_proof_away():
    unit = np.concatenate([[0, 0, 0], np.eye(3).ravel(), [1, 1, 1], [np.sqrt(3)]])
    pose = np.concatenate([np.eye(3).ravel(), [2.5, 0, 0]])
    assert stay_apart(unit, unit, pose, pose, 0.49)
    assert not stay_apart(unit, unit, pose, pose, 0.51)
