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
    """Two random boxes, oriented in their bodies, in a hundred random poses; the programme looks for a common point."""
    rng, count = np.random.default_rng(0), 100
    box_a, box_b = (
        Box(rng.normal(size=3) * 0.3, random_rotations(rng), half=rng.uniform(0.05, 1.0, 3)) for _ in range(2)
    )
    rotations, positions = random_rotations(rng, count, 2), rng.normal(size=(count, 2, 3)) * 0.8
    poses = zip(rotations, positions, strict=True)
    expected = [
        boxes_touch_a_point(box_a, (rotation[0], position[0]), box_b, (rotation[1], position[1]))
        for rotation, position in poses
    ]
    assert 15 < sum(expected) < count - 15, "both answers are frequent"
    assert may_meet([box_a, box_b], positions, rotations).tolist() == expected


OFFSETS = {"face": [1.0, 0.3, 0.2], "edge": [1.0, 1.0, 0.2], "vertex": [1.0, 1.0, 1.0]}
"""Of a unit cube from another, so that they share a part of a face, a part of an edge, or a corner."""
CLOSE = 1e-5
"""Of an edge: a gap that the stage's pad does not bridge.

The pad is 1024 eps of the sizes and places of both bodies: 2 micrometres at 4e6 m, the farthest place here.
"""


def poses_of_both(rng, distance, count=500):
    """Random poses that two bodies share, some ``distance`` metres from the origin: positions and rotations."""
    rotations = np.repeat(random_rotations(rng, count)[:, None], 2, axis=1)
    positions = np.repeat((rng.normal(size=(count, 3)) * distance)[:, None], 2, axis=1)
    return positions, rotations


@pytest.mark.parametrize("distance", [0.0, 1e3, 1e6], ids="{:g} m from the origin".format)
@pytest.mark.parametrize("kind", OFFSETS)
def test_boxes_that_touch_in_their_bodies_may_meet(kind, distance):
    """Two cubes of 1 m in 500 poses; the second stands beside the first in the axes of its body, so that they share
    part of a face, part of an edge or a corner (``kind``).
    """
    positions, rotations = poses_of_both(np.random.default_rng(1), distance)
    boxes = [box_best(box_mesh()), box_best(box_mesh(centre=OFFSETS[kind]))]
    assert may_meet(boxes, positions, rotations).all()


@pytest.mark.parametrize("distance", [0.0, 1e3, 1e6], ids="{:g} m from the origin".format)
@pytest.mark.parametrize("kind", OFFSETS)
def test_boxes_that_touch_by_their_poses_may_meet(kind, distance):
    """Two cubes of 1 m about the origins of their bodies in 500 poses; the second body stands so that they share part
    of a face, part of an edge or a corner (``kind``).
    """
    positions, rotations = poses_of_both(np.random.default_rng(1), distance)
    positions[:, 1] += rotations[:, 1] @ OFFSETS[kind]
    assert may_meet([box_best(box_mesh())] * 2, positions, rotations).all()


@pytest.mark.parametrize("distance", [0.0, 1e3, 1e6], ids="{:g} m from the origin".format)
@pytest.mark.parametrize("kind", OFFSETS)
def test_boxes_10_micrometres_from_each_other_do_not_meet(kind, distance):
    """Two cubes of 1 m in 500 poses; they would share part of a face, part of an edge or a corner (``kind``), but for a
    shift of the second by 1e-5 (CLOSE) of its offset of 1 m.
    """
    positions, rotations = poses_of_both(np.random.default_rng(1), distance)
    boxes = [box_best(box_mesh()), box_best(box_mesh(centre=np.array(OFFSETS[kind]) * (1 + CLOSE)))]
    assert not may_meet(boxes, positions, rotations).any()


def test_numbers_that_overflow_are_never_rejected():
    """Boxes 2e308 m apart: the difference of their places is infinite in float64, which must not be taken for a gap."""
    boxes = [box_best(box_mesh()), box_best(box_mesh())]
    positions = np.array([[[1e308, 0, 0], [-1e308, 0, 0]]])
    assert may_meet(boxes, positions, np.tile(np.eye(3), (1, 2, 1, 1))).tolist() == [True]


def test_box_candidates_are_sphere_candidates_and_hold_every_contact():
    """Five bodies of a laboratory, 100 frames: boxes are tested where spheres overlap, and some of them do not overlap.

    What overlaps in both has the verdict CLEAR until a narrow phase decides; the contacts of ``exact`` are all there.
    """
    bodies, motion = lab_bodies_and_motion(frames=100)
    broad = BroadPhase(bodies, resolve_pairs(bodies, pairs=None))
    spheres_overlap, boxes_overlap = broad.by_stage(motion)  # both (frames, pairs)
    answer = broad.candidates(motion)
    assert answer.work["box_tests"] == spheres_overlap.sum()
    assert 0 < boxes_overlap.sum() < spheres_overlap.sum()
    assert (spheres_overlap | ~boxes_overlap).all(), "boxes overlap only where spheres do"
    assert np.array_equal(np.argwhere(boxes_overlap), sorted(zip(answer.frames, answer.columns, strict=True)))
    assert (answer.verdict[boxes_overlap] == Verdict.CLEAR).all()
    contacts = create_detector("exact", bodies).detect(motion).verdict == Verdict.CONTACT
    assert contacts.any()
    assert boxes_overlap[contacts].all()
