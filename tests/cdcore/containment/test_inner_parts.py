"""A clearance is never longer than parts may move, and live samples that have one ask no winding number."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.shapes import ball_mesh, box_mesh, merge_meshes, random_rotations, shift_mesh

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector
from cdcore.containment import containment_stage
from cdcore.containment.containment_stage import clearances_over, farthest_corner, inner_components_of
from cdcore.containment.inner_parts import (
    AT_HOLE,
    BESIDE,
    WITHIN,
    OuterBoxes,
    clearance_of_components,
    pose_of_inner,
    reach_of_component,
)
from cdcore.containment.winding_surface import winding_surface
from cdcore.kernels.box_against_box import gap_on_face_axes
from cdcore.protocol import detect_live

MARGIN = 1e-12
reach_in_python = reach_of_component.__wrapped__
"""The kernel without the compiler, which takes a second for it alone."""


def bowl_and_open_box():
    """Half a ball of 0.1 m beside a box that lacks a side."""
    ball, box = ball_mesh(0.1, rings=24, sides=36), box_mesh([0.1] * 3)
    bowl = TriangleMesh(ball.vertices, ball.faces[ball.triangles[:, :, 2].max(axis=1) <= 1e-9])
    side = (box.triangles[:, :, 0] == 0.05).all(axis=1)
    return merge_meshes(bowl, shift_mesh(TriangleMesh(box.vertices, box.faces[~side]), [0.3, 0.0, 0.0]))


def outer_boxes_of(mesh):
    """Bounding boxes of a mesh's components and of their holes, as kernels take them."""
    surface = winding_surface(mesh)
    return OuterBoxes(surface.boxes, surface.holes, surface.first_hole)


INNER = {
    "ball": ball_mesh(0.02),
    "rod": box_mesh([0.01, 0.01, 0.15]),
    "two parts": merge_meshes(box_mesh([0.02] * 3), shift_mesh(box_mesh([0.01] * 3), [0.06, 0.0, 0.0])),
}


def strolling_motion(rng, count, step=0.004):
    """A motion of a body at rest and one that strolls around it and turns."""
    start = rng.uniform([-0.15, -0.15, -0.15], [0.4, 0.15, 0.15])
    positions = start + np.cumsum(rng.normal(scale=step, size=(count, 3)), axis=0)
    rotations = Rotation.from_rotvec(np.cumsum(rng.normal(scale=0.03, size=(count, 3)), axis=0)).as_matrix()
    both = np.stack([np.tile(np.eye(3), (count, 1, 1)), rotations], axis=1)
    return Motion(np.arange(count) / 90, np.stack([0 * positions, positions], axis=1), both)


@pytest.mark.parametrize("middle", [0.0, 0.3])
def test_ball_reaches_the_hole_of_each_box(middle):
    """Two boxes of edges of 10 cm about (0, 0, 0) and (0.3, 0, 0) m, of which each lacks a face towards +X."""
    box = box_mesh([0.1] * 3)
    towards_x = np.flatnonzero((box.triangles[:, :, 0] == 0.05).all(axis=1))
    holed = TriangleMesh(box.vertices, np.delete(box.faces, towards_x[0], axis=0))
    boxes = outer_boxes_of(merge_meshes(holed, shift_mesh(holed, [0.3, 0, 0])))
    ball = inner_components_of(INNER["ball"])  # of 2 cm
    reach_by_offset = {-0.1: BESIDE, -0.05: BESIDE, 0.0: WITHIN, 0.05: AT_HOLE, 0.1: BESIDE}
    for x, reach in reach_by_offset.items():
        assert reach_in_python(ball, 0, boxes, np.eye(3), np.array([middle + x, 0, 0]), MARGIN) == reach, x


def test_clearance_is_the_gap_less_some_margins():
    """A box of edges of 20 cm whose centre is 0.6 m from the side of one of 1 m, as it is and turned by 45 degrees.

    The margin is 1e-6 m; at most 20 of them are taken off.
    """
    components = inner_components_of(box_mesh([0.2] * 3))
    boxes = outer_boxes_of(box_mesh([1.0] * 3))
    for degrees, gap in ((0, 0.5), (45, 0.6 - 0.1 * np.sqrt(2))):
        rotation = Rotation.from_euler("z", degrees, degrees=True).as_matrix()
        clearance = clearance_of_components.__wrapped__(components, boxes, rotation, np.array([1.1, 0, 0]), 1e-6)
        assert gap - 2e-5 < clearance < gap


@pytest.mark.sampled(3)
@pytest.mark.parametrize("name", INNER)
def test_components_that_moved_less_than_clearance_stay_outside(name):
    """At random poses the body moves in a random direction by 0.9 to 1 times its clearance.

    (1, 0): body 1 may be inside body 0. More than 15 of 150 poses have a clearance.
    """
    mesh, rng = INNER[name], np.random.default_rng(7)
    components, boxes = inner_components_of(mesh), outer_boxes_of(bowl_and_open_box())
    size, sample = farthest_corner(mesh) + farthest_corner(bowl_and_open_box()), 0
    for _ in range(150):
        rotations = np.stack([np.eye(3), random_rotations(rng)])[None]
        positions = np.stack([np.zeros(3), rng.uniform([-0.2, -0.2, -0.2], [0.5, 0.2, 0.2])])[None]
        now = Motion([0.0], positions, rotations)
        clearance = clearances_over(now, np.array([0]), (1, 0), components, boxes, size)[0]
        if clearance <= 0.0:
            continue
        sample += 1
        rotation = Rotation.from_rotvec(rng.normal(size=3)).as_matrix()
        step = rotation @ [clearance, 0.0, 0.0] * rng.uniform(0.9, 1.0)
        positions[0, 1] += step
        orientation, move = np.empty((3, 3)), np.empty(3)
        pose_of_inner(rotations, positions, 0, (1, 0), orientation, move)
        assert all(
            reach_in_python(components, i, boxes, orientation, move, MARGIN) == BESIDE
            for i in range(len(components.boxes))
        )
    assert sample > 15


@pytest.mark.parametrize("name", INNER)
def test_frames_that_a_clearance_leaves_out_are_beside(name):
    """Frames whose clearance is positive are not asked; each of them must be outside.

    (1, 0): body 1 may be inside body 0. More than 200 of 2,400 frames are left out.
    """
    mesh, rng, left_out = INNER[name], np.random.default_rng(8), 0
    components, boxes, size = (
        inner_components_of(mesh),
        outer_boxes_of(bowl_and_open_box()),
        farthest_corner(mesh) + farthest_corner(bowl_and_open_box()),
    )
    for _ in range(40):
        motion = strolling_motion(rng, count=60)
        near = ~(clearances_over(motion, np.arange(60), (1, 0), components, boxes, size) > 0.0)
        rotation, move = np.empty((3, 3)), np.empty(3)
        for frame in np.flatnonzero(~near).tolist():
            pose_of_inner(motion.rotations, motion.translations, frame, (1, 0), rotation, move)
            assert all(
                reach_in_python(components, i, boxes, rotation, move, MARGIN) == BESIDE
                for i in range(len(components.boxes))
            )
        left_out += np.count_nonzero(~near)
    assert left_out > 200


@pytest.mark.sampled(6)
@pytest.mark.parametrize("name", INNER)
@pytest.mark.parametrize("asker", ["exact", "obb"])
def test_live_containment_in_open_meshes_equals_offline(asker, name):
    """A part wanders in and out of a bowl and an open box; all three answers must occur."""
    detector = create_detector(asker, [Body("cup", bowl_and_open_box()), Body("inner", INNER[name])])
    rng, codes = np.random.default_rng(9), set()
    for _ in range(25):
        motion = strolling_motion(rng, count=50)
        offline = detector.detect(motion)
        assert np.array_equal(detect_live(detector, motion).verdict, offline.verdict)
        codes |= set(offline.verdict.ravel().tolist())
    assert {Verdict.CLEAR, Verdict.CONTACT, Verdict.UNRESOLVED} <= codes


def test_a_live_sample_near_an_opening_asks_no_winding_number(monkeypatch):
    """A ball of radius 2 cm trembles 3.5 cm above a bowl's rim: fewer than 100 clearances answer for 200 frames.

    It took twice as long when the arrays of both surfaces were handed to a kernel in every sample.
    """
    requested, compared = [], []
    decide, compare = containment_stage.decide_by_winding, containment_stage.clearances_over
    monkeypatch.setattr(containment_stage, "decide_by_winding", lambda *given: requested.append(decide(*given)))
    monkeypatch.setattr(
        containment_stage, "clearances_over", lambda *given: compared.append(compare(*given)) or compared[-1]
    )
    positions = np.array([0.0, 0.0, 0.035]) + np.random.default_rng(3).normal(scale=0.0005, size=(200, 3))
    motion = Motion(
        np.arange(200) / 90, np.stack([0 * positions, positions], axis=1), np.tile(np.eye(3), (200, 2, 1, 1))
    )
    detector = create_detector("exact", [Body("bowl", bowl_and_open_box()), Body("ball", ball_mesh(0.02))])
    session = detector.live()
    for frame in range(200):
        assert session.look(motion.frames(frame, frame + 1)) == [Verdict.CLEAR]
    assert session.work["containment_tests"] > 150
    assert not requested
    assert len(compared) < 100


def test_face_axis_gap_is_at_most_the_distance():
    """The gap along the six face normals of two boxes, beside the distance of points in one from the other."""
    rng = np.random.default_rng(10)
    corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
    for _ in range(200):
        half_a, half_b, rotation = rng.uniform(0.1, 1.0, 3), rng.uniform(0.1, 1.0, 3), random_rotations(rng)
        d = rng.normal(scale=1.5, size=3)
        gap = gap_on_face_axes(rotation, d, half_a, half_b)
        points = (rng.uniform(-1.0, 1.0, (500, 3)) * half_b) @ rotation.T + d
        points = np.concatenate([points, (corners * half_b) @ rotation.T + d])
        distance = np.linalg.norm(np.maximum(np.abs(points) - half_a, 0.0), axis=1).min()
        assert gap <= distance + 1e-12
