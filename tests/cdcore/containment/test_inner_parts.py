"""A clearance is never longer than parts may move, and live samples that have one ask no winding number."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.shapes import ball_mesh, box_mesh, merge_meshes, random_rotations, shift_mesh, unrotated_motion

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
"""Metres for rounding."""
INNER_THEN_OUTER = (1, 0)
"""Body 1 may be inside body 0."""
reach_in_python = reach_of_component.__wrapped__
"""Where a component is, AT_HOLE, WITHIN or BESIDE boxes; the compiler takes a second for this kernel alone."""


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


INNER_MESHES = {
    "ball": ball_mesh(0.02),
    "rod": box_mesh([0.01, 0.01, 0.15]),
    "two parts": merge_meshes(box_mesh([0.02] * 3), shift_mesh(box_mesh([0.01] * 3), [0.06, 0.0, 0.0])),
}


def strolling_motion(rng, count, step=0.004):
    """A motion of body 0 at rest and body 1 that strolls around it, 4 mm a frame, and turns."""
    start = rng.uniform([-0.15, -0.15, -0.15], [0.4, 0.15, 0.15])
    positions = start + np.cumsum(rng.normal(scale=step, size=(count, 3)), axis=0)
    rotations = Rotation.from_rotvec(np.cumsum(rng.normal(scale=0.03, size=(count, 3)), axis=0)).as_matrix()
    both = np.stack([np.tile(np.eye(3), (count, 1, 1)), rotations], axis=1)
    return Motion(np.arange(count) / 90, np.stack([0 * positions, positions], axis=1), both)


def all_components_beside(components, outer, rotations, positions, frame):
    """Whether each component of body 1 is beside all boxes of body 0 and their holes, in a frame."""
    rotation, move = np.empty((3, 3)), np.empty(3)
    pose_of_inner(rotations, positions, frame, INNER_THEN_OUTER, rotation, move)
    count = len(components.boxes)
    return all(reach_in_python(components, i, outer, rotation, move, MARGIN) == BESIDE for i in range(count))


@pytest.mark.parametrize("box_centre_x", [0.0, 0.3])
@pytest.mark.parametrize(
    ("offset_x", "reach"),
    [
        pytest.param(-0.1, BESIDE, id="5 cm outside the closed side"),
        pytest.param(-0.05, BESIDE, id="across the closed side"),
        pytest.param(0.0, WITHIN, id="in the middle"),
        pytest.param(0.05, AT_HOLE, id="in the hole"),
        pytest.param(0.1, BESIDE, id="5 cm outside the hole"),
    ],
)
def test_ball_reaches_the_hole_of_each_box(box_centre_x, offset_x, reach):
    """Two boxes with edges of 10 cm about x = 0 and 0.3 m lack a face towards +x; a ball of radius 2 cm at an offset.

    WITHIN is a ball that a box holds whole; AT_HOLE, whose box meets that of a hole; BESIDE, any other.
    """
    box = box_mesh([0.1] * 3)
    faces_towards_x = np.flatnonzero((box.triangles[:, :, 0] == 0.05).all(axis=1))
    holed = TriangleMesh(box.vertices, np.delete(box.faces, faces_towards_x[0], axis=0))
    boxes = outer_boxes_of(merge_meshes(holed, shift_mesh(holed, [0.3, 0, 0])))
    ball = inner_components_of(ball_mesh(0.02))
    position = np.array([box_centre_x + offset_x, 0, 0])
    assert reach_in_python(ball, 0, boxes, np.eye(3), position, MARGIN) == reach


@pytest.mark.parametrize(
    ("degrees", "gap"),
    [
        pytest.param(0, 0.6 - 0.1, id="a side faces the large box"),
        pytest.param(45, 0.6 - 0.1 * np.sqrt(2), id="an edge faces the large box"),
    ],
)
def test_clearance_is_the_gap_less_some_margins(degrees, gap):
    """A box with edges of 20 cm, its centre 0.6 m beside a box of 1 m; rounding has a margin of 1 um.

    Eight margins (CLEARANCE_MARGINS) are to be taken off the gap, and 20 at most. The kernel runs as Python
    (``__wrapped__``).
    """
    components = inner_components_of(box_mesh([0.2] * 3))
    boxes = outer_boxes_of(box_mesh([1.0] * 3))
    rotation = Rotation.from_euler("z", degrees, degrees=True).as_matrix()
    position, margin = np.array([0.5 + 0.6, 0, 0]), 1e-6
    clearance = clearance_of_components.__wrapped__(components, boxes, rotation, position, margin)
    assert gap - 20 * margin < clearance < gap


@pytest.mark.sampled(3)
@pytest.mark.parametrize("name", INNER_MESHES)
def test_components_that_moved_less_than_clearance_stay_outside(name):
    """At random poses beside a bowl and an open box a body moves in a random direction by 0.9 to 1 of its clearance.

    All of its components must then still be beside the boxes of those two and of their holes.
    """
    mesh, rng = INNER_MESHES[name], np.random.default_rng(7)
    components, boxes = inner_components_of(mesh), outer_boxes_of(bowl_and_open_box())
    size, poses_with_clearance = farthest_corner(mesh) + farthest_corner(bowl_and_open_box()), 0
    for _ in range(150):
        rotations = np.stack([np.eye(3), random_rotations(rng)])[None]
        positions = np.stack([np.zeros(3), rng.uniform([-0.2, -0.2, -0.2], [0.5, 0.2, 0.2])])[None]
        now, first_frame = Motion([0.0], positions, rotations), np.array([0])
        (clearance,) = clearances_over(now, first_frame, INNER_THEN_OUTER, components, boxes, size)
        if clearance <= 0.0:
            continue
        poses_with_clearance += 1
        direction = random_rotations(rng) @ [1.0, 0.0, 0.0]
        positions[0, 1] += direction * clearance * rng.uniform(0.9, 1.0)
        assert all_components_beside(components, boxes, rotations, positions, frame=0)
    assert poses_with_clearance > 15


@pytest.mark.parametrize("name", INNER_MESHES)
def test_frames_that_a_clearance_leaves_out_are_beside(name):
    """A body strolls past a bowl and an open box, 12 times 60 frames; a frame with a clearance above 0 m is left out.

    In each of those all of its components must be beside the boxes of both and of their holes.
    """
    frames = np.arange(60)
    mesh, rng, frames_left_out = INNER_MESHES[name], np.random.default_rng(8), 0
    components, boxes = inner_components_of(mesh), outer_boxes_of(bowl_and_open_box())
    size = farthest_corner(mesh) + farthest_corner(bowl_and_open_box())
    for _ in range(12):
        motion = strolling_motion(rng, count=60)
        clearances = clearances_over(motion, frames, INNER_THEN_OUTER, components, boxes, size)
        for frame in np.flatnonzero(clearances > 0.0).tolist():
            assert all_components_beside(components, boxes, motion.rotations, motion.translations, frame), frame
            frames_left_out += 1
    assert frames_left_out > 60, "of 720, a lower bound"


@pytest.mark.sampled(6)
@pytest.mark.parametrize("name", INNER_MESHES)
@pytest.mark.parametrize("detector_name", ["exact", "obb"])
def test_live_containment_in_open_meshes_equals_offline(detector_name, name):
    """A body strolls in and out of a bowl and an open box, 25 times for 50 frames, asked as a whole and frame by frame.

    It must be beside them, in contact, and where nothing says whether it is inside.
    """
    bodies = [Body("bowl and open box", bowl_and_open_box()), Body("inner", INNER_MESHES[name])]
    detector = create_detector(detector_name, bodies)
    rng, verdicts = np.random.default_rng(9), set()
    for _ in range(25):
        motion = strolling_motion(rng, count=50)
        offline = detector.detect(motion)
        assert np.array_equal(detect_live(detector, motion).verdict, offline.verdict)
        verdicts |= set(offline.verdict.ravel().tolist())
    assert verdicts >= {Verdict.CLEAR, Verdict.CONTACT, Verdict.UNRESOLVED}


def test_a_live_sample_near_an_opening_asks_no_winding_number(monkeypatch):
    """A ball of radius 2 cm trembles by 0.5 mm, its middle 3.5 cm above the rim of a bowl (at z = 0), for 200 frames.

    Whether it is inside is asked in each. A clearance, the metres that it may move before it can reach the
    opening, serves the next frames until it is used up: fewer than 100 are computed, and no winding number. The box is
    30 cm aside. It took twice as long when a kernel got the arrays of both surfaces in every sample.
    """
    frames, winding_calls, clearance_calls = 200, [], []
    decide, compare = containment_stage.decide_by_winding, containment_stage.clearances_over

    def count_winding(*arguments):
        winding_calls.append(arguments)
        return decide(*arguments)

    def count_clearances(*arguments):
        clearance_calls.append(arguments)
        return compare(*arguments)

    monkeypatch.setattr(containment_stage, "decide_by_winding", count_winding)
    monkeypatch.setattr(containment_stage, "clearances_over", count_clearances)
    tremble = np.random.default_rng(3).normal(scale=0.0005, size=(frames, 3))
    positions = np.array([0.0, 0.0, 0.035]) + tremble
    motion = unrotated_motion(np.stack([0 * positions, positions], axis=1), times=np.arange(frames) / 90)
    detector = create_detector("exact", [Body("bowl", bowl_and_open_box()), Body("ball", ball_mesh(0.02))])
    session = detector.live()
    for frame in range(frames):
        assert session.look(motion.frames(frame, frame + 1)) == [Verdict.CLEAR], frame
    assert session.work["containment_tests"] == frames
    assert not winding_calls
    assert len(clearance_calls) < 100  # 39 in November 2026


def test_face_axis_gap_is_at_most_the_distance():
    """The gap of two random boxes along their six face normals, against the distance of box A from points of box B.

    Those are its corners and 500 points inside, so that their distance is that of the boxes or a little more.
    """
    rng, separated = np.random.default_rng(10), 0
    unit_corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
    for _ in range(200):
        half_a, half_b, rotation = rng.uniform(0.1, 1.0, 3), rng.uniform(0.1, 1.0, 3), random_rotations(rng)
        offset = rng.normal(scale=1.5, size=3)
        gap = gap_on_face_axes(rotation, offset, half_a, half_b)
        points_in_b = np.concatenate([rng.uniform(-1.0, 1.0, (500, 3)), unit_corners]) * half_b
        points = points_in_b @ rotation.T + offset
        distance = np.linalg.norm(np.maximum(np.abs(points) - half_a, 0.0), axis=1).min()
        rounding = 1e-12
        assert gap <= distance + rounding
        separated += gap > 0.0
    assert 50 < separated < 200
