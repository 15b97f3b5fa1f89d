"""HIT, FREE and UNRESOLVED on ways whose answer is known, forwards, backwards and in parts."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp
from support.shapes import ball_mesh, box_mesh, merge_meshes, shift_mesh, without_faces

from cdcore import Impact, intersecting_faces, time_of_impact
from cdcore.errors import InvalidPoseError, InvalidSettingError

REST = np.tile(np.eye(4), (2, 1, 1))


def pose_matrix(position=(0, 0, 0), rotvec=(0, 0, 0)):
    """A pose as 4x4 matrix."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = Rotation.from_rotvec(rotvec).as_matrix(), position
    return matrix


def poses_from_to(before, after):
    """Poses of two frames."""
    return np.stack([before, after])


def test_ball_through_a_plate_hits_at_the_closed_form():
    """From 0.1 m above to 0.1 m below; the ball of 0.01 m meets the plate's top at 0.001 m after 0.089 of 0.2 m."""
    answer = time_of_impact(
        ball_mesh(0.01),
        poses_from_to(pose_matrix((0, 0, 0.1)), pose_matrix((0, 0, -0.1))),
        box_mesh((0.3, 0.3, 0.002)),
        REST,
    )
    assert answer.verdict is Impact.HIT
    assert answer.toi[0] <= 0.445 <= answer.toi[1] <= answer.toi[0] + 1e-6
    assert answer.inside is False


@pytest.mark.parametrize("degrees", [179, 181])
def test_rotating_rod_hits_posts_on_the_shorter_arc_only(degrees):
    """A rod of 1 m turns about its end by 179 degrees to the left, or by 181, which is 179 to the right."""
    rod = shift_mesh(box_mesh((1.0, 0.02, 0.02)), (0.5, 0, 0))
    post = box_mesh((0.02, 0.02, 1.0))
    turning = poses_from_to(pose_matrix(), pose_matrix(rotvec=(0, 0, np.radians(degrees))))
    left, right = (
        time_of_impact(rod, turning, post, poses_from_to(pose_matrix((0, y, 0)), pose_matrix((0, y, 0))))
        for y in (0.9, -0.9)
    )
    hit, free = (left, right) if degrees < 180 else (right, left)
    assert hit.verdict is Impact.HIT
    assert free.verdict is Impact.FREE
    # The rod's side, 0.01 m beside its axis, reaches the near corner of the post.
    corner = np.array([0.01, 0.89])
    angle = np.arctan2(corner[1], corner[0]) - np.arcsin(0.01 / np.linalg.norm(corner))
    assert hit.toi[0] <= angle / np.radians(179) <= hit.toi[1] <= hit.toi[0] + 1e-6


@pytest.mark.parametrize("gap", [0.0, 2.0**-20, -(2.0**-20), 2.0**-18, -(2.0**-18)])
def test_sliding_along_a_face_touches_or_is_proven_clear(gap):
    """From x = -3 to 3 m; the cube's edge (0.25 m) reaches the floor's (2 m) after 0.75 of 6 m."""
    cube, floor = box_mesh((0.5, 0.5, 0.5)), box_mesh((4, 4, 0.5))
    sliding = poses_from_to(pose_matrix((-3, 0, 0.5 + gap)), pose_matrix((3, 0, 0.5 + gap)))
    answer = time_of_impact(cube, sliding, floor, REST)
    assert answer.verdict is (Impact.FREE if gap > 0 else Impact.HIT)
    if gap <= 0:
        assert answer.toi[0] <= 0.75 / 6 <= answer.toi[1] + 1e-15


def test_contact_at_start_at_end_and_without_motion():
    """Unit heights: at 1 m the cube stands on the floor, at 1.25 m it is 0.25 m above."""
    cube, floor = box_mesh((1, 1, 1)), box_mesh((4, 4, 1))
    lower, upper, far = pose_matrix((0, 0, 1)), pose_matrix((0, 0, 1.25)), pose_matrix((0, 0, 3))
    assert time_of_impact(cube, poses_from_to(lower, far), floor, REST).toi == (0.0, 0.0)
    ending = time_of_impact(cube, poses_from_to(far, lower), floor, REST)
    assert ending.verdict is Impact.HIT
    assert ending.toi[0] >= 1 - 1e-6
    assert ending.toi[1] == 1.0
    assert time_of_impact(cube, poses_from_to(lower, lower), floor, REST).verdict is Impact.HIT
    assert time_of_impact(cube, poses_from_to(upper, upper), floor, REST).verdict is Impact.FREE


def test_impact_reports_inside_beside_the_time_of_impact():
    """A ball of 0.1 m inside a unit box: moved by 0.2 m it stays, moved by 3 m it meets the wall after 0.4 m."""
    ball, box = ball_mesh(0.1), box_mesh((1, 1, 1))
    staying, leaving = (
        poses_from_to(pose_matrix(), pose_matrix((0.2, 0, 0))),
        poses_from_to(pose_matrix(), pose_matrix((3, 0, 0))),
    )
    for first, second, swap in ((ball, box, False), (box, ball, True)):
        poses = (REST, staying) if swap else (staying, REST)
        kept = time_of_impact(first, poses[0], second, poses[1])
        assert (kept.verdict, kept.inside) == (Impact.FREE, True)
    out = time_of_impact(ball, leaving, box, REST)
    assert (out.verdict, out.inside) == (Impact.HIT, True)
    assert out.toi[0] <= 0.4 / 3 <= out.toi[1]
    pair = merge_meshes(ball, shift_mesh(ball, [9, 0, 0]))
    assert time_of_impact(pair, staying, box, REST).inside is True, "one part is inside, the other far outside"
    assert time_of_impact(ball, staying, without_faces(box, count=1), REST).inside is True, "one triangle is missing"
    assert time_of_impact(ball, staying, without_faces(box, count=2), REST).inside is None, "one side is missing"
    assert time_of_impact(ball, staying, merge_meshes(box, box), REST).inside is True, "faces drawn twice count once"
    assert (
        time_of_impact(ball, poses_from_to(pose_matrix((5, 0, 0)), pose_matrix((5, 0, 1))), box, REST).inside is False
    )


def test_witness_faces_meet_at_the_upper_time():
    """The two faces named meet in the poses at the upper bound of the time."""
    ball, box = ball_mesh(0.1), box_mesh((1, 1, 1))
    start, stop = pose_matrix((0, 0.1, 2)), pose_matrix((0.3, 0, -2), (1, 0.5, 0))
    answer = time_of_impact(ball, poses_from_to(start, stop), box, REST)
    assert answer.verdict is Impact.HIT
    fraction = answer.toi[1]
    rotation = Slerp([0, 1], Rotation.from_matrix([start[:3, :3], stop[:3, :3]]))(fraction)
    present = pose_matrix((1 - fraction) * start[:3, 3] + fraction * stop[:3, 3], rotation.as_rotvec())
    result = intersecting_faces(ball, box, present, None).tolist()
    assert list(answer.faces) in result


def random_poses_from_to(rng, reach, largest_angle):
    """Two random poses, the second rotated against the first by about ``largest_angle``."""
    first = Rotation.from_rotvec(rng.normal(size=3))
    second = Rotation.from_rotvec(largest_angle * rng.normal(size=3)) * first
    return np.stack([pose_matrix(rng.normal(size=3) * reach, item.as_rotvec()) for item in (first, second)])


@settings(max_examples=max(10, settings.default.max_examples // 2), deadline=None)
@given(seed=st.integers(0, 10**6), largest_angle=st.floats(0, 1.2))
def test_dense_sampling_contradicts_no_time_of_impact(seed, largest_angle):
    """Eight poses before the time of impact are free of contact."""
    rng = np.random.default_rng(seed)
    a, b = box_mesh(rng.uniform(0.05, 0.6, 3)), ball_mesh(rng.uniform(0.1, 0.4), rings=4, sides=6)
    directions = (
        random_poses_from_to(rng, reach=0.7, largest_angle=largest_angle),
        random_poses_from_to(rng, reach=0.7, largest_angle=largest_angle),
    )
    answer = time_of_impact(a, directions[0], b, directions[1])
    rotations = [Slerp([0, 1], Rotation.from_matrix(item[:, :3, :3])) for item in directions]
    until = 1.0 if answer.toi is None else answer.toi[0]
    for fraction in np.linspace(0, until, 9)[: -1 if answer.toi else None] if until else ():
        poses = [
            pose_matrix((1 - fraction) * item[0, :3, 3] + fraction * item[1, :3, 3], rotated(fraction).as_rotvec())
            for item, rotated in zip(directions, rotations, strict=True)
        ]
        assert not len(intersecting_faces(a, b, *poses))
    if answer.verdict is Impact.HIT:
        assert answer.toi[1] - answer.toi[0] <= 1e-6


def test_bad_input_is_refused_in_a_sentence():
    """Poses are two matrices of 4 x 4 a body: one alone, a text, a stretched one, and a tolerance of 0 m."""
    ball = ball_mesh(0.1)
    with pytest.raises(InvalidPoseError, match=r"poses_b have shape \(4, 4\); give \(2, 4, 4\)"):
        time_of_impact(ball, REST, ball, np.eye(4))
    with pytest.raises(InvalidPoseError, match="poses_a are not an array"):
        time_of_impact(ball, "here", ball, REST)
    with pytest.raises(InvalidPoseError, match="body B"):
        time_of_impact(ball, REST, ball, REST * 1.5)
    with pytest.raises(InvalidSettingError, match="metres above 0"):
        time_of_impact(ball, REST, ball, REST, tolerance=0.0)
