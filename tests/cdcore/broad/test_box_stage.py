"""The box stage rejects no pair that meets, and agrees with an exact separation of the boxes where that is clear."""

import numpy as np
import pytest
from scipy.optimize import linprog
from support.shapes import box_mesh, lab_bodies_and_motion, random_rotations

from cdcore import Motion, Verdict, create_detector
from cdcore.bounding.box import Box, box_best
from cdcore.broad.box_stage import BoxStage
from cdcore.broad.broad_phase import BroadPhase
from cdcore.protocol import resolve_pairs
from cdcore.tolerances import EPS

FIRST_AND_SECOND = np.array([[0, 1]])


def may_meet(boxes, positions, rotations):
    """Whether the box stage lets two boxes through, frame by frame."""
    count = len(positions)
    motion = Motion(np.arange(count), positions, rotations)
    return BoxStage(boxes, FIRST_AND_SECOND).may_meet(motion, np.arange(count), np.zeros(count, dtype=np.int64))


def boxes_touch_a_point(box_a, pose_a, box_b, pose_b):
    """Linear programme: s, t in the unit cubes with equal world points; independent of separating axes."""
    (ra, ta), (rb, tb) = pose_a, pose_b
    left = np.hstack([ra @ box_a.axes * box_a.half, -(rb @ box_b.axes) * box_b.half])
    right = (rb @ box_b.centre + tb) - (ra @ box_a.centre + ta)
    return linprog(np.zeros(6), A_eq=left, b_eq=right, bounds=[(-1, 1)] * 6).status == 0


@pytest.mark.slow
def test_the_fifteen_axes_agree_with_a_linear_programme():
    """Two boxes in a hundred random poses; the programme looks for a common point."""
    rng = np.random.default_rng(0)
    count = 100
    boxes = []
    for _ in range(2):
        half = rng.uniform(0.05, 1.0, 3)
        boxes.append(Box(rng.normal(size=3) * 0.3, random_rotations(rng), half))
    rotations, positions = random_rotations(rng, count, 2), rng.normal(size=(count, 2, 3)) * 0.8
    answers = may_meet(boxes, positions, rotations)
    expected = [
        boxes_touch_a_point(boxes[0], (rotations[k, 0], positions[k, 0]), boxes[1], (rotations[k, 1], positions[k, 1]))
        for k in range(count)
    ]
    assert 15 < sum(expected) < count - 15, "both answers are frequent"
    assert answers.tolist() == expected


@pytest.mark.parametrize("world", [0.0, 1.0, 1e3, 1e6])
@pytest.mark.parametrize("kind", ["face", "edge", "vertex"])
def test_boxes_that_touch_exactly_may_meet(kind, world):
    """``world``: metres from the origin; boxes 1e-5 of an edge apart do not meet."""
    rng = np.random.default_rng(1)
    # Of a unit cube from another, so that they share a part of a face, of an edge, or a corner.
    offset = {"face": [1.0, 0.3, 0.2], "edge": [1.0, 1.0, 0.2], "vertex": [1.0, 1.0, 1.0]}[kind]
    count = 500
    rotations = np.repeat(random_rotations(rng, count)[:, None], 2, 1)
    positions = np.repeat((rng.normal(size=(count, 3)) * world)[:, None], 2, 1)
    boxes = [box_best(box_mesh()), box_best(box_mesh(centre=offset))]
    assert may_meet(boxes, positions, rotations).all()
    beside = positions + np.stack([np.zeros((count, 3)), rotations[:, 1] @ offset], axis=1)
    assert may_meet([boxes[0], boxes[0]], beside, rotations).all(), "rounded where the bodies stand"
    # Its pad is 1024 eps of the sizes and places of both bodies: 2 micrometres at 4e6 m, the farthest here.
    separated = [boxes[0], box_best(box_mesh(centre=np.array(offset) * (1 + 1e-5)))]
    assert not may_meet(separated, positions, rotations).any()


def test_numbers_that_overflow_are_never_rejected():
    """The distance, 2e308 m, is infinite in float64, which must not be taken for a gap."""
    boxes = [box_best(box_mesh()), box_best(box_mesh())]
    positions = np.array([[[1e308, 0, 0], [-1e308, 0, 0]]])
    assert may_meet(boxes, positions * (1 + EPS), np.tile(np.eye(3), (1, 2, 1, 1))).tolist() == [True]


def test_box_candidates_are_sphere_candidates_and_hold_every_contact():
    """``spheres``, ``boxes``: (frame, pair) that each stage lets through; boxes are tested where spheres overlap.

    A candidate's verdict is CLEAR until a narrow phase decides it; the contacts are those of ``exact``.
    """
    bodies, motion = lab_bodies_and_motion(frames=100)
    broad = BroadPhase(bodies, resolve_pairs(bodies, pairs=None))
    spheres, boxes = broad.by_stage(motion)
    answer = broad.candidates(motion)
    assert answer.work["box_tests"] == spheres.sum() > boxes.sum() == len(answer.frames)
    assert (boxes <= spheres).all() and boxes[answer.frames, answer.columns].all()
    assert (answer.verdict[boxes] == Verdict.CLEAR).all()
    contacts = create_detector("exact", bodies).detect(motion).verdict == Verdict.CONTACT
    assert contacts.any() and boxes[contacts].all()
