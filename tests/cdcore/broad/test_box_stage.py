"""The box stage rejects no pair that meets, and agrees with an exact separation of the boxes where that is clear."""

import numpy as np
import pytest
from scipy.optimize import linprog
from support.shapes import ball_mesh, box_mesh, lab, random_rotations, rod_mesh

from cdcore import Motion, TriangleMesh, Verdict, create_detector
from cdcore.bounding.box import Box, box_best
from cdcore.bounding.sphere import sphere_best
from cdcore.broad.box_stage import BoxStage
from cdcore.broad.broad_phase import BroadPhase
from cdcore.broad.sphere_stage import SphereStage
from cdcore.kernels.box_axes import apart_on_all_axes
from cdcore.kernels.compiling import kernel
from cdcore.numerics import EPS
from cdcore.protocol import resolve_pairs

PAIR = np.array([[0, 1]])


def asked(boxes, places, turns):
    count = len(places)
    motion = Motion(np.arange(count), places, turns)
    return BoxStage(boxes, PAIR).may_meet(motion, np.arange(count), np.zeros(count, dtype=np.int64))


def boxes_share_a_point(box_a, pose_a, box_b, pose_b):
    """Linear programme: s, t in the unit cubes with equal world points; independent of separating axes."""
    (ra, ta), (rb, tb) = pose_a, pose_b
    left = np.hstack([ra @ box_a.axes * box_a.half, -(rb @ box_b.axes) * box_b.half])
    right = (rb @ box_b.centre + tb) - (ra @ box_a.centre + ta)
    return linprog(np.zeros(6), A_eq=left, b_eq=right, bounds=[(-1, 1)] * 6).status == 0


def test_the_fifteen_axes_agree_with_a_linear_programme():
    rng = np.random.default_rng(0)
    count = 250
    boxes = []
    for _ in range(2):
        half = rng.uniform(0.05, 1.0, 3)
        boxes.append(Box(rng.normal(size=3) * 0.3, random_rotations(rng), half))
    turns, places = random_rotations(rng, count, 2), rng.normal(size=(count, 2, 3)) * 0.8
    answers = asked(boxes, places, turns)
    expected = [
        boxes_share_a_point(boxes[0], (turns[k, 0], places[k, 0]), boxes[1], (turns[k, 1], places[k, 1]))
        for k in range(count)
    ]
    assert 40 < sum(expected) < count - 40
    assert answers.tolist() == expected


@pytest.mark.parametrize("world", [0.0, 1.0, 1e3, 1e6])
@pytest.mark.parametrize("kind", ["face", "edge", "vertex"])
def test_boxes_that_touch_exactly_may_meet(kind, world):
    rng = np.random.default_rng(1)
    offset = {"face": [1.0, 0.3, 0.2], "edge": [1.0, 1.0, 0.2], "vertex": [1.0, 1.0, 1.0]}[kind]
    count = 500
    turns = np.repeat(random_rotations(rng, count)[:, None], 2, 1)
    places = np.repeat((rng.normal(size=(count, 3)) * world)[:, None], 2, 1)
    boxes = [box_best(box_mesh()), box_best(box_mesh(centre=offset))]
    assert asked(boxes, places, turns).all()
    apart = [boxes[0], box_best(box_mesh(centre=np.array(offset) * (1 + 1e-3 + 1e-8 * world)))]
    assert not asked(apart, places, turns).any()


def test_meshes_that_share_a_vertex_may_meet_even_with_six_digit_rotations():
    rng = np.random.default_rng(2)
    rotation = np.round(random_rotations(rng, 400), 6)
    shared = np.array([0.3, 0.2, 0.1])
    for _ in range(10):
        points = [np.vstack([shared, shared + rng.normal(size=(4, 3))]) for _ in range(2)]
        meshes = [TriangleMesh(each, [[0, 1, 2], [0, 3, 4]]) for each in points]
        places = np.repeat(rng.normal(size=(400, 1, 3)) * 10, 2, 1)
        assert asked([box_best(mesh) for mesh in meshes], places, np.repeat(rotation[:, None], 2, 1)).all()


def test_boxes_reject_what_spheres_cannot():
    long = [box_best(rod_mesh(0.003, 0.3)), box_best(ball_mesh(0.01))]
    assert not asked(long, np.array([[[0, 0, 0], [0.1, 0, 0.15]]]), np.tile(np.eye(3), (1, 2, 1, 1)))[0]
    assert asked(long, np.array([[[0, 0, 0], [0.0125, 0, 0.15]]]), np.tile(np.eye(3), (1, 2, 1, 1)))[0]


def test_numbers_that_overflow_are_never_rejected():
    boxes = [box_best(box_mesh()), box_best(box_mesh())]
    places = np.array([[[1e308, 0, 0], [-1e308, 0, 0]]])
    assert asked(boxes, places * (1 + EPS), np.tile(np.eye(3), (1, 2, 1, 1))).tolist() == [True]


def test_no_pair_frames_is_no_answer():
    motion = Motion([0.0], np.zeros((1, 2, 3)), np.tile(np.eye(3), (1, 2, 1, 1)))
    none = np.zeros(0, dtype=np.int64)
    assert BoxStage([box_best(box_mesh())] * 2, PAIR).may_meet(motion, none, none).shape == (0,)


@kernel
def boxes_apart(m, d, half_a, half_b, pad):
    return apart_on_all_axes(m, d, half_a, half_b, pad)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1, 1])
def test_face_axes_separate_at_the_sum_of_half_extents(axis, sign):
    half_a, half_b = np.array([1.0, 2.0, 3.0]), np.array([0.5, 0.25, 0.125])
    touching = np.zeros(3)
    touching[axis] = sign * (half_a[axis] + half_b[axis])
    assert not boxes_apart(np.eye(3), touching, half_a, half_b, 0.0)
    assert boxes_apart(np.eye(3), touching * (1 + 1e-9), half_a, half_b, 0.0)
    assert not boxes_apart(np.eye(3), touching * (1 + 1e-9), half_a, half_b, 1e-6)


def test_what_may_meet_is_what_spheres_and_boxes_let_through_and_holds_every_contact():
    bodies, motion = lab(100)
    pairs = resolve_pairs(bodies, None)
    answer = BroadPhase(bodies, pairs).candidates(motion)
    spheres = SphereStage([sphere_best(body.mesh) for body in bodies], pairs).candidates(motion)
    columns, frames = np.nonzero(spheres.verdict.T == Verdict.CANDIDATE)
    meet = BoxStage([box_best(body.mesh) for body in bodies], pairs).may_meet(motion, frames, columns)
    assert 0 < meet.sum() < len(meet)
    assert np.array_equal([answer.frames, answer.columns], [frames[meet], columns[meet]])
    assert answer.work == spheres.work | {"box_tests": len(frames)}
    spheres.verdict[frames, columns] = Verdict.CLEAR
    assert np.array_equal(answer.verdict, spheres.verdict)
    assert len(answer.clock) == 3 and answer.clock == sorted(answer.clock)
    near = set(zip(answer.frames.tolist(), answer.columns.tolist(), strict=True))
    contacts = create_detector("exact", bodies).detect(motion).verdict == Verdict.CONTACT
    assert contacts.any() and near >= {tuple(place) for place in np.argwhere(contacts).tolist()}
