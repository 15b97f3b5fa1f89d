"""The eye finds the side from which nothing hides a contact."""

from dataclasses import replace

import numpy as np
import pytest

from cdcore import Body, Motion, TriangleMesh
from replay.outputs import camera
from replay.prepare.assembly import Assembly
from sessions import Scene


def wall(at, size=0.2):
    """A square across the x axis."""
    corners = [[at, y, z] for y in (-size, size) for z in (-size, size)]
    return TriangleMesh(corners, [[0, 1, 2], [1, 3, 2]])


def still(*bodies):
    count = len(bodies)
    motion = Motion([0.0], np.zeros((1, count, 3)), np.tile(np.eye(3), (1, count, 1, 1)))
    none = np.zeros((0, 2), dtype=np.int64)
    return Assembly(bodies, motion, none, np.zeros(0, bool), np.zeros(1, np.int64), np.ones((1, count), np.uint8))


def test_there_are_32_directions_of_unit_length_all_above_the_bench():
    choices = camera.directions()
    assert choices.shape == (32, 3)
    assert np.allclose(np.linalg.norm(choices, axis=1), 1.0)
    assert choices[:, 1].min() > 0
    assert len(np.unique(choices.round(9), axis=0)) == 32


@pytest.mark.parametrize(("at", "sign"), [(0.03, -1), (-0.03, 1)])
def test_the_eye_stands_on_the_free_side_of_a_wall(at, sign):
    obstacles = camera.Obstacles(still(Body("board", wall(at))), Scene())
    eye = obstacles.close_up(0, (0.0, 0.0, 0.0), np.array([-sign * 1.0, 0.0, 0.0]))
    assert np.sign(eye.position[0]) == sign or eye.position[0] * np.sign(at) < 0.03
    assert np.linalg.norm(eye.position) == pytest.approx(camera.CLOSE_UP)


def test_without_obstacles_the_eye_stands_on_the_users_side():
    obstacles = camera.Obstacles(still(Body("far", wall(5.0))), Scene())
    user = np.array([0.6, 0.0, 0.8])
    eye = obstacles.close_up(0, (0.0, 0.0, 0.0), user)
    assert np.dot(eye.position, user) / camera.CLOSE_UP > 0.9


def test_crossings_are_those_of_a_ray_by_ray_count():
    random = np.random.default_rng(3)
    corners = random.normal(size=(60, 3)) * 0.06
    mesh = TriangleMesh(corners, random.integers(0, 60, (40, 3)))
    rays = camera.directions()
    counted = camera._Surface(mesh).crossings(np.zeros(3), rays, camera.CLOSE_UP)
    slow = np.zeros(len(rays), dtype=int)
    for k, ray in enumerate(rays):
        for a, b, c in mesh.triangles:
            matrix = np.stack([b - a, c - a, -ray], axis=1)
            if abs(np.linalg.det(matrix)) > 1e-15:
                u, v, t = np.linalg.solve(matrix, -a)
                slow[k] += u >= 0 and v >= 0 and u + v <= 1 and 0.003 < t < camera.CLOSE_UP
    assert counted.tolist() == slow.tolist()
    assert slow.sum() > 10


def test_what_stands_before_the_eye_is_what_its_line_of_sight_crosses(demo):
    assembly = demo.assembly
    obstacles = camera.Obstacles(assembly, demo.session.scene)
    rod = assembly.motion.translations[0, assembly.names.index("rod")]
    names = {assembly.names[body] for body in obstacles.hiding(0, eye_beside(rod, 0.05))}
    assert "beaker" in names and "bench" not in names
    assert obstacles.hiding(0, eye_beside(rod, 0.5)) == set()


def eye_beside(place, up):
    """An eye that looks level at a point above a place."""
    x, y, z = place.tolist()
    return camera.Eye((x + 0.2, y + up, z), (x, y + up, z))


def test_a_body_without_a_pose_hides_nothing(demo):
    hidden = still(Body("board", wall(0.03)))
    gone = Motion([0.0], hidden.motion.translations, hidden.motion.rotations, np.zeros((1, 1), dtype=bool))
    user = np.array([1.0, 0.0, 0.0])
    eye = camera.Obstacles(replace(hidden, motion=gone), Scene()).close_up(0, (0.0, 0.0, 0.0), user)
    assert eye.position[0] > 0.09


def test_the_user_is_where_the_headset_is(demo):
    found = camera.towards_user(demo.assembly, demo.session.scene, 0, (0.0, 0.0, 0.0))
    assert np.allclose(found, np.array([0.25, 0.0, 0.7]) / np.hypot(0.25, 0.7))
    assert camera.towards_user(still(Body("x", wall(0.0))), Scene(), 0, (0.0, 0.0, 0.0)).tolist() == [0, 0, 1]


def test_the_overview_holds_every_point_and_wastes_no_room(demo):
    random = np.random.default_rng(1)
    points = random.uniform([-0.5, 0.9, -0.1], [0.5, 1.1, 0.1], (50, 3))
    eye = camera.overview(demo.assembly, demo.session.scene, points, 0)
    local = (points - eye.position) @ camera.look_rotation(eye)
    slope = np.tan(camera.FIELD_OF_VIEW / 2)
    reach = np.maximum(np.abs(local[:, 0]) / (slope * camera.ASPECT), np.abs(local[:, 1]) / slope) / -local[:, 2]
    assert 0.7 < reach.max() < 1.0


def test_a_camera_looks_along_its_negative_third_axis_with_its_head_up():
    turn = camera.look_rotation(camera.Eye((1.0, 1.0, 0.0), (0.0, 0.0, 0.0)))
    assert np.allclose(turn @ turn.T, np.eye(3))
    assert np.linalg.det(turn) == pytest.approx(1.0)
    assert np.allclose(-turn[:, 2], np.array([-1, -1, 0]) / np.sqrt(2))
    assert turn[1, 1] > 0
