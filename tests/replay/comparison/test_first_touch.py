"""The moment between two frames is that of the closed form, and its point lies on both bodies."""

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from support.small_worlds import STEP_NS, along_x, cube, cubes, framed

from cdcore.transforms.rigid import rotation_from_quaternion
from replay.comparison.first_touch import _direction, at_touch, first_touch, nearest_points, poses_between
from replay.prepare.assemble import assemble
from sessions import Session

STEP = STEP_NS * 1e-9


def test_a_cube_that_jumps_through_another_touches_it_when_and_where_the_line_says():
    assembly = assemble(cubes({"a": [0.0] * 4, "b": [3.0, 3.0, -3.0, -3.0]}))
    touch = first_touch(assembly, 0, 1)
    expected = STEP + STEP * 2 / 6
    assert touch.frame == 1 and touch.free <= expected + 1e-12 and touch.moment == pytest.approx(expected, abs=1e-6)
    assert touch.later_ns == pytest.approx((expected - STEP) * 1e9, abs=1000)
    assert touch.point[0] == pytest.approx(0.5, abs=1e-3) and max(map(abs, touch.point[1:])) <= 0.5 + 1e-9
    assert touch.normal == pytest.approx((1.0, 0.0, 0.0), abs=1e-12)


def test_a_way_that_meets_nothing_has_no_touch_nor_has_one_that_is_not_there():
    apart = assemble(cubes({"a": [0.0] * 3, "b": [3.0, 2.0, 3.0]}))
    assert [first_touch(apart, 0, frame) for frame in (-1, 0, 1, 2)] == [None] * 4
    lost = assemble(framed([0, 10 * STEP_NS, 20 * STEP_NS], [[1, 1], [1, 0], [1, 1]]))
    assert not lost.motion.valid.all() and [first_touch(lost, 0, frame) for frame in (0, 1)] == [None, None]


def test_at_the_touch_the_pair_stands_where_it_meets_and_others_where_they_were():
    assembly = assemble(cubes({"a": [0.0] * 3, "b": [3.0, 3.0, -3.0], "c": [7.0, 8.0, 9.0]}))
    pair = [tuple(ends) for ends in assembly.pairs.tolist()].index((0, 1))
    touch = first_touch(assembly, pair, 1)
    there = at_touch(assembly, pair, touch).motion
    assert there.translations[0, :, 0] == pytest.approx([0.0, 1.0, 8.0], abs=1e-3)
    assert there.times.tolist() == [touch.moment]


def test_between_frames_origins_move_along_lines_and_turns_are_even():
    turn = np.array([[0, 0, 0, 1.0], [0, 0, np.sin(np.pi / 4), np.cos(np.pi / 4)]])
    poses = {"a": along_x([0, 0]), "b": (np.array([[0.0, 0, 0], [4.0, 2.0, 0]]), turn)}
    motion = assemble(Session.from_arrays([0, STEP_NS], poses, {"a": cube(), "b": cube()})).motion
    there = poses_between(motion, np.array([1]), np.array([0.0, STEP / 4, STEP]))
    assert there.translations[:, 0] == pytest.approx(np.array([[0, 0, 0], [1, 0.5, 0], [4, 2, 0]]), abs=1e-12)
    quarter = rotation_from_quaternion(np.array([0, 0, np.sin(np.pi / 16), np.cos(np.pi / 16)]))
    assert there.rotations[1, 0] == pytest.approx(quarter, abs=1e-12)


def test_a_corner_on_a_face_has_the_faces_normal_and_crossing_edges_the_direction_across_both():
    floor = np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]])
    spike = np.array([[0.1, -0.2, 0], [0.3, 0, 1], [-0.3, 0, 1]])
    for one, other in ((spike, floor), (floor, spike)):
        here, there, across = nearest_points(one, other)
        assert here == pytest.approx([0.1, -0.2, 0]) == there and np.abs(across) == pytest.approx([0, 0, 1])
    roof = np.array([[0.0, -1, 0], [0, 1, 0], [0, 0, -1]])
    ridge = np.array([[-1.0, 0, 0], [1, 0, 0], [0, 0, 1]])
    here, there, across = nearest_points(roof, ridge)
    assert here == pytest.approx([0, 0, 0]) == there and np.abs(across) == pytest.approx([0, 0, 1])


def test_without_a_gap_the_normal_is_on_the_side_of_the_second_body():
    across, toward = np.array([0.0, 0, 1]), np.array([0.3, 0, -2])
    assert _direction(np.zeros(3), across, toward).tolist() == [0, 0, -1]
    assert _direction(np.array([0.0, 1e-6, 0]), across, toward).tolist() == [0, 1, 0]


@given(st.integers(0, 10**6))
def test_the_nearest_points_lie_on_their_triangles_and_no_others_are_nearer(seed):
    rng = np.random.default_rng(seed)
    one, other = rng.normal(size=(3, 3)), rng.normal(size=(3, 3)) + np.array([0, 0, 6])
    here, there, _ = nearest_points(one, other)
    for point, triangle in ((here, one), (there, other)):
        assert trimesh.triangles.closest_point(triangle[None], point[None])[0] == pytest.approx(point, abs=1e-9)
    samples = rng.dirichlet(np.ones(3), 400) @ one
    near = trimesh.triangles.closest_point(np.tile(other, (400, 1, 1)), samples)
    assert np.linalg.norm(here - there) <= np.linalg.norm(near - samples, axis=1).min() + 1e-8
