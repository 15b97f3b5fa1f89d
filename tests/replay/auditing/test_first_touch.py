"""The moment between two frames is that of the closed form, and its point lies on both bodies."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.small_worlds import STEP_NS, along_x, cube, session_of_frames, unit_cubes_on_x

from cdcore.poses import rotation_from_quaternion
from replay.auditing.first_touch import at_touch, first_touch, poses_between
from replay.prepare.assemble import assemble
from sessions import Session

STEP = STEP_NS * 1e-9


def test_a_jump_through_a_cube_touches_on_its_line():
    """From x = 3 to -3 m in a step; unit cubes touch at x = 1 m, after 2 of 6 m."""
    assembly = assemble(unit_cubes_on_x({"a": [0.0] * 4, "b": [3.0, 3.0, -3.0, -3.0]}))
    touch = first_touch(assembly, pair=0, frame=1)
    expected = STEP + STEP * 2 / 6
    assert touch.frame == 1 and touch.free <= expected + 1e-12 and touch.moment == pytest.approx(expected, abs=1e-6)
    assert touch.later_ns == pytest.approx((expected - STEP) * 1e9, abs=1000)
    assert touch.point[0] == pytest.approx(0.5, abs=1e-3) and max(map(abs, touch.point[1:])) <= 0.5 + 1e-9
    assert touch.normal == pytest.approx((1.0, 0.0, 0.0), abs=1e-12)


def test_a_path_that_meets_nothing_has_no_touch():
    """b comes within 2 m and goes away again; frame -1 does not exist, and after frame 2 there is no other.

    In the second session a body has no pose in frame 1.
    """
    separate = assemble(unit_cubes_on_x({"a": [0.0] * 3, "b": [3.0, 2.0, 3.0]}))
    assert [first_touch(separate, 0, frame) for frame in (-1, 0, 1, 2)] == [None] * 4
    lost = assemble(session_of_frames([0, 10 * STEP_NS, 20 * STEP_NS], [[1, 1], [1, 0], [1, 1]]))
    assert not lost.motion.valid.all() and [first_touch(lost, 0, frame) for frame in (0, 1)] == [None, None]


def test_only_the_pair_moves_to_its_touch():
    """b touches a at x = 1 m on its way from 3 to -3 m; c, of no touch, stays at 8 m, its place in frame 1."""
    assembly = assemble(unit_cubes_on_x({"a": [0.0] * 3, "b": [3.0, 3.0, -3.0], "c": [7.0, 8.0, 9.0]}))
    pair = [tuple(ends) for ends in assembly.pairs.tolist()].index((0, 1))
    touch = first_touch(assembly, pair, 1)
    touching = at_touch(assembly, pair, touch).motion
    assert touching.translations[0, :, 0] == pytest.approx([0.0, 1.0, 8.0], abs=1e-3)
    assert touching.times.tolist() == [touch.moment]


def test_between_frames_origins_move_linearly_and_rotations_evenly():
    """A step of 4 m and 2 m with a rotation of 90 degrees about z; a quarter of it has 1 m, 0.5 m and 22.5 degrees."""
    quaternions = np.array([[0, 0, 0, 1.0], [0, 0, np.sin(np.pi / 4), np.cos(np.pi / 4)]])
    poses = {"a": along_x([0, 0]), "b": (np.array([[0.0, 0, 0], [4.0, 2.0, 0]]), quaternions)}
    motion = assemble(Session.from_arrays([0, STEP_NS], poses, {"a": cube(), "b": cube()})).motion
    touching = poses_between(motion, np.array([1]), np.array([0.0, STEP / 4, STEP]))
    assert touching.translations[:, 0] == pytest.approx(np.array([[0, 0, 0], [1, 0.5, 0], [4, 2, 0]]), abs=1e-12)
    quarter = rotation_from_quaternion(np.array([0, 0, np.sin(np.pi / 16), np.cos(np.pi / 16)]))
    assert touching.rotations[1, 0] == pytest.approx(quarter, abs=1e-12)


def test_first_touch_of_a_corner_on_a_face():
    """The corner is half a diagonal, root of 0.75, below the centre, which falls from 2.0 to -0.5 m in one step.

    The face is at a height of 0.5 m, half an edge.
    """
    quaternions = Rotation.align_vectors([[0.0, -1, 0]], [[1.0, 1, 1]])[0].as_quat()
    heights = np.array([2.0, -0.5])
    poses = {
        "a": along_x([0, 0]),
        "b": (np.stack([[0.1, 0.1], heights, [0.2, 0.2]], axis=1), np.tile(quaternions, (2, 1))),
    }
    assembly = assemble(Session.from_arrays([0, STEP_NS], poses, {"a": cube(), "b": cube()}))
    touch = first_touch(assembly, pair=0, frame=0)
    assert touch.moment == pytest.approx(STEP * (2.0 - 0.5 - np.sqrt(0.75)) / 2.5, abs=1e-6)
    assert touch.point == pytest.approx((0.1, 0.5, 0.2), abs=1e-3)
    assert np.abs(touch.normal) == pytest.approx((0.0, 1.0, 0.0), abs=1e-6)


def test_normal_of_a_slow_touch_points_from_body_to_body():
    """The cubes come 2 micrometres nearer in a frame: the gap a microsecond before the touch is rounding alone."""
    assembly = assemble(unit_cubes_on_x({"a": [5.0] * 2, "b": [6.000001, 5.999999]}))
    assert first_touch(assembly, 0, 0).normal == pytest.approx((1.0, 0.0, 0.0), abs=1e-12)
