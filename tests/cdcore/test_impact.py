"""HIT, FREE and UNRESOLVED on ways whose answer is known, forwards, backwards and in parts."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp
from support.shapes import ball_mesh, box_mesh, merge_meshes, shift_mesh, without_faces

from cdcore import Impact, intersecting_faces, time_of_impact
from cdcore.errors import InvalidPoseError, InvalidSettingError

AT_REST = np.tile(np.eye(4), (2, 1, 1))
"""Poses (2, 4, 4) of a body that stays at the origin: the identity at the start and at the end."""
WIDEST_TOI = 1e-6
"""``toi`` is an interval (lower, upper) no wider than this about the time of impact, a fraction of the motion."""


def pose_matrix(position=(0, 0, 0), rotvec=(0, 0, 0)):
    """A pose as 4x4 matrix."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = Rotation.from_rotvec(rotvec).as_matrix(), position
    return matrix


def poses_from_to(before, after):
    """Poses (2, 4, 4) at the start and at the end of a motion, times 0 and 1."""
    return np.stack([before, after])


def test_ball_through_a_plate_hits_at_the_closed_form():
    """A ball of radius 10 mm falls by 200 mm through a plate 2 mm thick, whose middle is 100 mm below the start.

    It touches the top of the plate, 1 mm above its middle, after 100 - 1 - 10 = 89 mm.
    """
    falling = poses_from_to(pose_matrix((0, 0, 0.1)), pose_matrix((0, 0, -0.1)))
    plate = box_mesh((0.3, 0.3, 0.002))
    answer = time_of_impact(ball_mesh(radius=0.01), falling, plate, AT_REST)
    assert answer.verdict is Impact.HIT
    assert answer.inside is False, "at the start the ball is not inside the plate"
    lower, upper = answer.toi
    assert lower <= 89 / 200 <= upper <= lower + WIDEST_TOI


@pytest.mark.parametrize(
    ("degrees", "side_hit"),
    [pytest.param(179, "left", id="179 to the left"), pytest.param(181, "right", id="181 is 179 to the right")],
)
def test_rotating_rod_hits_posts_on_the_shorter_arc_only(degrees, side_hit):
    """A rod of 1 m along x, 2 cm thick, turns about its end; posts 2 cm thick stand at y = 0.9 m, left, and -0.9 m."""
    rod = shift_mesh(box_mesh((1.0, 0.02, 0.02)), (0.5, 0, 0))
    post = box_mesh((0.02, 0.02, 1.0))
    turning = poses_from_to(pose_matrix(), pose_matrix(rotvec=(0, 0, np.radians(degrees))))
    answers = {}
    for side, y in (("left", 0.9), ("right", -0.9)):
        standing = poses_from_to(pose_matrix((0, y, 0)), pose_matrix((0, y, 0)))
        answers[side] = time_of_impact(rod, turning, post, standing)
    hit = answers.pop(side_hit)
    (free,) = answers.values()
    assert hit.verdict is Impact.HIT
    assert free.verdict is Impact.FREE
    # The rod's side, 0.01 m beside its axis, reaches the near corner of the post.
    corner = np.array([0.01, 0.89])
    angle = np.arctan2(corner[1], corner[0]) - np.arcsin(0.01 / np.linalg.norm(corner))
    lower, upper = hit.toi
    assert lower <= angle / np.radians(179) <= upper <= lower + WIDEST_TOI


@pytest.mark.parametrize("gap", [2.0**-20, 2.0**-18])
def test_sliding_above_a_face_is_proven_clear(gap):
    """A cube of 0.5 m slides from x = -3 to 3 m over a floor of 4 x 4 m, 1 or 4 micrometres above it."""
    cube, floor = box_mesh((0.5, 0.5, 0.5)), box_mesh((4, 4, 0.5))
    height = 0.5 + gap  # of the cube's middle: half of both heights, 0.25 + 0.25 m, and the gap
    sliding = poses_from_to(pose_matrix((-3, 0, height)), pose_matrix((3, 0, height)))
    assert time_of_impact(cube, sliding, floor, AT_REST).verdict is Impact.FREE


@pytest.mark.parametrize("depth", [0.0, 2.0**-20, 2.0**-18])
def test_sliding_along_or_within_a_face_hits_at_its_edge(depth):
    """A cube of 0.5 m slides from x = -3 to 3 m on a floor of 4 x 4 m, or 1 or 4 micrometres deep in it.

    The cube's edge, 0.25 m before its middle, is over the floor's, at x = -2 m, after 0.75 of 6 m.
    """
    cube, floor = box_mesh((0.5, 0.5, 0.5)), box_mesh((4, 4, 0.5))
    height = 0.5 - depth  # of the cube's middle: half of both heights, 0.25 + 0.25 m, less the depth
    sliding = poses_from_to(pose_matrix((-3, 0, height)), pose_matrix((3, 0, height)))
    answer = time_of_impact(cube, sliding, floor, AT_REST)
    assert answer.verdict is Impact.HIT
    lower, upper = answer.toi
    rounding = 1e-15
    assert lower <= 0.75 / 6 <= upper + rounding


def test_contact_at_start_at_end_and_without_motion():
    """A cube of 1 m on a floor 1 m thick: with its middle 1 m above the floor's it stands, at 1.25 m it hangs in the
    air.
    """
    cube, floor = box_mesh((1, 1, 1)), box_mesh((4, 4, 1))
    standing, above, far_above = pose_matrix((0, 0, 1)), pose_matrix((0, 0, 1.25)), pose_matrix((0, 0, 3))
    assert time_of_impact(cube, poses_from_to(standing, far_above), floor, AT_REST).toi == (0.0, 0.0)
    landing = time_of_impact(cube, poses_from_to(far_above, standing), floor, AT_REST)
    assert landing.verdict is Impact.HIT
    lower, upper = landing.toi
    assert 1.0 - WIDEST_TOI <= lower <= upper == 1.0
    assert time_of_impact(cube, poses_from_to(standing, standing), floor, AT_REST).verdict is Impact.HIT
    assert time_of_impact(cube, poses_from_to(above, above), floor, AT_REST).verdict is Impact.FREE


BALL_IN_BOX = ball_mesh(0.1)
BOX_OF_1_M = box_mesh((1, 1, 1))
STAYING_INSIDE = poses_from_to(pose_matrix(), pose_matrix((0.2, 0, 0)))
"""The ball of radius 0.1 m moves by 0.2 m, from the middle of the box, whose walls are 0.5 m away."""


@pytest.mark.parametrize("ball_first", [True, False], ids=["ball first", "box first"])
def test_motion_inside_a_box_is_free_and_inside(ball_first):
    """A ball of radius 0.1 m moves by 0.2 m from the middle of a box of 1 m, whichever of them is named first."""
    if ball_first:
        answer = time_of_impact(BALL_IN_BOX, STAYING_INSIDE, BOX_OF_1_M, AT_REST)
    else:
        answer = time_of_impact(BOX_OF_1_M, AT_REST, BALL_IN_BOX, STAYING_INSIDE)
    assert (answer.verdict, answer.inside) == (Impact.FREE, True)


def test_ball_that_leaves_a_box_hits_its_wall_from_inside():
    """A ball of radius 0.1 m moves by 3 m from the middle of a box; its surface has 0.4 m to the wall, which is at 0.5
    m.
    """
    leaving = poses_from_to(pose_matrix(), pose_matrix((3, 0, 0)))
    answer = time_of_impact(BALL_IN_BOX, leaving, BOX_OF_1_M, AT_REST)
    assert (answer.verdict, answer.inside) == (Impact.HIT, True)
    lower, upper = answer.toi
    assert lower <= 0.4 / 3 <= upper


@pytest.mark.parametrize(
    ("inner", "outer", "inside"),
    [
        pytest.param(
            merge_meshes(BALL_IN_BOX, shift_mesh(BALL_IN_BOX, [9, 0, 0])), BOX_OF_1_M, True, id="part outside"
        ),
        pytest.param(BALL_IN_BOX, without_faces(BOX_OF_1_M, count=1), True, id="a triangle is missing"),
        pytest.param(BALL_IN_BOX, without_faces(BOX_OF_1_M, count=2), None, id="a side is missing"),
        pytest.param(BALL_IN_BOX, merge_meshes(BOX_OF_1_M, BOX_OF_1_M), True, id="faces drawn twice"),
        pytest.param(shift_mesh(BALL_IN_BOX, [5, 0, 0]), BOX_OF_1_M, False, id="outside"),
    ],
)
def test_inside_holds_for_components_and_repairable_boxes(inner, outer, inside):
    """A ball of radius 0.1 m moves within a box of 1 m, or within one that is damaged; without a side (two triangles)
    nothing says where its inside ends: ``None``.
    """
    assert time_of_impact(inner, STAYING_INSIDE, outer, AT_REST).inside is inside


def test_witness_faces_meet_at_the_upper_time():
    """A ball of 0.1 m falls, turning, through a box of 1 m; the two faces it names meet at the upper bound of the time.

    The pose there is interpolated by SciPy: on a line, and at a constant rate of rotation.
    """
    ball, box = ball_mesh(0.1), box_mesh((1, 1, 1))
    start, stop = pose_matrix((0, 0.1, 2)), pose_matrix((0.3, 0, -2), (1, 0.5, 0))
    answer = time_of_impact(ball, poses_from_to(start, stop), box, AT_REST)
    assert answer.verdict is Impact.HIT
    _, fraction = answer.toi
    rotation = Slerp([0, 1], Rotation.from_matrix([start[:3, :3], stop[:3, :3]]))(fraction)
    pose = pose_matrix((1 - fraction) * start[:3, 3] + fraction * stop[:3, 3], rotation.as_rotvec())
    assert list(answer.faces) in intersecting_faces(ball, box, pose, None).tolist()


@settings(max_examples=max(10, settings.default.max_examples // 2), deadline=None)
@given(seed=st.integers(0, 10**6), largest_angle=st.floats(0, 1.2))
def test_no_sampled_pose_before_the_impact_is_in_contact(seed, largest_angle):
    """A random box and a random ball both move and turn; ``intersecting_faces`` judges 8 poses before the time of
    impact, or 9 of the whole motion where there is none.
    """
    rng = np.random.default_rng(seed)
    box, ball = box_mesh(rng.uniform(0.05, 0.6, 3)), ball_mesh(rng.uniform(0.1, 0.4), rings=4, sides=6)
    motions = [random_poses_from_to(rng, reach=0.7, largest_angle=largest_angle) for _ in range(2)]
    answer = time_of_impact(box, motions[0], ball, motions[1])
    if answer.verdict is Impact.HIT:
        lower, upper = answer.toi
        assert upper - lower <= WIDEST_TOI
        fractions_before = np.linspace(0, lower, 9)[:-1] if lower > 0 else []
    else:
        assert answer.toi is None
        fractions_before = np.linspace(0, 1, 9)
    rotations = [Slerp([0, 1], Rotation.from_matrix(poses[:, :3, :3])) for poses in motions]
    for fraction in fractions_before:
        box_pose, ball_pose = (
            pose_matrix((1 - fraction) * poses[0, :3, 3] + fraction * poses[1, :3, 3], rotation(fraction).as_rotvec())
            for poses, rotation in zip(motions, rotations, strict=True)
        )
        assert len(intersecting_faces(box, ball, box_pose, ball_pose)) == 0, fraction


def random_poses_from_to(rng, reach, largest_angle):
    """Two random poses, the second rotated against the first by about ``largest_angle``."""
    first = Rotation.from_rotvec(rng.normal(size=3))
    second = Rotation.from_rotvec(largest_angle * rng.normal(size=3)) * first
    return np.stack([pose_matrix(rng.normal(size=3) * reach, item.as_rotvec()) for item in (first, second)])


def test_bad_input_is_refused_in_a_sentence():
    """Poses are two matrices of 4 x 4 a body: refused are a single matrix, a text, and rotations stretched by 1.5.

    A tolerance, a distance, must be above 0 m.
    """
    ball = ball_mesh(0.1)
    with pytest.raises(InvalidPoseError, match=r"poses_b have shape \(4, 4\); give \(2, 4, 4\)"):
        time_of_impact(ball, AT_REST, ball, np.eye(4))
    with pytest.raises(InvalidPoseError, match="poses_a are not an array"):
        time_of_impact(ball, "here", ball, AT_REST)
    with pytest.raises(InvalidPoseError, match="body B: matrix is not a rotation"):
        time_of_impact(ball, AT_REST, ball, AT_REST * np.diag([1.5, 1.5, 1.5, 1.0]))
    with pytest.raises(InvalidSettingError, match="metres above 0"):
        time_of_impact(ball, AT_REST, ball, AT_REST, tolerance=0.0)
