"""The moment between two frames is that of the closed form, and its point lies on both bodies."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.small_worlds import STEP_NS, along_x, cube, unit_cubes_on_x

from cdcore import Motion
from replay.auditing.first_touch import at_touch, first_touch, poses_between
from replay.prepare.assemble import assemble
from sessions import Session

STEP = STEP_NS * 1e-9
"""Seconds from frame to frame: 10 ms."""

MICROSECOND = 1e-6
"""Seconds to which the moment of a touch is searched."""


def test_a_jump_through_a_cube_touches_on_its_line():
    """Unit cube b goes from x = 3 to -3 m between frames 1 and 2; it touches cube a at x = 1 m, after 2 of 6 m.

    The point is on a's face at x = 0.5 m, the normal points from a to b; ``free`` is the last moment known apart.
    """
    assembly = assemble(unit_cubes_on_x({"a": [0.0] * 4, "b": [3.0, 3.0, -3.0, -3.0]}))
    touch = first_touch(assembly, pair=0, frame=1)
    after_frame_1 = STEP * 2 / 6
    assert touch.frame == 1
    assert touch.moment == pytest.approx(STEP + after_frame_1, abs=MICROSECOND)
    assert touch.free <= STEP + after_frame_1 + 1e-12  # seconds of rounding
    assert touch.later_ns == pytest.approx(after_frame_1 * 1e9, abs=MICROSECOND * 1e9)
    x, y, z = touch.point
    assert x == pytest.approx(0.5, abs=1e-3)  # b moves 0.6 mm in a microsecond
    assert max(abs(y), abs(z)) <= 0.5 + 1e-9
    assert touch.normal == pytest.approx((1.0, 0.0, 0.0), abs=1e-12)


def test_a_path_that_meets_nothing_has_no_touch():
    """Unit cube b comes to x = 2 m and goes away again: no touch at a, which would be at x = 1 m.

    Of frames 0 to 2 there is no frame -1, and after frame 2 there is no other.
    """
    separate = assemble(unit_cubes_on_x({"a": [0.0] * 3, "b": [3.0, 2.0, 3.0]}))
    assert [first_touch(separate, pair=0, frame=frame) for frame in (-1, 0, 1, 2)] == [None] * 4


def test_touch_needs_both_poses_in_both_frames():
    """Unit cube b jumps through a, from x = 3 to -3 m and back; without its pose at -3 m neither jump has a touch."""
    assembly = assemble(unit_cubes_on_x({"a": [0.0] * 3, "b": [3.0, -3.0, 3.0]}))
    assert None not in [first_touch(assembly, pair=0, frame=frame) for frame in (0, 1)]
    motion, b = assembly.motion, 1
    has_pose = np.ones((3, 2), dtype=bool)
    has_pose[1, b] = False
    lost = replace(assembly, motion=Motion(motion.times, motion.translations, motion.rotations, has_pose))
    assert [first_touch(lost, pair=0, frame=frame) for frame in (0, 1)] == [None, None]


def test_only_the_pair_moves_to_its_touch():
    """After frame 1, b goes from x = 3 to -3 m and touches a at x = 1 m; c stays at 8 m, where it is in frame 1.

    The answer is a single frame, whose time is the moment of the touch.
    """
    assembly = assemble(unit_cubes_on_x({"a": [0.0] * 3, "b": [3.0, 3.0, -3.0], "c": [7.0, 8.0, 9.0]}))
    pair = assembly.pairs.tolist().index([0, 1])
    touch = first_touch(assembly, pair, frame=1)
    touching = at_touch(assembly, pair, touch).motion
    x_of_each_body = touching.translations[0, :, 0]
    assert x_of_each_body == pytest.approx([0.0, 1.0, 8.0], abs=1e-3)
    assert touching.times.tolist() == [touch.moment]


def test_between_frames_origins_move_linearly_and_rotations_evenly():
    """In a step b moves 4 m in x and 2 m in y and turns by 90 degrees; a quarter is 1 m, 0.5 m and 22.5 degrees."""
    rotations = Rotation.from_euler("z", [[0.0], [90.0]], degrees=True)
    poses = {"a": along_x([0, 0]), "b": (np.array([[0.0, 0, 0], [4.0, 2.0, 0]]), rotations.as_quat())}
    motion = assemble(Session.from_arrays([0, STEP_NS], poses, {"a": cube(), "b": cube()})).motion
    b = 1
    between = poses_between(motion, bodies=np.array([b]), moments=np.array([0.0, STEP / 4, STEP]))
    assert between.translations[:, 0] == pytest.approx(np.array([[0, 0, 0], [1, 0.5, 0], [4, 2, 0]]), abs=1e-12)
    quarter = Rotation.from_euler("z", 22.5, degrees=True).as_matrix()
    assert between.rotations[1, 0] == pytest.approx(quarter, abs=1e-12)


def test_first_touch_of_a_corner_on_a_face():
    """A unit cube stands on its corner, half a diagonal below its centre, which falls from 2.0 to -0.5 m in one step.

    The face that it falls on is at a height of 0.5 m, half the edge of the cube about the origin.
    """
    from_height, to_height, face_height = 2.0, -0.5, 0.5
    half_diagonal = np.sqrt(3.0) / 2
    corner_down, _ = Rotation.align_vectors([[0.0, -1, 0]], [[1.0, 1, 1]])
    centres = [[0.1, from_height, 0.2], [0.1, to_height, 0.2]]
    poses = {"a": along_x([0, 0]), "b": (np.array(centres), np.tile(corner_down.as_quat(), (2, 1)))}
    assembly = assemble(Session.from_arrays([0, STEP_NS], poses, {"a": cube(), "b": cube()}))
    touch = first_touch(assembly, pair=0, frame=0)
    fraction_of_the_step = (from_height - half_diagonal - face_height) / (from_height - to_height)
    assert touch.moment == pytest.approx(STEP * fraction_of_the_step, abs=MICROSECOND)
    assert touch.point == pytest.approx((0.1, face_height, 0.2), abs=1e-3)
    assert np.abs(touch.normal) == pytest.approx((0.0, 1.0, 0.0), abs=1e-6)


def test_normal_of_a_slow_touch_points_from_body_to_body():
    """Unit cube b comes 2 micrometres nearer in 10 ms, to x = 5.999999 m; at 6 m it touches a, which is at 5 m.

    A microsecond before the touch the gap is 2e-10 m, rounding alone; the normal is the way from a to b all the same.
    """
    assembly = assemble(unit_cubes_on_x({"a": [5.0] * 2, "b": [6.000001, 5.999999]}))
    assert first_touch(assembly, pair=0, frame=0).normal == pytest.approx((1.0, 0.0, 0.0), abs=1e-12)
